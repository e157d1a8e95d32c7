"""Approximate spectra beside exact ones and LOBPCG: CPU seconds, memory, errors promised and true.

    python benchmarks/bench_approximate.py                        all cases (a quarter of an hour)
    python benchmarks/bench_approximate.py --cases sphere-160k --accuracies 0.1 1e-6
    python benchmarks/bench_approximate.py --quick                a small one
    python benchmarks/bench_approximate.py --peers --repeats 3    beside pyamg (two hours)

Each solve runs in a process of its own, on one core, after a small one that loads what it needs; the operator is built
before the clock starts. MiB: the most that the process held during the solve, beyond what it held before. promised:
largest residual over the last eigenvalue. true: largest difference to the certified eigenvalues, over the last one.

The peer is `scipy.sparse.linalg.lobpcg`, with the aggregation hierarchy of pyamg as preconditioner
and as many guard columns as ours. It has no estimate of the error of its eigenvalues, so it is
stopped by the certified ones: a first run finds how many iterations it needs to come below the
accuracy, and a second one of that length is timed, setup included. A user without the certified
eigenvalues would have to iterate longer.
"""

import statistics
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of
from spectrum_cases import DATA

import eigenshape as es
from eigenshape.spectral.multilevel import approximate

approximate.CERTIFIED_POINTS = 0  # where the certified method is as fast, both are measured
COLUMNS = ("operator", "solve", "CPU s", "times as quick", "MiB", "estimated", "bound", "true")


@dataclass(frozen=True)
class Case:
    """An operator and how many eigenpairs of it."""

    title: str
    make: Callable[[], es.Laplacian]
    k: int
    peers: bool = False


def sphere(n: int) -> es.Laplacian:
    """Return the cotangent Laplacian of a Fibonacci sphere."""
    return es.cotangent_laplacian(es.shapes.fibonacci_sphere(n))


def refined(path: str, times: int) -> es.Laplacian:
    """Return the cotangent Laplacian of a real mesh, subdivided some times."""
    mesh = es.read_mesh(DATA / path)
    for _ in range(times):
        mesh = es.geometry.subdivide(mesh)
    return es.cotangent_laplacian(mesh)


SHAPES: dict[str, tuple[str, Callable[[], es.Laplacian]]] = {
    "sphere-20k": ("Fibonacci sphere", lambda: sphere(20_000)),
    "bust": ("bust (psb320)", lambda: refined("retrieval/bust/psb320.ply", 0)),
    "sphere-100k": ("Fibonacci sphere", lambda: sphere(100_000)),
    "dragon": ("dragon", lambda: refined("classics/dragon.off", 0)),
    "elk": ("elk, subdivided", lambda: refined("classics/elk.off", 2)),
    "sphere-300k": ("Fibonacci sphere", lambda: sphere(300_000)),
    "fertility": ("fertility, subdivided", lambda: refined("classics/fertility.off", 3)),
}
PEERS = {
    f"{name}-{k}": Case(title, make, k, peers=True)
    for name, (title, make) in SHAPES.items()
    for k in (20, 100)
}
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
QUICK_PEERS = {
    "sphere-peers": Case(
        "icosphere", lambda: es.cotangent_laplacian(es.icosphere(4)), 20, peers=True
    )
}
EVERY = CASES | QUICK | PEERS | QUICK_PEERS
# Share of the last eigenvalue: W + shift B must be definite. With 1 LOBPCG took more iterations.
SHIFT = 1e-2
MOST_ITERATIONS = 20  # of the run that counts them


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
    found, took = timed(lambda: solve(laplacian, case.k, accuracy))
    return took | {
        "case": name,
        "title": case.title,
        "solve": "exact" if accuracy is None else f"to {accuracy:g}",
        "n": laplacian.n_points,
        "entries_a_row": round(laplacian.stiffness.nnz / laplacian.n_points, 1),
        "k": case.k,
        "accuracy": accuracy,
        "estimated": found.certificate.estimate,
        "bound": float(found.residuals.max()) / float(found.eigenvalues[-1]),
        "values": found.eigenvalues.tolist(),
        "complete": found.certificate.complete,
    }


def timed(work: Callable[[], Any]) -> tuple[Any, Row]:
    """Return what a call returns, and the seconds and MiB that it took."""
    level = memory_now()
    cpu, wall = time.process_time(), time.perf_counter()
    found = work()
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    return found, {"cpu": cpu, "wall": wall, "memory": peak_memory() - level}


