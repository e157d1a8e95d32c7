"""Where the time of one certified solve goes, each part beside what it cannot be faster than on this machine.

    python benchmarks/bench_parts.py                 two shapes, some minutes
    python benchmarks/bench_parts.py --quick         a small one, seconds

Functions of the solver are wrapped, from here, to count CPU seconds (less those of other parts called inside), bytes
that must move, and floating-point operations. The bound of a part is the longer of two times: bytes at the bandwidth of
a sum of two arrays, operations at the rate of a large dgemm, both measured in the same run, on one core.
"""

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import numpy as np
from report import Report, Row, one_core, options_of
from threadpoolctl import threadpool_limits

import eigenshape as es
from certeig.solver import eigenpairs, lanczos, pencil
from certeig.solver import strategy as roads
from certeig.solver.factor import Factor
from certeig.sparse.symmetric_factor import SymmetricFactor

COLUMNS = ("shape", "part", "calls", "CPU s", "share", "bound s", "set by", "times the bound")
REAL = 8  # bytes
CASES: dict[str, tuple[Callable[[], es.TriangleMesh], int]] = {
    "icosphere": (lambda: es.icosphere(6), 300),
    "Fibonacci sphere": (lambda: es.shapes.fibonacci_sphere(160_000), 50),
}
QUICK: dict[str, tuple[Callable[[], es.TriangleMesh], int]] = {
    "icosphere": (lambda: es.icosphere(4), 40)
}
Work = tuple[float, float]  # bytes that must move, floating-point operations


def _analysis(pattern: Any, **_: object) -> Work:
    return (
        REAL * 3.0 * pattern.nnz,
        0.0,
    )  # the pattern read, its triangle and the places of its entries written


def _factor(elimination: Any, *_: object) -> Work:
    widths, heights = np.diff(elimination.first), np.diff(elimination.begins)
    columns = np.repeat(heights + elimination.first[:-1], widths) - np.arange(
        len(elimination.order)
    )
    return REAL * float(elimination.n_entries), float((columns.astype(float) ** 2).sum())


def _solve(mine: SymmetricFactor, right: np.ndarray, *_: object) -> Work:
    entries = mine.elimination.n_entries
    return REAL * (2.0 * entries + 6.0 * right.size), 4.0 * entries * right.shape[
        1
    ]  # L there and back


def _orthogonal(
    _inner: object, space: np.ndarray, columns: np.ndarray, _rng: object, *, skip: bool = False
) -> Work:
    # What is known is read to project on it, and again to take that away.
    groups = len(columns)
    known = space[:-groups][-2 * groups :] if skip else space[:-groups]
    return 2.0 * known.nbytes, 4.0 * known.size * groups * columns.shape[2]


def _eigh(_inner: object, _basis: object, projected: np.ndarray, *_: object) -> Work:
    # To a tridiagonal matrix and back; in between it is cheap.
    return 0.0, 10 / 3 * float(len(projected)) ** 3


def _combine(space: Any, numbers: np.ndarray) -> Work:
    n, m, j = space.basis.shape[1], space.basis.shape[0] * space.basis.shape[2], len(numbers)
    return REAL * float(n) * (m + j), 2.0 * n * m * j


def _residuals(of: Any, vectors: np.ndarray, near: object = None) -> Work:
    chunks = len(pencil.column_chunks(vectors.shape[1]))
    passes = 2.0 if near is None else 1.0  # quotients first
    return passes * (vectors.nbytes + chunks * 12 * of.stiffness.nnz), 0.0


def _proof(_pencil: object, of: Any, *_: object) -> Work:
    return float(of.vectors.nbytes), 2.0 * len(of.vectors) * of.vectors.shape[1] ** 2  # ΦᵀBΦ


def _rounding(of: Any) -> Work:
    return REAL * 2.0 * of.lower.elimination.n_entries, 0.0


PARTS: tuple[tuple[str, object, str, Callable[..., Work]], ...] = (
    ("order and analysis", pencil, "analyze_pattern", _analysis),
    ("factors", SymmetricFactor, "of_entries", _factor),
    ("solves", SymmetricFactor, "solve_lanes", _solve),
    ("orthogonalization", lanczos, "_orthonormalize", _orthogonal),
    ("Ritz values", lanczos, "_ritz_space", _eigh),
    ("Ritz vectors", lanczos.RitzSpace, "vectors", _combine),
    ("residuals", eigenpairs, "rayleigh_residuals", _residuals),
    ("proof", roads, "prove", _proof),
    ("proof", Factor, "rounding", _rounding),
)


