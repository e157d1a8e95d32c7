"""Harder questions to dense correspondences: unknown scale, several pieces, bridges, other individuals."""

import json
import sys
from itertools import chain, pairwise
from pathlib import Path

import numpy as np
from pairs import FURTHER_SETS, REPORTING, draw_pairs, errors, make_pair
from rich.progress import track
from run import WRONG

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of, save_figures
from real_shapes import DATA, labeled_shapes, require_data

N_PAIRS, FIRST_SEED = 4, 800  # of each set
SCALES = 0.5, 2.0  # the part is given in a unit between these
# Classes with named limbs, and how many of the first shapes of each are matched, each to the next
# one. Two hands and two people also served as wrong wholes when confidence was calibrated; nothing
# else was chosen on them.
CLASSES = ("hand", "human", "ant")
N_OF_CLASS = 2
SHARE = 0.6  # of the vertices of an individual that a plane keeps


def scaled() -> dict[str, float]:
    """Match cuts and scans of lions in a unit that is not given."""
    rows, ratios = [], []
    drawn = [
        one
        for kind in ("cuts", "scans")
        for one in draw_pairs(REPORTING, kind, N_PAIRS // 2, first_seed=FIRST_SEED)
    ]
    for wanted in track(drawn, "unknown scale"):
        pair = make_pair(*wanted)
        rng = np.random.default_rng(wanted[3])
        factor = float(np.exp(rng.uniform(*np.log(SCALES))))
        part = es.TriangleMesh(pair.part.vertices * factor, pair.part.faces)
        match = es.match_shapes(part, pair.whole, scale="unknown")
        rows.append(errors(pair, match.pull(pair.whole.vertices)))
        ratios.append(match.scale * factor)
    within = np.abs(np.log(ratios)) < np.log(1.1)
    return {**summary(rows), "scale within 10 %": float(within.mean())}


def placed(kind: str) -> dict[str, float]:
    """Match parts of lions of one set."""
    rows = []
    for wanted in track(draw_pairs(REPORTING, kind, N_PAIRS, first_seed=FIRST_SEED), kind):
        pair = make_pair(*wanted)
        match = es.match_shapes(pair.part, pair.whole)
        rows.append(errors(pair, match.pull(pair.whole.vertices)))
    return summary(rows)


def summary(rows: list[np.ndarray]) -> dict[str, float]:
    """Return mean and median error, the share under 5, and the share of failed maps."""
    every, means = np.concatenate(rows), np.array([row.mean() for row in rows])
    return {
        "mean": float(means.mean()),
        "median": float(np.median(every)),
        "under 5": float((every < 5).mean()),
        "over 20": float((means > WRONG).mean()),
    }


def individuals(cls: str, count: int) -> dict[str, float]:
    """Match shapes of a class and cuts of them to other individuals: the share of area named right.

    No true map is known. A vertex is right if the part of the other shape on which it lies has the
    name that it has itself, so that left and right count as one. "usual" is the share that would be
    right if the whole shape had the name of its largest part.
    """
    named = [one for one in labeled_shapes() if one[1] == cls][: count + 1]
    # Each shape has an order of its own of the names of parts.
    orders = [json.loads((DATA / "parts" / f"{name}.json").read_text()) for name, _, _ in named]
    every = sorted(set(chain(*orders)))
    shapes = [
        read_named(name, path, np.array([every.index(word) for word in order]))
        for (name, _, path), order in zip(named, orders, strict=True)
    ]
    found = {"wholes": [], "cuts": [], "usual": [], "handed": []}
    for number, (one, two) in enumerate(track(list(pairwise(shapes)), cls)):
        mesh, names, areas = one
        target = es.matching.prepare_target(two[0])
        match = es.match_shapes(mesh, target)
        found["wholes"].append(areas @ (match.pull(two[1]) == names) / areas.sum())
        found["handed"].append(match.handed)
        found["usual"].append(np.bincount(names, weights=areas).max() / areas.sum())
        rng = np.random.default_rng(FIRST_SEED + number)
        planes = es.scans.random_planes(mesh, rng, share=1 - SHARE)
        cut = es.scans.cut_by_planes(mesh, planes)
        kept = cut.source_vertices
        match = es.match_shapes(cut.mesh, target)
        right = match.pull(two[1]) == names[kept]
        found["cuts"].append(areas[kept] @ right / areas[kept].sum())
    return {what: float(np.mean(values)) for what, values in found.items()}


def read_named(
    name: str, path: Path, numbers: np.ndarray
) -> tuple[es.TriangleMesh, np.ndarray, np.ndarray]:
    """Return a shape with the area 1, and the number of the name and the area of each vertex."""
    mesh = es.read_mesh(path)
    labels = numbers[np.load(DATA / "parts" / f"{name}.npy")]
    mesh = es.TriangleMesh(mesh.vertices / np.sqrt(es.geometry.surface_area(mesh)), mesh.faces)
    areas = np.repeat(es.geometry.face_areas(mesh) / 3, 3)
    # Each vertex has the name of most of the area around it.
    table = np.zeros((mesh.n_vertices, int(labels.max()) + 1))
    np.add.at(table, (mesh.faces.ravel(), np.repeat(labels, 3)), areas)
    return mesh, table.argmax(axis=1), table.sum(axis=1)


def main() -> None:
    """Measure each set, print and save the table."""
    parser = options_of(__doc__, quick="two hands", out="ch7-further.json")
    arguments = parser.parse_args()
    require_data()
    if arguments.quick:
        give_out(rounded({"individuals": {"hand": individuals("hand", 1)}}), arguments.out)
        return
    lions, others = {}, {}
    results = {"lion": lions, "individuals": others}
    for kind in FURTHER_SETS:
        lions[kind] = placed(kind)
        save_figures(rounded(results), arguments.out)
    lions["unknown scale"] = scaled()
    for cls in CLASSES:
        others[cls] = individuals(cls, N_OF_CLASS)
        save_figures(rounded(results), arguments.out)
    give_out(rounded(results), arguments.out)


if __name__ == "__main__":
    main()
