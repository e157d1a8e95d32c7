"""Approximate spectra beside exact ones: CPU seconds, memory, what is promised and what is true.

    python benchmarks/bench_approximate.py                        all cases (a quarter of an hour)
    python benchmarks/bench_approximate.py --cases sphere-160k --accuracies 0.1 1e-6
    python benchmarks/bench_approximate.py --quick                a small one
    python benchmarks/bench_approximate.py --json approximate.json

Each solve runs in a process of its own, on one core, after a small one that loads and compiles; the operator is built
before the clock starts. MiB: the most that the process held during the solve, beyond what it held before. promised:
largest residual over the last eigenvalue. true: largest difference to the certified eigenvalues, over the last one.
"""

import argparse
import json
import multiprocessing
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from machine import describe, memory_now, peak_memory
from spectrum_cases import DATA
from threadpoolctl import threadpool_limits

import eigenshape as es


@dataclass(frozen=True)
class Case:
    """An operator and how many eigenpairs of it."""

    title: str
    make: Callable[[], es.Laplacian]
    k: int


def sphere(n: int) -> es.Laplacian:
    """Return the cotangent Laplacian of a Fibonacci sphere."""
    return es.cotangent_laplacian(es.fibonacci_sphere(n))


CASES = {
    "dragon": Case("dragon", lambda: es.cotangent_laplacian(es.read_mesh(DATA / "classics" / "dragon.off")), 300),
    "sphere-160k": Case("Fibonacci sphere", lambda: sphere(160_000), 50),
    "kernel-20k": Case("kernel, 400 a row", lambda: es.mesh_laplacian(es.fibonacci_sphere(20_000), h=0.07138), 300),
    "sphere-1.3M": Case("Fibonacci sphere", lambda: sphere(1_300_000), 50),
}
QUICK = {"sphere": Case("icosphere", lambda: es.cotangent_laplacian(es.icosphere(4)), 20)}
EVERY = CASES | QUICK


def solve(laplacian: es.Laplacian, k: int, accuracy: float | None) -> es.Spectrum:
    """Solve exactly where no accuracy is given."""
    return (
        es.solve_spectrum(laplacian, k)
        if accuracy is None
        else es.approximate_spectrum(laplacian, k, accuracy=accuracy)
    )


def measured(name: str, accuracy: float | None) -> dict[str, object]:
    """Return what one solve took and found; run in a process of its own."""
    warnings.simplefilter("ignore")
    with threadpool_limits(1):
        solve(es.cotangent_laplacian(es.icosphere(5)), 10, accuracy)
        case = EVERY[name]
        laplacian = case.make()
        level = memory_now()
        cpu, wall = time.process_time(), time.perf_counter()
        found = solve(laplacian, case.k, accuracy)
        took = {"cpu": time.process_time() - cpu, "wall": time.perf_counter() - wall, "memory": peak_memory() - level}
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


def rows_of(name: str, accuracies: list[float]) -> list[dict[str, object]]:
    """Measure a case exactly and at each accuracy."""
    rows, context = [], multiprocessing.get_context("spawn")
    for accuracy in (None, *accuracies):
        with context.Pool(1) as pool:
            row = pool.apply(measured, (name, accuracy))
        values = np.array(row.pop("values"))
        expected = values if accuracy is None else expected
        row |= {"true": float(np.abs(values - expected).max() / expected[-1])}
        rows.append(row)
        print(line(row, rows[0]["cpu"]), flush=True)
    return rows


def line(row: dict[str, object], exact: float) -> str:
    """Return a row of the table."""
    how = "exact" if row["accuracy"] is None else f"to {row['accuracy']:g}"
    estimated = "" if row["estimated"] is None else f"{row['estimated']:.0e}"
    return (
        f"| {row['title']}, n = {row['n']:,}, k = {row['k']} | {how} | {row['cpu']:.1f} | {exact / row['cpu']:.1f} | "
        f"{row['memory']:.0f} | {estimated} | {row['bound']:.0e} | {row['true']:.0e} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="+", choices=list(EVERY), default=None)
    parser.add_argument("--accuracies", nargs="+", type=float, default=[1e-3])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    names = given.cases or list(QUICK if given.quick else CASES)
    machine = describe(["numpy", "scipy", "numba"])
    heads = ["operator", "solve", "CPU s", "times as quick", "MiB", "estimated", "bound", "true"]
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    rows = [row for name in names for row in rows_of(name, given.accuracies)]
    if given.json:
        given.json.write_text(json.dumps({"machine": machine, "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