@contextmanager
def counted() -> Iterator[dict[str, list[float]]]:
    """Count seconds, bytes and operations of each part within."""
    totals: dict[str, list[float]] = {name: [0.0, 0.0, 0.0, 0.0] for name, *_ in PARTS}
    inside = [0.0]

    def wrapped(
        name: str, function: Callable[..., Any], work: Callable[..., Work]
    ) -> Callable[..., Any]:
        def call(*args: object, **options: object) -> object:
            moved, operations = work(*args, **options)
            inside.append(0.0)
            start = time.process_time()
            try:
                return function(*args, **options)
            finally:
                took, others = time.process_time() - start, inside.pop()
                inside[-1] += took
                for place, amount in enumerate((took - others, moved, operations, 1.0)):
                    totals[name][place] += amount

        return call

    with ExitStack() as stack:
        for name, home, attribute, work in PARTS:
            stack.enter_context(
                patch.object(home, attribute, wrapped(name, getattr(home, attribute), work))
            )
        yield totals


def rates(size: int) -> dict[str, float]:
    """Measure bytes a second of a sum of two arrays, operations a second of a dgemm; the best of eleven."""
    a, b, c = (np.ones(size) for _ in range(3))
    square = np.ones((1200, 1200))
    sums, products = [], []
    for _ in range(11):
        start = time.perf_counter()
        np.add(b, c, out=a)
        sums.append(time.perf_counter() - start)
        start = time.perf_counter()
        square @ square
        products.append(time.perf_counter() - start)
    return {
        "bandwidth": 4 * REAL * size / min(sums),
        "dgemm": 2 * 1200**3 / min(products),
    }  # a line written is read


def measured(mesh: es.TriangleMesh, k: int, repeats: int, speed: dict[str, float]) -> list[Row]:
    """Return a row for each part, and one for what is in none."""
    laplacian, runs, whole = es.cotangent_laplacian(mesh), [], []
    for _ in range(repeats):
        with counted() as totals:
            start = time.process_time()
            es.solve_spectrum(laplacian, k)
            whole.append(time.process_time() - start)
        runs.append(totals)
    rows = []
    for name, (_, moved, operations, calls) in runs[0].items():
        seconds = statistics.median(run[name][0] for run in runs)
        bytes_bound, flop_bound = moved / speed["bandwidth"], operations / speed["dgemm"]
        bound = max(bytes_bound, flop_bound)
        by = "bytes" if bytes_bound >= flop_bound else "operations"
        rows.append(
            {"part": name, "calls": int(calls), "seconds": seconds, "bound": bound, "by": by}
        )
    rest = statistics.median(
        total - sum(part[0] for part in run.values())
        for total, run in zip(whole, runs, strict=True)
    )
    rows.append({"part": "the rest", "calls": 0, "seconds": rest, "bound": None, "by": ""})
    total = statistics.median(whole)
    return [row | {"share": row["seconds"] / total} for row in rows]


def cells(row: Row) -> list[str]:
    """Return the texts of a row."""
    texts = [
        row["case"],
        row["part"],
        str(row["calls"] or ""),
        f"{row['seconds']:.3f}",
        f"{100 * row['share']:.0f} %",
    ]
    if row["bound"] is None:
        return [*texts, "", "", ""]
    ratio = f"{row['seconds'] / row['bound']:.1f}" if row["bound"] else ""
    return [*texts, f"{row['bound']:.3f}", row["by"], ratio]


def main() -> None:
    """Measure, print, and write what was asked for."""
    options = options_of(__doc__).parse_args()
    one_core()
    with threadpool_limits(1):
        es.solve_spectrum(es.cotangent_laplacian(es.icosphere(4)), 20)  # loads what is needed
        report = Report(["eigenshape", "numpy", "scipy"], options, COLUMNS, cells)
        speed = rates(2**20 if options.quick else 2**25)
        told = (
            f"addition {speed['bandwidth'] / 1e9:.1f} GB/s, dgemm {speed['dgemm'] / 1e9:.0f} GF/s"
        )
        report.figures["settings"] |= {"speed": told, "rates": speed}
        for name, (make, k) in (QUICK if options.quick else CASES).items():
            mesh = make()
            for row in measured(mesh, k, options.repeats, speed):
                report.add({"case": f"{name}, n = {mesh.n_points:,}, k = {k}"} | row)


if __name__ == "__main__":
    main()