def measured_peer(name: str, accuracy: float, known: list[float], needed: int | None) -> Row:
    """Return what LOBPCG took to come below the accuracy, and what it found.

    `needed` is the number of iterations, which is counted where it is None.
    """
    import pyamg  # noqa: F401  (loaded before the clock starts)

    warnings.simplefilter("ignore")
    case = EVERY[name]
    laplacian = case.make()
    exact = np.array(known)
    if needed is None:
        *_, history = lobpcg_pairs(laplacian, case.k, exact[-1], MOST_ITERATIONS, history=True)
        errors = [
            float(np.abs(np.sort(values)[: case.k] - exact).max() / exact[-1]) for values in history
        ]
        needed = next(
            (count for count, error in enumerate(errors) if error <= accuracy), MOST_ITERATIONS
        )
    (values, vectors, _), took = timed(lambda: lobpcg_pairs(laplacian, case.k, exact[-1], needed))
    residuals = laplacian.stiffness @ vectors - (laplacian.mass @ vectors) * values
    weights = laplacian.mass.diagonal()[:, None]
    norms = np.sqrt((residuals**2 / weights).sum(axis=0) / (vectors**2 * weights).sum(axis=0))
    return took | {
        "case": name,
        "title": case.title,
        "solve": f"LOBPCG to {accuracy:g}",
        "n": laplacian.n_points,
        "entries_a_row": round(laplacian.stiffness.nnz / laplacian.n_points, 1),
        "k": case.k,
        "accuracy": accuracy,
        "estimated": None,
        "bound": float(norms.max() / exact[-1]),
        "values": values.tolist(),
        "complete": False,
        "iterations": needed,
    }


def lobpcg_pairs(
    laplacian: es.Laplacian, k: int, last: float, iterations: int, *, history: bool = False
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Return k eigenvalues, eigenvectors and, if requested, the values of each iteration."""
    from pyamg import smoothed_aggregation_solver
    from scipy.sparse.linalg import lobpcg

    # Masses near 1 keep the two terms of the Gram matrices of one size, whatever the units are.
    unit = laplacian.mass.diagonal().mean()
    stiffness, mass = sp.csr_matrix(laplacian.stiffness), sp.csr_matrix(laplacian.mass / unit)
    shifted = sp.csr_matrix(stiffness + (SHIFT * last * unit) * mass)
    preconditioner = smoothed_aggregation_solver(shifted).aspreconditioner()
    columns = max(k + 8, int(1.125 * k))
    start = np.random.default_rng(0).standard_normal((laplacian.n_points, columns))
    start[:, 0] = 1.0
    options = {
        "B": mass,
        "M": preconditioner,
        "tol": 1e-30,
        "maxiter": iterations,
        "largest": False,
    }
    values, vectors, *rest = lobpcg(stiffness, start, **options, retLambdaHistory=history)
    order = np.argsort(values)[:k]
    return (
        values[order] / unit,
        vectors[:, order],
        [column / unit for column in (rest[0] if history else [])],
    )


def measure(name: str, report: Report) -> None:
    """Measure a case exactly, at each accuracy and by the peer, if it has one; keep medians.

    The methods take turns, so that other work on the machine slows all of them alike.
    """
    accuracies, repeats = report.options.accuracies, report.options.repeats
    runs: dict[str, list[Row]] = {}
    needed: dict[float, int] = {}
    for _ in range(repeats):
        exact = in_process(measured, name, None)
        rows = [exact]
        for accuracy in accuracies:
            rows.append(in_process(measured, name, accuracy))
            if EVERY[name].peers:
                rows.append(
                    in_process(measured_peer, name, accuracy, exact["values"], needed.get(accuracy))
                )
                needed[accuracy] = rows[-1]["iterations"]
        for row in rows:
            runs.setdefault(row["solve"], []).append(row)
    known = np.array(runs["exact"][0]["values"])
    reference = statistics.median(row["cpu"] for row in runs["exact"])
    for same in runs.values():
        row = same[0] | {
            key: statistics.median(run[key] for run in same) for key in ("cpu", "wall", "memory")
        }
        true = float(np.abs(np.array(row.pop("values")) - known).max() / known[-1])
        report.add(row | {"true": true, "times_as_quick": reference / row["cpu"]})


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    return [
        f"{row['title']}, n = {row['n']:,}, k = {row['k']}",
        row["solve"],
        f"{row['cpu']:.1f}" if row["cpu"] >= 1 else f"{row['cpu']:.2f}",
        f"{row['times_as_quick']:.1f}"
        if row["times_as_quick"] >= 0.1
        else f"{row['times_as_quick']:.2f}",
        f"{row['memory']:.0f}",
        "" if row["estimated"] is None else f"{row['estimated']:.0e}",
        f"{row['bound']:.0e}",
        "" if row["accuracy"] is None else f"{row['true']:.0e}",
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--cases", nargs="+", choices=list(EVERY), help="of these, instead of all")
    parser.add_argument(
        "--peers", action="store_true", help="beside LOBPCG with pyamg, on shapes of three sizes"
    )
    parser.add_argument("--accuracies", nargs="+", type=float, default=[1e-3])
    parser.set_defaults(repeats=1)
    options = parser.parse_args()
    report = Report(["eigenshape", "numpy", "scipy", "pyamg"], options, COLUMNS, cells)
    quick, usual = (QUICK_PEERS, PEERS) if options.peers else (QUICK, CASES)
    for name in options.cases or (quick if options.quick else usual):
        measure(name, report)


if __name__ == "__main__":
    main()
