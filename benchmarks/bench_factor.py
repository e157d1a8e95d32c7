"""Sparse factors of ours beside those of other libraries, on one core: order and analysis, factor, eight solves.

    python benchmarks/bench_factor.py                 spheres of 10 to 164 thousand points, some minutes
    python benchmarks/bench_factor.py --quick         a small one, seconds

The matrix is W + σB of the cotangent Laplacian with σ a thousandth of the mean eigenvalue: positive definite, as
CHOLMOD wants it. Each method runs in a process of its own with one thread, after a small matrix that loads
what it needs.
CPU seconds, median; a ratio under 1.4 is a tie. Peers that are not installed are shown as absent: cholespy (CHOLMOD),
scikit-sparse (CHOLMOD), pypardiso (PARDISO of the MKL).
"""

import statistics
import time
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of
from scipy.sparse.linalg import splu

import eigenshape as es
from certeig.sparse.elimination import analyze_pattern
from certeig.sparse.symmetric_factor import SymmetricFactor

PACKAGES = [
    "eigenshape",
    "scipy",
    "cholespy",
    "scikit-sparse",
    "pypardiso",
    "mkl",
    "numpy",
]
RIGHT = 8
LEVELS = 10
COLUMNS = (
    "shape, n",
    "method",
    "analysis s",
    "factor s",
    "8 solves s",
    "first factor / ours",
    "solves / ours",
    "10⁶ entries of L",
    "GF/s",
    "MiB",
)
Timed = tuple[
    float | None, float, float
]  # seconds of analysis (None where it is part of the factor), factor, solve
Method = Callable[[sp.csc_array, np.ndarray], tuple[Timed, np.ndarray, dict[str, float]]]


def matrix(size: int) -> sp.csc_array:
    """Return W + σB of an icosphere of that level, or of a Fibonacci sphere of so many points."""
    laplacian = es.cotangent_laplacian(
        es.icosphere(size) if size < LEVELS else es.shapes.fibonacci_sphere(size)
    )
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
    analysis, elimination = clock(lambda: analyze_pattern(a))
    factoring, factor = clock(lambda: SymmetricFactor.of_entries(elimination, a.data))
    solution = np.empty_like(right)
    scratch = factor.scratch()
    solving, _ = clock(lambda: factor.solve_lanes(right, solution, scratch))
    widths, heights = np.diff(elimination.first), np.diff(elimination.begins)
    columns = np.repeat(heights + elimination.first[:-1], widths) - np.arange(len(right))
    flops = float((columns.astype(float) ** 2).sum())
    return (
        (analysis, factoring, solving),
        solution,
        {"entries": elimination.n_entries, "flops": flops},
    )


def superlu(a: sp.csc_array, right: np.ndarray) -> tuple[Timed, np.ndarray, dict[str, float]]:
    """SuperLU as its manual has it for symmetric patterns."""
    options = {"SymmetricMode": True}
    factoring, factor = clock(
        lambda: splu(
            sp.csc_matrix(a), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
        )
    )
    solving, solution = clock(lambda: factor.solve(right))
    return (None, factoring, solving), solution, {"entries": float(factor.L.nnz)}


def cholespy(a: sp.csc_array, right: np.ndarray) -> tuple[Timed, np.ndarray, dict[str, float]]:
    """CHOLMOD as cholespy calls it; it analyses and factors in one."""
    from cholespy import CholeskySolverD, MatrixType  # noqa: PLC0415

    pointers, indices = a.indptr.astype(np.int32), a.indices.astype(np.int32)
    factoring, solver = clock(
        lambda: CholeskySolverD(a.shape[0], pointers, indices, a.data, MatrixType.CSC)
    )
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


