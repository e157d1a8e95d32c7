"""Sparse factors of ours beside those of other libraries, on one core: order and analysis, factor, eight solves.

    python benchmarks/bench_factor.py                 spheres of 10 to 164 thousand points, some minutes
    python benchmarks/bench_factor.py --quick         a small one, seconds

The matrix is W + σB of the cotangent Laplacian with σ a thousandth of the mean eigenvalue: positive definite, as
CHOLMOD wants it. Each method runs in a process of its own with one thread, after a small matrix that loads and compiles
what it needs.
CPU seconds, median; a ratio under 1.4 is a tie. Peers that are not installed are shown as absent: cholespy (CHOLMOD),
scikit-sparse (CHOLMOD), pypardiso (PARDISO of the MKL).
"""

import argparse
import datetime
import json
import multiprocessing
import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from machine import describe, memory_now, peak_memory
from scipy.sparse.linalg import splu
from spectrum_tables import put

import eigenshape as es
from eigenshape.sparse.elimination import analyse, factorise

BEGIN = "<!-- bench_factor.py --markdown -->\n"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
PACKAGES = ["eigenshape", "scipy", "cholespy", "scikit-sparse", "pypardiso", "mkl", "numpy", "numba"]
RIGHT = 8
LEVELS = 10
Timed = tuple[float | None, float, float]  # seconds of analysis (None where it is part of the factor), factor, solve
Method = Callable[[sp.csc_array, np.ndarray], tuple[Timed, np.ndarray, dict[str, float]]]


def matrix(size: int) -> sp.csc_array:
    """Return W + σB of an icosphere of that level, or of a Fibonacci sphere of so many points."""
    laplacian = es.cotangent_laplacian(es.icosphere(size) if size < LEVELS else es.fibonacci_sphere(size))
    mean = laplacian.stiffness.diagonal().sum() / laplacian.mass.diagonal().sum()
    return sp.csc_array(laplacian.stiffness + 1e-3 * mean * laplacian.mass)


def clock(work: Callable[[], object]) -> tuple[float, object]:
    """Return CPU seconds and the result."""
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def ours(a: sp.csc_array, right: np.ndarray) -> tuple[Timed, np.ndarray, dict[str, float]]:
    """Nested dissection, multifrontal L D Lᵀ."""
    a.sort_indices()
    analysis, elimination = clock(lambda: analyse(a))
    factoring, factor = clock(lambda: factorise(elimination, a.data))
    solution = np.empty_like(right)
    solving, _ = clock(lambda: factor.solve_lanes(right, solution))
    widths, heights = np.diff(elimination.first), np.diff(elimination.begins)
    columns = np.repeat(heights + elimination.first[:-1], widths) - np.arange(len(right))
    flops = float((columns.astype(float) ** 2).sum())
    return (analysis, factoring, solving), solution, {"entries": elimination.n_entries, "flops": flops}


