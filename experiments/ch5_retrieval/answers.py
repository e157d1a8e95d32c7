"""What answers say beside their order: that nothing is alike, and which class is meant, with its probability.

Each query of `run.py` asks the mixed database, and once more the same without its class. Descriptors are those that
`run.py` keeps, by the codebook that comes with the library.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))
from asking import draw_options, setting
from describing import Failure, Store, describe_all
from draws import Draw, Version
from methods import METHODS, Trainable
from outputs import give_out
from rich.progress import track
from scores import FOUR_LEGGED, interval

import eigenshape as es

METHOD = "patches, default codebook"
ALIKE = FOUR_LEGGED | {"centaur"}  # if one of them is absent, all are: a horse is like a dog
N_BINS = 5


@dataclass(frozen=True)
class Answer:
    """What was said of one query: its kind, whether its class was there, and what came of it."""

    kind: str
    present: bool
    right: bool
    nothing_alike: bool
    probability: float


def answers(store: Store, method: Any, one: Draw) -> Iterator[Answer]:
    """Ask with all queries of a draw, with their class in the database and without."""
    entries = [(version, store.load(method, version)) for version in one.mixed]
    known = [(version, entry) for version, entry in entries if not isinstance(entry, Failure)]
    everything = index_of(known)
    for label in sorted({query.shape.label for query in one.queries}):
        alike = ALIKE if label in ALIKE else {label}
        others = index_of([each for each in known if each[0].shape.label not in alike])
        queries = [query for query in one.queries if query.shape.label == label]
        for query in queries:
            entry = store.load(method, query)
            if not isinstance(entry, Failure):
                yield answer(everything, query, entry, present=True)
                yield answer(others, query, entry, present=False)


def index_of(known: Sequence[tuple[Version, Any]]) -> es.ShapeIndex:
    """Return a temporary index of described versions."""
    index = es.ShapeIndex.create(None)
    index.add_many(
        es.retrieval.DescribedShape(version.name, [entry], label=version.shape.label)
        for version, entry in known
    )
    return index


def answer(index: es.ShapeIndex, query: Version, entry: Any, *, present: bool) -> Answer:
    """Ask an index, and compare what it says with the class of the query."""
    matches = index.query(entry)
    label, probability = next(iter(matches.classify().items()))
    right = label == query.shape.label
    return Answer(query.kind, present, right, matches.nothing_alike, probability)


def measure(found: Sequence[Answer]) -> dict[str, Any]:
    """Return the shares of warnings in per cent with intervals, and how true the probabilities are."""
    results: dict[str, Any] = {}
    for group, is_whole in (("complete", True), ("incomplete", False)):
        some = [each for each in found if (each.kind == "complete") == is_whole]
        results[f"warned, {group}"] = {
            "right": warned([each for each in some if each.present and each.right]),
            "wrong": warned([each for each in some if each.present and not each.right]),
            "absent": warned([each for each in some if not each.present]),
        }
    known = [each for each in found if each.present]
    chance = np.array([each.probability for each in known])
    right = np.array([each.right for each in known], dtype=np.float64)
    bins = np.array_split(np.argsort(chance, kind="stable"), N_BINS)
    results["probability"] = {
        "right": round(float(right.mean()), 3),
        "Brier score": round(float(((chance - right) ** 2).mean()), 4),
        "Brier score of the mean": round(float(right.mean() * (1 - right.mean())), 4),
        "mean probability, share right": [
            [round(float(chance[rows].mean()), 2), round(float(right[rows].mean()), 2)]
            for rows in bins
        ],
    }
    return results


def warned(some: Sequence[Answer]) -> list[float]:
    """Return the share that is said to have nothing alike, with its interval; nothing for no answers."""
    return interval(np.array([each.nothing_alike for each in some], float)) if some else []


def main() -> None:
    """Draw, describe, ask, print and save."""
    chosen = draw_options(__doc__, "ch5-answers.json").parse_args()
    have = setting(chosen)
    method = cast(Trainable, METHODS[METHOD]).train([])
    versions = [version for each in have.draws for version in (*each.queries, *each.mixed)]
    describe_all(have.store, [method], list(dict.fromkeys(versions)), chosen.workers)
    found = [
        one for each in track(have.draws, "asking") for one in answers(have.store, method, each)
    ]
    give_out({"queries": len(found) // 2, **measure(found)}, chosen.out)


if __name__ == "__main__":
    main()
