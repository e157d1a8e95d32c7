"""Approximate spectra beside exact ones: CPU seconds, memory, what is promised and what is true.

    python benchmarks/bench_approximate.py                        all cases (a quarter of an hour)
    python benchmarks/bench_approximate.py --cases sphere-160k --accuracies 0.1 1e-6
    python benchmarks/bench_approximate.py --quick                a small one
    python benchmarks/bench_approximate.py --json approximate.json --markdown docs/spectra.md

Each solve runs in a process of its own, on one core, after a small one that loads and compiles; the operator is built
before the clock starts. MiB: the most that the process held during the solve, beyond what it held before. promised:
largest residual over the last eigenvalue. true: largest difference to the certified eigenvalues, over the last one.
"""

import statistics
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of
from spectrum_cases import DATA

import eigenshape as es

COLUMNS = ("operator", "solve", "CPU s", "times as quick", "MiB", "estimated", "bound", "true")


@dataclass(frozen=True)
class Case:
    """An operator and how many eigenpairs of it."""

    title: str
    make: Callable[[], es.Laplacian]
    k: int


def sphere(n: int) -> es.Laplacian:
    """Return the cotangent Laplacian of a Fibonacci sphere."""
    return es.cotangent_laplacian(es.shapes.fibonacci_sphere(n))


CASES = {
    "dragon": Case(
        "dragon",
        lambda: es.cotangent_laplacian(es.read_mesh(DATA / "classics" / "dragon.off")),
        300,
    ),
    "sphere-160k": Case("Fibonacci sphere", lambda: sphere(160_000), 50),
    "kernel-20k": Case(
        "kernel, 400 a row",
        lambda: es.mesh_laplacian(es.shapes.fibonacci_sphere(20_000), h=0.07138),
        300,
    ),
    "sphere-1.3M": Case("Fibonacci sphere", lambda: sphere(1_300_000), 50),
}
QUICK = {"sphere": Case("icosphere", lambda: es.cotangent_laplacian(es.icosphere(4)), 20)}
EVERY = CASES | QUICK


def solve(laplacian: es.Laplacian, k: int, accuracy: float | None) -> es.Spectrum:
    """Solve exactly where no accuracy is given."""
    return (
        es.solve_spectrum(laplacian, k)
        if accuracy is None
        else es.solve_spectrum(laplacian, k, method="approximate", accuracy=accuracy)
    )


def measured(name: str, accuracy: float | None) -> Row:
    """Return what one solve took and found; run in a process of its own."""
    warnings.simplefilter("ignore")
    solve(es.cotangent_laplacian(es.icosphere(5)), 10, accuracy)
    case = EVERY[name]
    laplacian = case.make()
    level = memory_now()
    cpu, wall = time.process_time(), time.perf_counter()
    found = solve(laplacian, case.k, accuracy)
    took = {
        "cpu": time.process_time() - cpu,
        "wall": time.perf_counter() - wall,
        "memory": peak_memory() - level,
    }
    last = float(found.eigenvalues[-1])
    return took | {
        "case": name,
        "title": case.title,
        "n": laplacian.n_points,
        "entries_a_row": round(laplacian.stiffness.nnz / laplacian.n_points, 1),
        "k": case.k,
        "accuracy": accuracy,
        "estimated": found.certificate.estimate,
        "bound": float(found.residuals.max()) / last,
        "values": found.eigenvalues.tolist(),
        "complete": found.certificate.complete,
    }


def measure(name: str, report: Report) -> None:
    """Measure a case exactly and at each accuracy; the median of each."""
    options = report.options
    for accuracy in (None, *options.accuracies):
        runs = [in_process(measured, name, accuracy) for _ in range(options.repeats)]
        row = runs[0] | {
            key: statistics.median(run[key] for run in runs) for key in ("cpu", "wall", "memory")
        }
        values = np.array(row.pop("values"))
        exact, known = (row["cpu"], values) if accuracy is None else (exact, known)
        true = float(np.abs(values - known).max() / known[-1])
        report.add(row | {"true": true, "times_as_quick": exact / row["cpu"]})


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    return [
        f"{row['title']}, n = {row['n']:,}, k = {row['k']}",
        "exact" if row["accuracy"] is None else f"to {row['accuracy']:g}",
        f"{row['cpu']:.1f}",
        f"{row['times_as_quick']:.1f}",
        f"{row['memory']:.0f}",
        "" if row["estimated"] is None else f"{row['estimated']:.0e}",
        f"{row['bound']:.0e}",
        "" if row["accuracy"] is None else f"{row['true']:.0e}",
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--cases", nargs="+", choices=list(EVERY), help="of these, instead of all")
    parser.add_argument("--accuracies", nargs="+", type=float, default=[1e-3])
    parser.set_defaults(repeats=1)
    options = parser.parse_args()
    report = Report(__file__, ["eigenshape", "numpy", "scipy", "numba"], options, COLUMNS, cells)
    for name in options.cases or (QUICK if options.quick else CASES):
        measure(name, report)
    report.write()


if __name__ == "__main__":
    main()
