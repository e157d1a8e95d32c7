"""How much of a shape gets the right name from one labeled shape, and from several.

What is done is kept in a folder, so that a stopped run goes on where it was.
"""

import json
import sys
from functools import lru_cache
from pathlib import Path

import numpy as np
from rich.progress import track

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import give_out, options_of, output_folder
from real_shapes import DATA, first_members, labeled_shapes, require_data

N_TUNED = 5  # first members of each class: constants were chosen on them, and they are the sources
QUICK = ("ant", "fish", "hand", "teddy")
N_QUICK = 2  # sources in the quick form
N_BINS = 5  # of the confidence
LEAST_BIN = 1e-3  # share of the area; below it nothing is said of a bin
FINE = 0.1  # persistence of finer parts, beside the default

Row = dict[str, float | list[float]]


@lru_cache
def vocabulary(cls: str) -> list[str]:
    """Return all names that parts of a class have, sorted."""
    found = [names_of(name) for name, own, _ in labeled_shapes() if own == cls]
    return sorted(set().union(*found))


def names_of(name: str) -> list[str]:
    """Return the names to which the labels of a shape refer."""
    return json.loads((DATA / "parts" / f"{name}.json").read_text())


@lru_cache(maxsize=2 * N_TUNED)
def labeled(name: str, cls: str, path: Path) -> es.retrieval.LabeledShape:
    """Read a shape with labels that mean the same on all shapes of its class."""
    numbers = np.array([vocabulary(cls).index(one) for one in names_of(name)])
    truth = np.load(DATA / "parts" / f"{name}.npy").astype(np.int64)
    return es.retrieval.LabeledShape(es.read_mesh(path), numbers[truth])


def best_of_parts(truth: np.ndarray, areas: np.ndarray, parts: np.ndarray) -> float:
    """Return the share of the area that is right if each part has its commonest name, -1 apart."""
    # Where a source has none of the names, all are -1; one empty column then gives 0.
    table = np.zeros((parts.max() + 1, max(truth.max() + 1, 1)))
    known = truth >= 0
    np.add.at(table, (parts[known], truth[known]), areas[known])
    return float(table.max(axis=1).sum())


def measure(
    target: es.retrieval.LabeledShape, sources: list[es.retrieval.LabeledShape], cuts: list
) -> Row:
    """Transfer labels: the share of the area that is right, bounds, and right area by confidence."""
    areas = es.geometry.face_areas(target.mesh)
    areas = areas / areas.sum()
    found = es.transfer_labels(sources, target.mesh)
    right = found.labels == target.labels
    every = np.concatenate([source.labels for source in sources])
    weights = np.concatenate([es.geometry.face_areas(source.mesh) for source in sources])
    known = np.isin(target.labels, every)
    truth = np.where(known, target.labels, -1)
    bins = np.minimum((found.confidence * N_BINS).astype(int), N_BINS - 1)
    return {
        "right": float(areas[right].sum()),
        "commonest": float(areas[target.labels == np.bincount(every, weights).argmax()].sum()),
        "known": float(areas[known].sum()),
        "best of parts": best_of_parts(truth, areas, cuts[0]),
        "best of finer parts": best_of_parts(truth, areas, cuts[1]),
        "parts": float(len(found.part_labels)),
        "bin area": np.bincount(bins, areas, N_BINS).tolist(),
        "bin right": np.bincount(bins, areas * right, N_BINS).tolist(),
        "bin confidence": np.bincount(bins, areas * found.confidence, N_BINS).tolist(),
    }


def kept(folder: Path, target: tuple, sources: list[tuple]) -> list[Row]:
    """Measure each source alone and all together, or read what was measured before."""
    file = folder / f"{target[0]}-{len(sources)}.json"
    if not file.exists():
        shape, others = labeled(*target), [labeled(*one) for one in sources]
        parts = es.find_parts(shape.mesh)
        fine = es.features.smooth_boundaries(parts.mesh, es.segment(parts.tree, persistence=FINE))
        cuts = [parts.parts.labels, fine.labels]
        rows = [measure(shape, some, cuts) for some in ([one] for one in others)]
        rows.append(measure(shape, others, cuts))
        file.write_text(json.dumps(rows))
    return json.loads(file.read_text())


def summary(rows: dict[str, list[Row]]) -> dict[str, object]:
    """Average over targets within each class, and over classes."""
    classes = sorted({name.split("-")[0] for name in rows})
    results: dict[str, object] = {}
    for way, pick in (("one", slice(None, -1)), ("all", slice(-1, None))):
        of_class = {
            cls: [
                row for name, own in rows.items() if name.startswith(f"{cls}-") for row in own[pick]
            ]
            for cls in classes
        }
        by_class = {
            cls: {
                key: round(float(np.mean([row[key] for row in chosen])), 3)
                for key in chosen[0]
                if not key.startswith("bin")
            }
            for cls, chosen in of_class.items()
        }
        every = [row for chosen in of_class.values() for row in chosen]
        sums = {
            key: np.sum([row[f"bin {key}"] for row in every], axis=0)
            for key in ("area", "right", "confidence")
        }
        results[way] = {
            "mean over classes": {
                key: round(float(np.mean([by_class[cls][key] for cls in classes])), 4)
                for key in by_class[classes[0]]
            },
            "by class": by_class,
            "confidence": {
                "share of area": (sums["area"] / sums["area"].sum()).round(3).tolist(),
                "mean confidence": shares(sums["confidence"], sums["area"]),
                "right": shares(sums["right"], sums["area"]),
            },
        }
    return results


def shares(parts: np.ndarray, areas: np.ndarray) -> list[float | None]:
    """Return parts over areas, or None where there is nearly no area."""
    enough = areas > LEAST_BIN * areas.sum()
    return [
        round(float(part / area), 3) if is_enough else None
        for part, area, is_enough in zip(parts, areas, enough, strict=True)
    ]


def pairs(half: str, quick: bool) -> list[tuple[tuple, list[tuple]]]:
    """List each target with its sources, always of the tuning half and never the target itself."""
    everyone, tuned = labeled_shapes(), first_members(N_TUNED)
    found = []
    for target in everyone:
        if (target[0] in tuned) != (half == "tuning") or (quick and target[1] not in QUICK):
            continue
        sources = [
            one for one in everyone if one[1] == target[1] and one[0] in tuned and one != target
        ]
        found.append((target, sources[:N_QUICK] if quick else sources))
    if quick:
        found = [next(one for one in found if one[0][1] == cls) for cls in QUICK]
    return found


def main() -> None:
    """Measure every target, print and save the tables."""
    parser = options_of(
        __doc__, quick=f"one target of the classes {', '.join(QUICK)}", out="ch7-labels.json"
    )
    parser.add_argument("--half", choices=("tuning", "reporting"), default="reporting")
    parser.add_argument(
        "--db", type=output_folder, default="ch7-labels", help="folder of what is done, kept"
    )
    arguments = parser.parse_args()
    require_data()
    wanted = pairs(arguments.half, arguments.quick)
    rows = {
        target[0]: kept(arguments.db, target, sources)
        for target, sources in track(wanted, "shapes")
    }
    give_out(summary(rows), arguments.out)


if __name__ == "__main__":
    main()
