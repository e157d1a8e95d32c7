"""Queries with noise, of another resolution, from a depth camera, or turned over, among shapes that are as they were.

Descriptors are kept in the folder that `run.py` uses, so that the database is described once.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))
from asking import draw_options, setting
from describing import describe_all
from draws import Draw, Version
from methods import METHODS
from outputs import give_out
from perturbing import CHANGES, CLEAN, FLIPPED, SCANS
from run import outcomes, ready
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


def main() -> None:
    """Draw, describe, ask, print and save."""
    parser = draw_options(__doc__, "ch5-robustness.json")
    parser.add_argument("--changes", nargs="*", choices=CHANGES, help="all; quickly, three")
    chosen = parser.parse_args()
    have = setting(chosen)
    # The default codebook is there already; that of the other half takes a minute to learn.
    patches = METHODS["patches, default codebook" if chosen.quick else "patches"]
    method = ready(patches, have.others, have.store)
    cures = [Asking(method, cure) for cure in CURES]
    every_change = QUICK_CHANGES if chosen.quick else CHANGES
    changes = list(dict.fromkeys([CLEAN, *(chosen.changes or every_change)]))
    database = [version for each in have.draws for version in each.mixed]
    asked = [query for each in have.draws for change in changes for query in queries(each, change)]
    failed = describe_all(have.store, [method], list(dict.fromkeys(database)), chosen.workers)
    failed |= describe_all(have.store, cures, list(dict.fromkeys(asked)), chosen.workers)
    found = {
        change: {
            cure.name: [
                one
                for each in have.draws
                for one in outcomes(method, have.store, queries(each, change), each.mixed, cure)
            ]
            for cure in cures
        }
        for change in changes
    }
    counts = {
        "shapes": len(have.some),
        "queries": len(found[CLEAN]["as it is"]),
        "draws": len(have.draws),
    }
    results = {"counts": counts, "without descriptor": failed, "rates": measure(found)}
    give_out(results, chosen.out)


if __name__ == "__main__":
    main()