def pardiso(
    kind: int, a: sp.csc_array, right: np.ndarray
) -> tuple[Timed, np.ndarray, dict[str, float]]:
    """Call the MKL's PARDISO: type 2 is L Lᵀ, -2 is L D Lᵀ, which tells the signs of pivots as ours does."""
    from pypardiso import PyPardisoSolver  # noqa: PLC0415

    upper, right = sp.csr_matrix(sp.triu(a)), np.asfortranarray(right)
    upper.sort_indices()
    solver = PyPardisoSolver(mtype=kind)
    for place, value in (
        (1, 1),
        (2, 2),
        (18, -1),
        (19, -1),
    ):  # own settings: METIS; count entries and Mflops
        solver.set_iparm(place, value)
    seconds = []
    for phase in (11, 22, 33):
        solver.set_phase(phase)
        took, solution = clock(lambda: solver._call_pardiso(upper, right))
        seconds.append(took)
    counts = {"entries": float(solver.get_iparm(18)), "flops": 1e6 * float(solver.get_iparm(19))}
    solver.free_memory(everything=True)
    return (seconds[0], seconds[1], seconds[2]), solution, counts


METHODS: dict[str, Method] = {
    "eigenshape, LDLᵀ": ours,
    "SuperLU, LU": superlu,
    "cholespy (CHOLMOD), LLᵀ": cholespy,
    "scikit-sparse (CHOLMOD), LLᵀ": scikit_sparse,
    "PARDISO, LLᵀ": lambda a, right: pardiso(2, a, right),
    "PARDISO, LDLᵀ": lambda a, right: pardiso(-2, a, right),
}


def measured(name: str, size: int, repeats: int) -> Row:
    """Measure one method on one matrix; run in a process of its own."""
    method, shape = METHODS[name], "icosphere" if size < LEVELS else "Fibonacci sphere"
    a = matrix(size)
    of = {"method": name, "shape": shape, "n": a.shape[0]}
    rng = np.random.default_rng(0)
    try:
        small = matrix(2)
        method(small, rng.standard_normal((small.shape[0], RIGHT)))
    except ImportError as error:
        return of | {"status": "absent", "reason": str(error)}
    right = rng.standard_normal((a.shape[0], RIGHT))
    runs, before = [], memory_now()
    for _ in range(repeats):
        timed, solution, counts = method(a, right)
        runs.append(timed)
        error = np.abs(a @ solution - right).max() / np.abs(right).max()
    analysis, factor, solve = zip(*runs, strict=True)
    return of | {
        "status": "ok",
        "analysis": statistics.median(analysis) if analysis[0] is not None else None,
        "factor": statistics.median(factor),
        "solve": statistics.median(solve),
        "memory": peak_memory() - before,
        "error": float(error),
        **counts,
    }


def cells(row: Row) -> list[str]:
    """Return the texts of a row."""
    name = [f"{row['shape']}, {row['n']:,}", row["method"]]
    if row["status"] != "ok":
        return [*name, "absent", *[""] * 7]
    return [
        *name,
        "in the factor" if row["analysis"] is None else f"{row['analysis']:.3f}",
        f"{row['factor']:.3f}",
        f"{row['solve']:.4f}",
        f"{row['first_ratio']:.2f}",
        f"{row['solve_ratio']:.2f}",
        f"{row['entries'] / 1e6:.2f}" if "entries" in row else "",
        f"{row['flops'] / row['factor'] / 1e9:.1f}" if "flops" in row else "",
        f"{row['memory']:.0f}",
    ]


def with_ratios(row: Row, mine: Row) -> Row:
    """Add seconds to a first factor and of solves, over ours."""
    if row["status"] != "ok":
        return row
    first, ours_first = ((r["analysis"] or 0) + r["factor"] for r in (row, mine))
    return row | {"first_ratio": first / ours_first, "solve_ratio": row["solve"] / mine["solve"]}


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument(
        "--sizes",
        type=int,
        nargs="+",
        default=[5, 6, 7, 160_000],
        help="levels of icospheres, points",
    )
    options = parser.parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells)
    for size in [3] if options.quick else options.sizes:
        rows = [in_process(measured, name, size, options.repeats) for name in METHODS]
        for row in rows:
            report.add(with_ratios(row, rows[0]))


if __name__ == "__main__":
    main()
