"""Queries with noise, of another resolution, from a depth camera, or turned over, among shapes that are as they were.

Descriptors are kept in the folder that `run.py` uses, so that the database is described once.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))
from describing import Store, describe_all
from draws import HALVES, Draw, Version, draw, half_of, shapes
from methods import METHODS
from outputs import give_out, output_file, output_folder
from perturbing import CHANGES, CLEAN, FLIPPED, SCANS
from real_shapes import require_data
from run import QUICK_CLASSES, QUICK_QUERIES, SEEDS, outcomes, ready
from scores import Outcome, differences, rates

import eigenshape as es

QUICK_CHANGES = (CLEAN, "noise .25", FLIPPED)
GROUP = "incomplete"  # partial ones too, as everywhere here
CURES = ("as it is", "outward, denoised")


@dataclass(frozen=True)
class Asking:
    """Patches of queries as these are, or as the method takes them, turned outward and denoised."""

    method: Any
    cure: str

    @property
    def name(self) -> str:
        """Return what tables call it."""
        return self.cure

    def describe(self, mesh: es.TriangleMesh) -> Any:
        """Return the descriptor."""
        if self.cure == CURES[1]:
            return self.method.describe(mesh)
        patches = es.retrieval.extract_patches(mesh, n_views=0, clean=False)
        return es.retrieval.patch_descriptor(patches, self.method.recipe)

    def distances(self, query: Any, described: Sequence[Any]) -> np.ndarray:
        """Return the method's scores."""
        return self.method.distances(query, described)


def queries(each: Draw, change: str) -> list[Version]:
    """Return what a draw asks for that is not complete, changed; a depth camera makes partial ones only."""
    kinds = ("partial",) if change in SCANS else ("partial", "incomplete")
    return [replace(query, change=change) for query in each.queries if query.kind in kinds]


def loss(found: Sequence[Outcome], clean: Sequence[Outcome], change: str) -> list[float]:
    """Return by how much Top-3 is lower than of the same queries when nothing was done to them, with its interval."""
    same = [one for one in clean if change not in SCANS or one.kind == "partial"]
    return differences(same, found)[GROUP]["top3"]


def measure(found: dict[str, dict[str, list[Outcome]]]) -> dict[str, Any]:
    """Return rates and losses by change and cure; what is lost is counted from clean queries as they are."""
    clean = found[CLEAN]["as it is"]
    return {
        change: {
            cure: {**rates(each)[GROUP], "loss": loss(each, clean, change)}
            for cure, each in row.items()
        }
        for change, row in found.items()
    }


def table(results: dict[str, Any]) -> str:
    """Return Top-1 / Top-3 / Top-5, and how far Top-3 is from that of clean queries as they are, with its interval."""
    lines = ["| query | " + " | ".join(CURES) + " |", "|" + "---|" * (len(CURES) + 1)]
    return "\n".join(
        lines
        + [
            f"| {change} | " + " | ".join(cell(row[cure]) for cure in CURES) + " |"
            for change, row in results.items()
        ]
    )


def cell(measures: dict[str, list[float]]) -> str:
    """Return one cell of the table."""
    hits = " / ".join(f"{measures[name][0]:.1f}" for name in ("top1", "top3", "top5"))
    mean, low, high = measures["loss"]
    return f"{hits}, {0 - mean:+.1f} [{0 - high:+.0f}, {0 - low:+.0f}]"


def arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--quick", action="store_true", help=f"classes {', '.join(QUICK_CLASSES)}, one draw"
    )
    parser.add_argument("--half", choices=HALVES, default="reporting")
    parser.add_argument("--draws", type=int, nargs="*", default=SEEDS, help="seeds of the draws")
    parser.add_argument("--changes", nargs="*", choices=CHANGES, help="all; quickly, three")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--cache", type=output_folder, default="ch5-descriptors", help="folder of descriptors, kept"
    )
    parser.add_argument("--out", type=output_file, default="ch5-robustness.json")
    chosen = parser.parse_args()
    if chosen.changes is None:
        chosen.changes = QUICK_CHANGES if chosen.quick else CHANGES
    return chosen


def main() -> None:
    """Draw, describe, ask, print and save."""
    chosen = arguments()
    require_data()
    everything = [shape for shape in shapes() if not chosen.quick or shape.label in QUICK_CLASSES]
    some = half_of(everything, chosen.half)
    seeds, numbers = (chosen.draws[:1], QUICK_QUERIES) if chosen.quick else (chosen.draws, (18, 32))
    draws = [draw(some, seed, *numbers) for seed in seeds]
    store = Store(chosen.cache)
    # The default codebook is there already; that of the other half takes a minute to learn.
    patches = METHODS["patches, default codebook" if chosen.quick else "patches"]
    method = ready(patches, [shape for shape in everything if shape not in some], store)
    cures = [Asking(method, cure) for cure in CURES]
    changes = list(dict.fromkeys([CLEAN, *chosen.changes]))
    database = [version for each in draws for version in each.mixed]
    asked = [query for each in draws for change in changes for query in queries(each, change)]
    failed = describe_all(store, [method], list(dict.fromkeys(database)), chosen.workers)
    failed |= describe_all(store, cures, list(dict.fromkeys(asked)), chosen.workers)
    found = {
        change: {
            cure.name: [
                one
                for each in draws
                for one in outcomes(method, store, queries(each, change), each.mixed, cure)
            ]
            for cure in cures
        }
        for change in changes
    }
    results, counts = (
        measure(found),
        {"shapes": len(some), "queries": len(found[CLEAN]["as it is"]), "draws": len(draws)},
    )
    print(
        f"{counts['queries']} queries in {counts['draws']} draws of {counts['shapes']} shapes\n\n{table(results)}"
    )
    give_out({"counts": counts, "without descriptor": failed, "rates": results}, chosen.out)


if __name__ == "__main__":
    main()
