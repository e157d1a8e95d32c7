"""Poisson and heat solves beside LaPy and potpourri3d, with one and with many right-hand sides.

    python benchmarks/bench_calculus.py                     50,000 vertices, a few minutes
    python benchmarks/bench_calculus.py --quick             600 vertices, seconds

Each call begins with vertices and faces and has a process of its own on one core, after a small call that loads and
compiles. Libraries take turns. "Poisson" fixes one vertex at 0. "Heat" is one implicit step of the squared mean edge
length from points. potpourri3d has neither as a call of its own, but distances by heat, which take one heat solve, a
gradient, a divergence and one Poisson solve for each source; ours for that comparison are the same steps, written
with our functions. libigl is called by `min_quad_with_fixed`, which factors and solves at once.
"""

import statistics
import time
import warnings
from collections.abc import Callable

import igl
import lapy
import numpy as np
import potpourri3d
import scipy.sparse as sp
from lapy.heat import diffusion
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of, ratio_text

import eigenshape as es
from eigenshape import calculus

FULL, QUICK = 50_000, 600
COUNTS = (1, 100)
COLUMNS = ("right-hand sides, task", "library", "CPU s", "ratio", "wall s", "MiB", "difference")

Arrays = tuple[np.ndarray, np.ndarray]


def surface(n: int) -> Arrays:
    """Return vertices and faces of a sphere with waves, so that no two places are alike."""
    ball = es.shapes.fibonacci_sphere(n)
    x, y, z = ball.vertices.T
    radii = 1 + 0.1 * np.sin(5 * x + 1) * np.cos(4 * y) + 0.05 * np.sin(9 * z)
    return ball.vertices * radii[:, None], ball.faces


def sources(n: int, count: int) -> np.ndarray:
    """Return random sources with mean 0, one column each."""
    return np.random.default_rng(0).standard_normal((n, count))


def points(n: int, count: int) -> np.ndarray:
    """Return vertices from which heat starts."""
    return np.linspace(0, n - 1, count + 1).astype(int)[1:]


def our_poisson(vertices: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """Solve with vertex 0 fixed."""
    laplacian = es.cotangent_laplacian((vertices, faces))
    return calculus.solve_poisson(laplacian, sources(len(vertices), count), fixed=[0])


def lapy_poisson(vertices: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """Solve all right-hand sides in one call."""
    solver = lapy.Solver(lapy.TriaMesh(vertices, faces), lump=True)
    found = solver.poisson(sources(len(vertices), count), dtup=([0], [0.0]))
    return found.reshape(len(vertices), count)


def igl_poisson(vertices: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """Solve all right-hand sides in one call."""
    stiffness = -igl.cotmatrix(vertices, faces)
    mass = igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_BARYCENTRIC)
    load = mass @ sources(len(vertices), count)
    nothing = sp.csc_matrix((0, len(vertices)))
    found = igl.min_quad_with_fixed(
        stiffness, -load, np.array([0]), np.zeros((1, count)), nothing, np.zeros((0, count)), True
    )
    return np.asarray(found).reshape(len(vertices), count)


def our_heat(vertices: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """Take one step from a load of 1 at each point."""
    mesh = es.TriangleMesh(vertices, faces)
    laplacian = es.cotangent_laplacian(mesh)
    t = es.geometry.edge_lengths(mesh).mean() ** 2
    load = np.zeros((len(vertices), count))
    load[points(len(vertices), count), np.arange(count)] = 1.0
    return calculus.solve_heat(laplacian, np.zeros(len(vertices)), t, load=load / t)


def lapy_heat(vertices: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """Take one step for all sets of seeds in one call."""
    seeds = [[int(point)] for point in points(len(vertices), count)]
    return diffusion(lapy.TriaMesh(vertices, faces), seeds).reshape(len(vertices), count)


def our_distances(vertices: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """Compute distances by heat (Crane, Weischedel and Wardetzky 2013) with our functions."""
    mesh = es.TriangleMesh(vertices, faces)
    laplacian = es.cotangent_laplacian(mesh)
    starts = points(len(vertices), count)
    load = np.zeros((len(vertices), count))
    load[starts, np.arange(count)] = 1.0
    t = es.geometry.edge_lengths(mesh).mean() ** 2
    heat = calculus.solve_heat(laplacian, np.zeros(len(vertices)), t, load=load / t)
    slopes = calculus.gradient(mesh, heat)
    slopes /= -np.linalg.norm(slopes, axis=1, keepdims=True)
    distances = calculus.solve_poisson(laplacian, load=-calculus.divergence(mesh, slopes))
    return distances - distances[starts, np.arange(count)]


def potpourri_distances(vertices: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """Compute them one after the other, as the solver takes them."""
    solver = potpourri3d.MeshHeatMethodDistanceSolver(vertices, faces, use_robust=False)
    return np.stack([solver.compute_distance(int(i)) for i in points(len(vertices), count)], axis=1)


TASKS: dict[str, dict[str, Callable[[np.ndarray, np.ndarray, int], np.ndarray]]] = {
    "Poisson": {"eigenshape": our_poisson, "LaPy": lapy_poisson, "libigl": igl_poisson},
    "heat": {"eigenshape": our_heat, "LaPy": lapy_heat},
    "distances by heat": {"eigenshape": our_distances, "potpourri3d": potpourri_distances},
}


def measured(task: str, library: str, n: int, count: int) -> Row:
    """Return seconds and MiB of one call, and how far it is from ours; run in a process of its own."""
    warnings.simplefilter("ignore")
    call, ours = TASKS[task][library], TASKS[task]["eigenshape"]
    call(*surface(200), count)
    shape, before = surface(n), memory_now()
    wall, cpu = time.perf_counter(), time.process_time()
    found = call(*shape, count)
    row: Row = {
        "wall": time.perf_counter() - wall,
        "cpu": time.process_time() - cpu,
        "memory": peak_memory() - before,
    }
    expected = ours(*shape, count)
    difference = np.abs(found - expected).max() / np.abs(expected).max()
    return row | {"difference": float(difference), "n": len(shape[0])}


def rows_of(task: str, n: int, count: int, repeats: int) -> list[Row]:
    """Measure all libraries on one task, taking turns; the median of each."""
    runs: dict[str, list[Row]] = {library: [] for library in TASKS[task]}
    for _ in range(repeats):
        for library, done in runs.items():
            done.append(in_process(measured, task, library, n, count))
    rows = []
    for library, done in runs.items():
        medians = {
            key: statistics.median(run[key] for run in done) for key in ("cpu", "wall", "memory")
        }
        rows.append({"library": library, "task": task, "count": count} | done[0] | medians)
    return [row | {"ratio": row["cpu"] / rows[0]["cpu"]} for row in rows]


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    return [
        f"{row['count']}, {row['task']}",
        row["library"],
        f"{row['cpu']:.2f}",
        ratio_text(row["ratio"]),
        f"{row['wall']:.2f}",
        f"{row['memory']:.0f}",
        f"{row['difference']:.0e}",
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    options = options_of(__doc__).parse_args()
    packages = ["eigenshape", "lapy", "libigl", "potpourri3d", "numpy", "scipy"]
    report = Report(packages, options, COLUMNS, cells)
    for task in TASKS:
        for count in COUNTS:
            n = QUICK if options.quick else FULL
            for row in rows_of(task, n, count, options.repeats):
                report.add(row)


if __name__ == "__main__":
    main()
