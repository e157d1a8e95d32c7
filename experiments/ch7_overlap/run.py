"""What do two parts of a shape share? The region that both have, and the map in it, in two poses.

What is done is kept in a folder, so that a stopped run goes on where it was.
"""

import sys
import time
from pathlib import Path

import numpy as np
from overlaps import KINDS, OVERLAPS, Pair, make_pair, make_strangers
from rich.progress import track

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of, output_folder
from real_shapes import require_data

SEEDS = {"creature": (1,), "animal": (1, 2)}  # each is a pair of poses
STRANGER, DISJOINT = "parts of two shapes", "disjoint parts"
QUICK = [("lizard", 0.8, 1), ("lizard", DISJOINT, 1)]
RIGHT = 5.0  # hundredths of the root of the area, as in the confidence
BINS = np.linspace(0, 1, 6)


def list_pairs(half: str) -> list[tuple]:
    """List kind, overlap and seed of each pair."""
    return [
        (kind, overlap, seed)
        for kind in KINDS[half]
        for seed in SEEDS["creature" if kind in es.shapes.CREATURES else "animal"]
        for overlap in (*OVERLAPS, DISJOINT, STRANGER)
    ]


def draw_pair(kind: str, overlap: float | str, seed: int, half: str) -> Pair:
    """Return a pair of parts, or of parts that share nothing."""
    if overlap == STRANGER:
        kinds = KINDS[half]
        return make_strangers(kind, kinds[(kinds.index(kind) + 1) % len(kinds)], seed)
    return make_pair(kind, 0.0 if overlap == DISJOINT else overlap, seed)


def measure(pair: Pair) -> dict[str, np.ndarray]:
    """Match a pair: intersection over union on both parts, errors and confidence in the overlap."""
    begin = time.process_time()
    match = es.match_shapes(pair.one, pair.two, overlap="partial")
    seconds = time.process_time() - begin
    rates = []
    for mesh, found, shared in zip(
        (pair.one, pair.two), (match.mapped, match.covered), pair.shared, strict=True
    ):
        areas = es.geometry.dual_volumes(mesh)
        rates.append(areas[found & shared].sum() / max(areas[found | shared].sum(), 1e-300))
    both = match.mapped[pair.shared[0]]
    ends = match.vertices[pair.shared[0]][both]
    # The nearest vertex of a true place is 0 away from itself, so errors are to about half an edge.
    errors = 100 * pair.distances[np.flatnonzero(both), ends]
    right = np.zeros(pair.one.n_vertices, dtype=bool)
    right[np.flatnonzero(pair.shared[0])[both]] = errors < RIGHT
    return {
        "rates": np.array(rates),
        "errors": errors,
        "found": match.mapped,
        "confidence": match.confidence,
        "evidence": match.evidence,
        "right": right,
        "seconds": np.array(seconds),
    }


def kept(folder: Path, wanted: tuple, half: str) -> dict[str, np.ndarray]:
    """Measure a pair, or read what was measured before."""
    kind, overlap, seed = wanted
    file = folder / f"{half}-{kind}-{overlap}-{seed}.npz"
    if not file.exists():
        np.savez_compressed(file, **measure(draw_pair(*wanted, half)))
    return dict(np.load(file))


def summarize(rows: list[dict[str, np.ndarray]]) -> dict[str, float]:
    """Return how many pairs were found, the mean intersection over union, and errors."""
    found = [row for row in rows if row["found"].any()]
    errors = [row["errors"].mean() for row in found if len(row["errors"])]
    good = [row for row in found if row["rates"].mean() > 0.5]
    return {
        "pairs": len(rows),
        "found": len(found) / len(rows),
        "intersection over union": float(np.mean([row["rates"].mean() for row in rows])),
        "over one half": len(good) / len(rows),
        "error": float(np.mean(errors)) if errors else None,
        "error of those over one half": float(np.mean([row["errors"].mean() for row in good]))
        if good
        else None,
    }


def calibrate(rows: list[dict[str, np.ndarray]]) -> list[list[float]]:
    """Return, for each fifth of confidence, its mean, the share that is right, and the count."""
    sure = np.concatenate([row["confidence"][row["found"]] for row in rows])
    right = np.concatenate([row["right"][row["found"]] for row in rows])
    places = np.clip(np.digitize(sure, BINS) - 1, 0, len(BINS) - 2)
    return [
        [float(sure[inside].mean()), float(right[inside].mean()), int(inside.sum())]
        for inside in (places == number for number in range(len(BINS) - 1))
        if inside.any()
    ]


def main() -> None:
    """Measure every pair, print and save the table."""
    parser = options_of(__doc__, quick="two pairs of lizards", out="ch7-overlap.json")
    parser.add_argument("--half", choices=list(KINDS), default="reporting", help="which kinds")
    parser.add_argument(
        "--db", type=output_folder, default="ch7-overlap", help="folder of what is done, kept"
    )
    parser.add_argument("--sample", type=int, help="number of pairs that are drawn; by default all")
    arguments = parser.parse_args()
    if not arguments.quick:
        require_data()
    half = arguments.half
    pairs = QUICK if arguments.quick else list_pairs(half)
    # Pairs in any order, so that the first few are a sample of all
    order = np.random.default_rng(0).permutation(len(pairs))[: arguments.sample]
    pairs = [pairs[number] for number in order]
    rows = [(one, kept(arguments.db, one, half)) for one in track(pairs, half)]
    drawn = {overlap for _, overlap, _ in pairs}
    overlaps = [overlap for overlap in (*OVERLAPS, DISJOINT, STRANGER) if overlap in drawn]
    results = {
        str(overlap): summarize([row for one, row in rows if one[1] == overlap])
        for overlap in overlaps
    }
    if not arguments.quick:
        sharing = [row for one, row in rows if one[1] in OVERLAPS]
        strange = [row for one, row in rows if one[1] not in OVERLAPS]
        results["all that overlap"] = summarize(sharing)
        results["false overlaps"] = float(np.mean([row["found"].any() for row in strange]))
        results["confidence"] = calibrate([row for _, row in rows])
        results["seconds"] = float(np.median([row["seconds"] for _, row in rows]))
    give_out(rounded(results), arguments.out)


if __name__ == "__main__":
    main()
