"""How the time and memory of a certified solve grow with the points, the pairs and the width of a kernel.

    python benchmarks/bench_growth.py               spheres to 640,000 points, to 2,000 pairs; twenty minutes
    python benchmarks/bench_growth.py --quick       small ones, seconds
    python benchmarks/bench_growth.py --only points pairs

Each solve runs in a process of its own, on one core with one thread, after a small one that loads
what it needs. The exponent of a series is the slope of a line through the logarithms
of CPU seconds, fitted by least squares: 1 is proportional.
"""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of

import eigenshape as es

COLUMNS = ("series", "points", "pairs", "entries a row", "CPU s", "MiB", "exponent")
AXES = np.array([1.0, 1.37, 0.71])  # an ellipsoid without multiple eigenvalues


@dataclass(frozen=True)
class Series:
    """Solves of growing size: the operator of a mesh, how many points and pairs, and what grows."""

    operator: Callable[[es.TriangleMesh], es.Laplacian]
    sizes: tuple[tuple[int, int], ...]
    quick: tuple[tuple[int, int], ...]
    fitted: int | None = None  # which of the two numbers the exponent is of


def ellipsoid(n_points: int) -> es.TriangleMesh:
    """Return an ellipsoid with three different axes."""
    sphere = es.shapes.fibonacci_sphere(n_points)
    return es.TriangleMesh(sphere.vertices * AXES, sphere.faces)


SERIES = {
    "points": Series(
        es.cotangent_laplacian,
        ((20_000, 50), (80_000, 50), (320_000, 50), (640_000, 50)),
        ((1_000, 10), (4_000, 10)),
        0,
    ),
    "pairs": Series(
        es.cotangent_laplacian,
        ((20_000, 300), (20_000, 600), (20_000, 1_200), (20_000, 2_000)),
        ((1_000, 20), (1_000, 40)),
        1,
    ),
    "kernel": Series(es.mesh_laplacian, ((10_000, 300), (40_000, 300)), ((1_000, 20),)),
    "large kernel": Series(es.mesh_laplacian, ((160_000, 300),), ((1_500, 20),)),
}


def solve(name: str, n_points: int, k: int) -> Row:
    """Solve once, in this process, after a small solve."""
    build = SERIES[name].operator
    es.solve_spectrum(build(ellipsoid(2_000)), 40)
    laplacian = build(ellipsoid(n_points))
    held, start = memory_now(), time.process_time()
    found = es.solve_spectrum(laplacian, k)
    took, peak = time.process_time() - start, peak_memory()
    if not found.certificate.complete:
        raise RuntimeError(f"{name}, {n_points} points: the spectrum is not certified")
    return {"cpu": took, "memory": peak - held, "entries": laplacian.stiffness.nnz / n_points}


def measured(name: str, repeats: int, *, quick: bool) -> list[Row]:
    """Return a row for each size of a series, the exponent in the last."""
    series, rows = SERIES[name], []
    for n_points, k in series.quick if quick else series.sizes:
        runs = [in_process(solve, name, n_points, k) for _ in range(repeats)]
        row = {"series": name, "n": n_points, "k": k, "entries": runs[0]["entries"]}
        rows.append(
            row | {key: statistics.median(run[key] for run in runs) for key in ("cpu", "memory")}
        )
    if series.fitted is not None:
        sizes = np.log([(row["n"], row["k"])[series.fitted] for row in rows])
        slope = np.polyfit(sizes, np.log([row["cpu"] for row in rows]), 1)[0]
        rows[-1]["exponent"] = float(slope)
    return rows


def cells(row: Row) -> list[str]:
    """Return the texts of a row."""
    exponent = f"{row['exponent']:.2f}" if "exponent" in row else ""
    numbers = f"{row['n']:,}", f"{row['k']:,}", f"{row['entries']:.0f}"
    return [row["series"], *numbers, f"{row['cpu']:.2f}", f"{row['memory']:.0f}", exponent]


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--only", nargs="+", choices=SERIES, default=list(SERIES))
    options = parser.parse_args()
    report = Report(["eigenshape", "numpy", "scipy"], options, COLUMNS, cells)
    for name in options.only:
        for row in measured(name, options.repeats, quick=options.quick):
            report.add(row)


if __name__ == "__main__":
    main()
