"""Retrieval by whole, partial and incomplete shapes: tables 5.2 and 5.4 of the thesis, on shapes of our own.

Descriptors are kept in a folder, so that a second run only measures distances.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))
from asking import draw_options, setting
from describing import Failure, Store, describe_all
from draws import Draw, Shape, Version, complete, make, own_choice
from methods import METHODS, SLOW, Method, Trainable
from outputs import give_out
from rich.progress import track
from rich.status import Status
from scores import Outcome, differences, four_legged_as_one, rates

PROTOCOLS = ("mixed", "complete")
QUICK_METHODS = ("patches, default codebook", "thesis, cotangent", "ShapeDNA")


def ready(method: Method, some: Sequence[Shape], store: Store) -> Method:
    """Let a method learn from complete shapes, where it does and has not yet."""
    if not isinstance(method, Trainable):
        return method
    with Status(f"{method.name}: learning"):
        return store.lesson(
            method, some, lambda: method.train(make(complete(shape)) for shape in some)
        )


def outcomes(
    method: Method,
    store: Store,
    queries: Sequence[Version],
    database: Sequence[Version],
    asking: Method | None = None,
) -> list[Outcome]:
    """Ask for each query; a shape without descriptor is no answer, and a query without has none."""
    ranked = answers(method, store, queries, database, asking)
    return [
        Outcome(query.kind, query.shape.label, tuple(version.shape.label for version in found))
        for query, found in zip(queries, ranked, strict=True)
    ]


def answers(
    method: Method,
    store: Store,
    queries: Sequence[Version],
    database: Sequence[Version],
    asking: Method | None = None,
) -> list[tuple[Version, ...]]:
    """Return for each query what was described of other poses, nearest first; another method may describe queries."""
    entries = [(version, store.load(method, version)) for version in database]
    known = [(version, entry) for version, entry in entries if not isinstance(entry, Failure)]
    found: list[tuple[Version, ...]] = []
    for query in queries:
        entry, order = store.load(asking or method, query), np.empty(0, dtype=np.int64)
        if not isinstance(entry, Failure):
            order = method.distances(entry, [other for _, other in known]).argsort(kind="stable")
        found.append(
            tuple(known[place][0] for place in order if known[place][0].shape != query.shape)
        )
    return found


def among_all(one: Draw, some: Sequence[Shape]) -> Draw:
    """Return a draw whose databases hold all poses, also those of queries: each is asked for among all others."""
    everyone = [own_choice(shape, one.seed)[1] for shape in some]
    return replace(one, mixed=tuple(everyone), complete=tuple(map(complete, some)))


def asked(method: Method, store: Store, draws: Sequence[Draw]) -> dict[str, list[Outcome]]:
    """Return the outcomes of all draws in both protocols."""
    return {
        protocol: [
            one
            for each in draws
            for one in outcomes(method, store, each.queries, getattr(each, protocol))
        ]
        for protocol in PROTOCOLS
    }


def measure(found: dict[str, dict[str, list[Outcome]]], reference: str) -> dict[str, object]:
    """Return all rates, by protocol and method, and differences to the reference."""
    results: dict[str, object] = {}
    for protocol in PROTOCOLS:
        results[protocol] = {name: rates(each[protocol]) for name, each in found.items()}
        one = {
            name: [four_legged_as_one(outcome) for outcome in each[protocol]]
            for name, each in found.items()
        }
        results[f"{protocol}, four-legged as one"] = {
            name: rates(each) for name, each in one.items()
        }
        if reference in found:
            others = {name: each[protocol] for name, each in found.items() if name != reference}
            results[f"{protocol}, less {reference}"] = {
                name: differences(each, found[reference][protocol]) for name, each in others.items()
            }
    return results


def main() -> None:
    """Draw, describe, ask, print and save."""
    parser = draw_options(__doc__, "ch5-results.json")
    parser.add_argument(
        "--among-all", action="store_true", help="leave the poses of other queries in the database"
    )
    parser.add_argument(
        "--methods", nargs="*", choices=sorted(METHODS), help="all but the slowest; quickly, three"
    )
    parser.add_argument(
        "--against",
        choices=sorted(METHODS),
        default="thesis, cotangent",
        help="of paired differences",
    )
    chosen = parser.parse_args()
    every_method = [name for name in METHODS if name not in SLOW]
    names = chosen.methods or (QUICK_METHODS if chosen.quick else every_method)
    have = setting(chosen)
    draws = [among_all(one, have.some) for one in have.draws] if chosen.among_all else have.draws
    methods = {name: ready(METHODS[name], have.others, have.store) for name in names}
    versions = [
        version
        for each in draws
        for part in (each.queries, each.mixed, each.complete)
        for version in part
    ]
    failed = describe_all(
        have.store, list(methods.values()), list(dict.fromkeys(versions)), chosen.workers
    )
    found = {
        name: asked(method, have.store, draws) for name, method in track(methods.items(), "asking")
    }
    counts = {
        "shapes": len(have.some),
        "queries": sum(len(each.queries) for each in draws),
        "draws": len(draws),
    }
    results = {"counts": counts, "without descriptor": failed, **measure(found, chosen.against)}
    give_out(results, chosen.out)


if __name__ == "__main__":
    main()
