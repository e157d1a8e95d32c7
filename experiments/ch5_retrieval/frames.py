"""Queries from a depth camera: one frame, or five that are fused; shapes are described with frames or without.

Descriptors are kept in the folder that `run.py` uses.
"""

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.append(str(Path(__file__).resolve().parents[1]))
from asking import draw_options, setting
from describing import Failure, Store
from draws import KINDS, Draw, Version, make
from outputs import give_out
from perturbing import CLEAN
from real_shapes import DATA
from rich.progress import track
from scores import Outcome, differences, rates
from threadpoolctl import threadpool_limits

import eigenshape as es

N_FRAMES = 6  # by which each closed shape of the database is described, beside its six views
N_VIEWS = 6
STEP = 30.0  # degrees from frame to frame of those that are fused: a walk of 120 degrees
FUSED = "five frames, fused"
QUERIES = (CLEAN, "scanner", "scanner, all pieces", FUSED)
DATABASES = ("as today", "with frames")


@dataclass(frozen=True)
class Method:
    """What the names of stored descriptors depend on."""

    what: str = f"default codebook, {N_FRAMES} frames"


def five_frames(version: Version) -> list[es.TriangleMesh]:
    """Return frames around the side that the version is seen from, each turned and moved at random."""
    start = np.random.default_rng(
        [version.seed, version.shape.number, 1 + KINDS.index(version.kind)]
    )
    view = start.standard_normal(3)
    rng = np.random.default_rng([version.seed, version.shape.number, 2 + len(KINDS)])
    across = np.cross(view, rng.standard_normal(3))
    whole = es.read_mesh(DATA / version.shape.path)
    frames = []
    for number in range(-2, 3):
        turn = Rotation.from_rotvec(np.deg2rad(STEP * number) * across / np.linalg.norm(across))
        scan = es.scans.simulate_scan(whole, rng, view=turn.apply(view)).mesh
        placed = scan.vertices @ Rotation.random(rng=rng).as_matrix().T + rng.standard_normal(3)
        frames.append(es.TriangleMesh(placed, scan.faces))
    return frames


def describe(version: Version) -> tuple[es.retrieval.PatchDescriptor, int]:
    """Return the descriptor of a version, with frames if it is closed, and the number of fused frames."""
    n_joined, mesh = 1, None
    if version.change == FUSED:
        fused = es.matching.fuse_scans(five_frames(version), bend=False)
        n_joined, mesh = int(fused.joined.sum()), fused.mesh
    patches = es.retrieval.extract_patches(mesh or make(version), n_frames=N_FRAMES)
    return es.retrieval.patch_descriptor(patches, es.retrieval.PatchRecipe()), n_joined


def describe_and_keep(store: Store, version: Version) -> None:
    """Describe a version, or keep the reason why it cannot be."""
    try:
        found: Any = describe(version)
    except es.EigenshapeError as error:
        found = Failure(str(error))
    store.save(Method(), version, found)


def describe_all(store: Store, versions: Sequence[Version], workers: int) -> None:
    """Describe what the store lacks."""
    store.folder.mkdir(parents=True, exist_ok=True)
    todo = [version for version in versions if not store.path(Method(), version).exists()]
    with ProcessPoolExecutor(workers, initializer=threadpool_limits, initargs=(1,)) as pool:
        futures = [pool.submit(describe_and_keep, store, version) for version in todo]
        for future in track(as_completed(futures), "describing", total=len(futures)):
            future.result()


def without_frames(found: es.retrieval.PatchDescriptor) -> es.retrieval.PatchDescriptor:
    """Return the descriptor as it is by default."""
    n_kept = min(len(found.codes), 1 + N_VIEWS)
    return replace(found, codes=found.codes[:n_kept], points=found.points[:n_kept])


def outcomes(
    store: Store, queries: Sequence[Version], database: Sequence[Version], kind: str
) -> list[Outcome]:
    """Ask for each query; one that cannot be described has no answer."""
    entries = [(version, store.load(Method(), version)) for version in database]
    known = [(version, entry[0]) for version, entry in entries if not isinstance(entry, Failure)]
    if kind == DATABASES[0]:
        known = [(version, without_frames(entry)) for version, entry in known]
    found = []
    for query in queries:
        entry, ranking = store.load(Method(), query), ()
        if not isinstance(entry, Failure):
            scores = es.retrieval.patch_scores(entry[0], [each for _, each in known])
            order = scores.argsort(kind="stable")
            others = [known[place][0].shape for place in order]
            ranking = tuple(other.label for other in others if other != query.shape)
        found.append(Outcome(query.kind, query.shape.label, ranking))
    return found


def measure(store: Store, draws: Sequence[Draw]) -> dict[str, Any]:
    """Return rates by database and query, and differences to the clean part among shapes as today."""
    results: dict[str, Any] = {}
    for protocol in ("mixed", "complete"):
        clean: list[Outcome] = []
        for kind in DATABASES:
            for change in QUERIES:
                found = [
                    one
                    for each in draws
                    for one in outcomes(store, asked(each, change), getattr(each, protocol), kind)
                ]
                clean = clean or found
                results[f"{protocol}, {kind}, {change}"] = {
                    **rates(found)["all"],
                    "difference": differences(found, clean)["all"]["top3"],
                }
    return results


def asked(each: Draw, change: str) -> list[Version]:
    """Return the partial queries of a draw, seen otherwise."""
    return [replace(query, change=change) for query in each.queries if query.kind == "partial"]


def main() -> None:
    """Draw, describe, ask, print and save."""
    chosen = draw_options(__doc__, "ch5-frames.json").parse_args()
    have = setting(chosen)
    queries = [query for each in have.draws for change in QUERIES for query in asked(each, change)]
    database = [version for each in have.draws for version in (*each.mixed, *each.complete)]
    describe_all(have.store, list(dict.fromkeys([*queries, *database])), chosen.workers)
    fused = [have.store.load(Method(), query) for query in queries if query.change == FUSED]
    n_fused = [0 if isinstance(one, Failure) else one[1] for one in fused]
    counts = {
        "shapes": len(have.some),
        "queries": len(queries) // len(QUERIES),
        "draws": len(have.draws),
        "fused frames": float(np.mean(n_fused)),
    }
    failed = {
        version.name: entry.reason
        for version in (*queries, *database)
        if isinstance(entry := have.store.load(Method(), version), Failure)
    }
    rates = measure(have.store, have.draws)
    give_out({"counts": counts, "without descriptor": failed, "rates": rates}, chosen.out)


if __name__ == "__main__":
    main()
