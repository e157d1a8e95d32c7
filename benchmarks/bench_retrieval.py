"""Seconds to describe a shape, and to find its like among 300, by several methods (thesis table 5.3).

    python benchmarks/bench_retrieval.py                       4,800 to a million vertices; some minutes
    python benchmarks/bench_retrieval.py --quick               2,500 vertices, 30 shapes

Creatures stand for the thesis' models, with as many vertices, split for the large one. EVD and LFD are those of
experiments/ch5_retrieval.
Each call has a process of its own, after a small one that loads what it needs. The last row of a method is one query
by a described scan among 300 shapes: patches and heat ask an index, with six and four views of each shape; patches
score all, verify thirty, and find correspondences with those that they return.
"""

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from bench_features import surface
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of

import eigenshape as es

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "experiments" / "ch5_retrieval")]
from affinity import affinity_distance, affinity_eigenvalues  # noqa: E402
from light_fields import light_field, light_field_distance  # noqa: E402

FULL = {  # vertices and how often faces are split, and the seconds that the thesis prints for its method, EVD and LFD
    (4_800, 0): (9.4, 7.9, 0.7),
    (8_700, 0): (19.8, 8.1, 1.0),
    (11_000, 0): (25.2, 8.5, 1.3),
    (12_600, 0): (30.7, 8.6, 1.4),
    (15_200, 0): (42.8, 8.9, 1.5),
    (62_500, 2): (712.0, 28.0, 40.0),
}
QUICK = {(2_500, 0): ()}
QUERY = (0.02, 0.006, 36.0)
EXACT = 25_000  # vertices, above which the thesis' recipe is approximate, as in the thesis
N_SHAPES = 300
PACKAGES = ["eigenshape", "numpy", "scipy"]
COLUMNS = ("vertices", "method", "CPU s", "wall s", "MiB", "the thesis, then")


def patches(mesh: es.TriangleMesh) -> Any:
    """Describe by patches, with views where the shape is closed."""
    return es.describe(mesh, es.retrieval.PatchRecipe())


def thesis(mesh: es.TriangleMesh) -> es.retrieval.HeatDescriptor:
    """Describe by the thesis' recipe, exactly where it does."""
    accuracy = None if mesh.n_vertices <= EXACT else 0.01
    return es.retrieval.find_heat_features(mesh, es.retrieval.THESIS, accuracy=accuracy).descriptor


METHODS: dict[str, Callable[[es.TriangleMesh], Any]] = {
    "patches": patches,
    "thesis": thesis,
    "EVD": affinity_eigenvalues,
    "LFD": light_field,
}
PRINTED = {"thesis": 0, "EVD": 1, "LFD": 2}


def described(method: str, saved: str) -> Row:
    """Measure one description; run in a process of its own."""
    METHODS[method](es.make_creature("hand", n_vertices=1500))
    if method == "thesis":
        es.spectral.approximate_heat_signature(
            es.cotangent_laplacian(es.shapes.torus(120, 80)), 9, [0.1]
        )
    with np.load(saved) as arrays:
        mesh = es.TriangleMesh(arrays["vertices"], arrays["faces"])
    return measured(partial(METHODS[method], mesh))


def measured(work: Callable[[], Any]) -> Row:
    """Return seconds and MiB of a call."""
    before, wall, cpu = memory_now(), time.perf_counter(), time.process_time()
    work()
    return {
        "wall": time.perf_counter() - wall,
        "cpu": time.process_time() - cpu,
        "memory": peak_memory() - before,
    }


def asked(method: str, n_shapes: int) -> Row:
    """Measure one query among some shapes; run in a process of its own."""
    poses = [
        es.make_creature(kind, pose, n_vertices=2500)
        for kind in es.shapes.CREATURES
        for pose in (1, 2)
    ]
    scan = es.partial_scan(
        es.make_creature("biped", 5, n_vertices=5000), np.array([0.9, 0.25, 0.45])
    ).mesh
    if method in {"EVD", "LFD"}:
        known = [METHODS[method](mesh) for mesh in poses]
        distance = affinity_distance if method == "EVD" else light_field_distance
        query = METHODS[method](scan)
        return measured(
            lambda: [distance(query, known[number % len(known)]) for number in range(n_shapes)]
        )
    recipe = es.retrieval.THESIS if method == "thesis" else es.retrieval.PatchRecipe()
    with tempfile.TemporaryDirectory() as folder:
        index = es.ShapeIndex.create(Path(folder) / "index")
        for number in range(n_shapes):  # some poses, and copies of them
            name, copied = f"shape {number}", f"shape {number % len(poses)}"
            if number < len(poses):
                index.add(name, poses[number], recipe=recipe)
            else:
                stored = index.descriptors(copied, recipe)
                index.add_many([es.retrieval.DescribedShape(name, stored)])
        query = es.describe(scan, recipe)
        index.query(query)
        return measured(lambda: index.query(query))


def median_of(repeats: int, work: Callable[..., Row], *arguments: object) -> Row:
    """Return the medians of runs, of one where it is long."""
    runs: list[Row] = []
    while len(runs) < repeats and not (runs and runs[0]["cpu"] > 20):
        runs.append(in_process(work, *arguments))
    return {key: statistics.median(run[key] for run in runs) for key in runs[0]} | {
        "runs": len(runs)
    }


def measure(sizes: dict[tuple[int, int], tuple[float, ...]], n_shapes: int, report: Report) -> None:
    """Measure all methods on surfaces of several sizes, then one query by each."""
    for (base, splits), printed in sizes.items():
        mesh = surface(base, splits)
        with tempfile.TemporaryDirectory() as folder:
            saved = str(Path(folder) / "mesh.npz")
            np.savez(saved, vertices=mesh.vertices, faces=mesh.faces)
            for method in METHODS:
                row: Row = {"what": f"{mesh.n_vertices:,}", "method": method, "printed": printed}
                report.add(row | median_of(report.options.repeats, described, method, saved))
    for method in METHODS:
        row = {"what": f"one query among {n_shapes}", "method": method, "printed": QUERY}
        report.add(row | median_of(report.options.repeats, asked, method, n_shapes))


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    runs = "" if row["runs"] >= 3 else f" ({row['runs']} run{'s' * (row['runs'] > 1)})"
    printed = (
        f"{row['printed'][PRINTED[row['method']]]}"
        if row["printed"] and row["method"] in PRINTED
        else ""
    )
    return [
        row["what"],
        row["method"],
        f"{row['cpu']:.3g}{runs}",
        f"{row['wall']:.3g}",
        f"{row['memory']:.0f}",
        printed,
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    options = options_of(__doc__).parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells)
    measure(QUICK if options.quick else FULL, 30 if options.quick else N_SHAPES, report)


if __name__ == "__main__":
    main()