def superlu(a: sp.csc_array, right: np.ndarray) -> tuple[Timed, np.ndarray, dict[str, float]]:
    """SuperLU as its manual has it for symmetric patterns."""
    options = {"SymmetricMode": True}
    factoring, factor = clock(
        lambda: splu(sp.csc_matrix(a), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    )
    solving, solution = clock(lambda: factor.solve(right))
    return (None, factoring, solving), solution, {"entries": float(factor.L.nnz)}


def cholespy(a: sp.csc_array, right: np.ndarray) -> tuple[Timed, np.ndarray, dict[str, float]]:
    """CHOLMOD as cholespy calls it; it analyses and factors in one."""
    from cholespy import CholeskySolverD, MatrixType  # noqa: PLC0415

    pointers, indices = a.indptr.astype(np.int32), a.indices.astype(np.int32)
    factoring, solver = clock(lambda: CholeskySolverD(a.shape[0], pointers, indices, a.data, MatrixType.CSC))
    solution = np.zeros_like(right)
    solving, _ = clock(lambda: solver.solve(right, solution))
    return (None, factoring, solving), solution, {}


def scikit_sparse(a: sp.csc_array, right: np.ndarray) -> tuple[Timed, np.ndarray, dict[str, float]]:
    """CHOLMOD with its own choice of order and of supernodes."""
    from sksparse.cholmod import analyze  # noqa: PLC0415

    analysis, symbolic = clock(lambda: analyze(sp.csc_matrix(a)))
    factoring, factor = clock(lambda: symbolic.cholesky(sp.csc_matrix(a)))
    solving, solution = clock(lambda: factor(right))
    return (analysis, factoring, solving), solution, {"entries": float(factor.L().nnz)}


def pardiso(kind: int, a: sp.csc_array, right: np.ndarray) -> tuple[Timed, np.ndarray, dict[str, float]]:
    """Call the MKL's PARDISO: type 2 is L Lᵀ, -2 is L D Lᵀ, which tells the signs of pivots as ours does."""
    from pypardiso import PyPardisoSolver  # noqa: PLC0415

    upper, right = sp.csr_matrix(sp.triu(a)), np.asfortranarray(right)
    upper.sort_indices()
    solver = PyPardisoSolver(mtype=kind)
    for place, value in ((1, 1), (2, 2), (18, -1), (19, -1)):  # own settings: METIS; count entries and Mflops
        solver.set_iparm(place, value)
    seconds = []
    for phase in (11, 22, 33):
        solver.set_phase(phase)
        took, solution = clock(lambda: solver._call_pardiso(upper, right))
        seconds.append(took)
    counts = {"entries": float(solver.get_iparm(18)), "flops": 1e6 * float(solver.get_iparm(19))}
    solver.free_memory(everything=True)
    return (seconds[0], seconds[1], seconds[2]), solution, counts


METHODS: dict[str, tuple[str, Method]] = {
    "eigenshape, LDLᵀ": ("eigenshape", ours),
    "SuperLU, LU": ("scipy", superlu),
    "cholespy (CHOLMOD), LLᵀ": ("cholespy", cholespy),
    "scikit-sparse (CHOLMOD), LLᵀ": ("scikit-sparse", scikit_sparse),
    "PARDISO, LLᵀ": ("pypardiso", lambda a, right: pardiso(2, a, right)),
    "PARDISO, LDLᵀ": ("pypardiso", lambda a, right: pardiso(-2, a, right)),
}


def measured(name: str, size: int, repeats: int) -> dict[str, object]:
    """Measure one method on one matrix; run in a process of its own."""
    method = METHODS[name][1]
    rng = np.random.default_rng(0)
    try:
        small = matrix(2)
        method(small, rng.standard_normal((small.shape[0], RIGHT)))
    except ImportError as error:
        return {"status": "absent", "reason": str(error)}
    a = matrix(size)
    right = rng.standard_normal((a.shape[0], RIGHT))
    runs, before = [], memory_now()
    for _ in range(repeats):
        timed, solution, counts = method(a, right)
        runs.append(timed)
        error = np.abs(a @ solution - right).max() / np.abs(right).max()
    analysis, factor, solve = zip(*runs, strict=True)
    return {
        "status": "ok",
        "shape": "icosphere" if size < LEVELS else "Fibonacci sphere",
        "n": a.shape[0],
        "analysis": statistics.median(analysis) if analysis[0] is not None else None,
        "factor": statistics.median(factor),
        "solve": statistics.median(solve),
        "memory": peak_memory() - before,
        "error": float(error),
        **counts,
    }


def in_process(name: str, size: int, repeats: int) -> dict[str, object]:
    """Measure in a new process with one thread."""
    os.environ |= dict.fromkeys(THREADS, "1")
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return {"method": name, **pool.apply(measured, (name, size, repeats))}


def cells(row: dict[str, object], base: dict[str, object]) -> list[str]:
    """Return the texts of a row."""
    if row["status"] != "ok":
        return [row["method"], "absent", *[""] * 7]
    analysis = "in the factor" if row["analysis"] is None else f"{row['analysis']:.3f}"
    first, mine = ((r["analysis"] or 0) + r["factor"] for r in (row, base))
    entries = f"{row['entries'] / 1e6:.2f}" if "entries" in row else ""
    rate = f"{row['flops'] / row['factor'] / 1e9:.1f}" if "flops" in row else ""
    return [
        row["method"],
        analysis,
        f"{row['factor']:.3f}",
        f"{row['solve']:.4f}",
        f"{first / mine:.2f}",
        f"{row['solve'] / base['solve']:.2f}",
        entries,
        rate,
        f"{row['memory']:.0f}",
    ]


def markdown(report: dict[str, object]) -> str:
    """Return the table of a report for a page."""
    machine = report["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in machine["versions"].items() if number)
    head = ("method", "analysis s", "factor s", "8 solves s", "first factor / ours", "solves / ours")
    head = (*head, "10⁶ entries of L", "GF/s", "MiB")
    lines = [
        f"Measured {report['date']} on one of {machine['cores']} cores, {machine['cpu']}, load {machine['load'][0]} at "
        f"the start; {versions}. Medians of {report['repeats']}.",
        "",
        f"| shape, n | {' | '.join(head)} |",
        "|" + "---|" * (len(head) + 1),
    ]
    for rows in report["sizes"]:
        size = f"{rows[0]['shape']}, {rows[0]['n']:,}"
        for place, row in enumerate(rows):
            lines.append(f"| {size if not place else ''} | {' | '.join(cells(row, rows[0]))} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="one small sphere")
    parser.add_argument("--sizes", type=int, nargs="+", default=[5, 6, 7, 160_000], help="levels of icospheres, points")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path, help="write all figures")
    parser.add_argument("--markdown", type=Path, help="write the table; into a page between its two marks")
    options = parser.parse_args()
    report = {
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "machine": describe(PACKAGES),
        "repeats": options.repeats,
        "sizes": [],
    }
    for size in [3] if options.quick else options.sizes:
        rows = [in_process(name, size, options.repeats) for name in METHODS]
        report["sizes"].append(rows)
        for row in rows:
            print(rows[0]["n"], *cells(row, rows[0]), f"error {row.get('error', 0):.0e}", sep="  ", flush=True)
    if options.json:
        options.json.write_text(json.dumps(report, indent=1, ensure_ascii=False) + "\n")
    if options.markdown:
        put(options.markdown, markdown(report), BEGIN)


if __name__ == "__main__":
    main()
