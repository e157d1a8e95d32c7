"""Distances, transport and tufted clouds beside potpourri3d and robust_laplacian, in one run.

    python benchmarks/bench_transport.py              50,000 vertices; some minutes
    python benchmarks/bench_transport.py --quick      2,500 vertices, seconds

Each task takes its own process, after a small call that loads what it needs. CPU seconds: preparation, one source, and
99 more sources with what is kept.
"""

import time
import warnings
from collections.abc import Callable
from functools import partial

import numpy as np
from report import Report, Row, in_process, options_of

import eigenshape as es

FULL, QUICK = 50_000, 2_500
SOURCES = 100
PACKAGES = ["eigenshape", "potpourri3d", "robust_laplacian", "numpy", "scipy"]
COLUMNS = ("task", "method", "points", "preparation", "one source", "99 more")

Step = Callable[[int], object]


def our_distances(mesh: es.TriangleMesh, *, robust: bool) -> tuple[Step, Callable[[], object]]:
    """Return what one source costs and what many cost together, after preparation."""
    solver = es.calculus.prepare_heat_geodesics(mesh, robust=robust)
    more = partial(es.calculus.heat_distances, solver, np.arange(1, SOURCES))
    return lambda source: es.calculus.heat_distances(solver, [source]), more


def their_distances(mesh: es.TriangleMesh, *, robust: bool) -> tuple[Step, None]:
    """Prepare potpourri3d's solver."""
    import potpourri3d as pp3d  # noqa: PLC0415 - a process loads only the library that it measures

    solver = pp3d.MeshHeatMethodDistanceSolver(
        np.array(mesh.vertices), np.array(mesh.faces), 1.0, robust
    )
    return solver.compute_distance, None


def our_waves(mesh: es.TriangleMesh) -> tuple[Step, None]:
    """Prepare nothing: waves begin anew."""
    return lambda source: es.geometry.geodesic_distances(mesh, [source]), None


def our_transport(mesh: es.TriangleMesh) -> tuple[Step, None]:
    """Prepare vector heat."""
    solver = es.calculus.prepare_vector_heat(mesh)
    return lambda source: es.calculus.transport_vectors(solver, [source], [[1.0, 0.0]]), None


def their_transport(mesh: es.TriangleMesh) -> tuple[Step, None]:
    """Prepare potpourri3d's solver, on the triangles of the mesh."""
    import potpourri3d as pp3d  # noqa: PLC0415

    solver = pp3d.MeshVectorHeatSolver(np.array(mesh.vertices), np.array(mesh.faces), 1.0, False)
    return lambda source: solver.transport_tangent_vector(source, [1.0, 0.0]), None


def our_cloud(mesh: es.TriangleMesh) -> tuple[Step, None]:
    """Take the points alone."""
    cloud = es.PointCloud(mesh.vertices, dim=2)
    return lambda source: es.robust_laplacian(cloud), None


def their_cloud(mesh: es.TriangleMesh) -> tuple[Step, None]:
    """Take the points alone."""
    import robust_laplacian  # noqa: PLC0415

    return lambda source: robust_laplacian.point_cloud_laplacian(np.array(mesh.vertices)), None


TASKS = {
    ("distances", "eigenshape"): partial(our_distances, robust=False),
    ("distances", "potpourri3d"): partial(their_distances, robust=False),
    ("distances, robust", "eigenshape"): partial(our_distances, robust=True),
    ("distances, robust", "potpourri3d"): partial(their_distances, robust=True),
    ("distances, waves", "eigenshape"): our_waves,
    ("transport", "eigenshape"): our_transport,
    ("transport", "potpourri3d"): their_transport,
    ("tufted cloud", "eigenshape"): our_cloud,
    ("tufted cloud", "robust_laplacian"): their_cloud,
}


def measured(key: tuple[str, str], n: int) -> Row:
    """Return the seconds of one task; run in a process of its own."""
    warnings.simplefilter("ignore")
    small = es.shapes.fibonacci_sphere(300)
    TASKS[key](small)[0](0)
    sphere = es.shapes.fibonacci_sphere(n)
    mesh = es.TriangleMesh(sphere.vertices * [1.0, 1.3, 0.8], sphere.faces)
    started = time.process_time()
    one, more = TASKS[key](mesh)
    prepared = time.process_time()
    one(0)
    first = time.process_time()
    row = {"prepare": prepared - started, "one": first - prepared}
    if key[0] in ("distances", "distances, robust", "transport"):
        if more is None:
            for source in range(1, SOURCES):
                one(source)
        else:
            more()
        row["more"] = time.process_time() - first
    return row


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    task, method = row["key"]
    more = f"{row['more']:.2f}" if "more" in row else ""
    return [task, method, f"{row['n']:,}", f"{row['prepare']:.2f}", f"{row['one']:.3f}", more]


def main() -> None:
    """Measure, print, and write what was asked for."""
    options = options_of(__doc__).parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells)
    n = QUICK if options.quick else FULL
    for key in TASKS:
        runs = [in_process(measured, key, n) for _ in range(options.repeats)]
        medians = {name: float(np.median([run[name] for run in runs])) for name in runs[0]}
        report.add({"key": key, "n": n} | medians)


if __name__ == "__main__":
    main()
