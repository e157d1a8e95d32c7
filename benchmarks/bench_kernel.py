"""Time and peak memory to assemble a Gaussian kernel, beside scipy's and scikit-learn's trees, in one run.

    python benchmarks/bench_kernel.py              both sizes (about five minutes)
    python benchmarks/bench_kernel.py --quick      a small one, seconds

Points lie on the unit sphere. The first size is that of the mesh Laplacian at t = e²; the second a million points with
100 neighbors each. Every method ends with the same matrix, W as sparse rows; each runs in a process of its own, after
one small run that loads what it needs. Wall seconds, median; a ratio under 1.4 is a tie. What bounds the
work is memory: a matrix of z entries has 12 z bytes, to be written once, and z exponentials.
"""

import multiprocessing
import resource
import statistics
import time
import warnings
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from report import Report, Row, options_of, ratio_text
from scipy.spatial import cKDTree
from sklearn.neighbors import radius_neighbors_graph

from eigenshape.operators import gaussian_laplacian

# Points and entries a row: of the mesh Laplacian at t = e², and of a graph with 100 neighbors
FULL, QUICK = ((160_000, 247), (1_000_000, 100)), ((2_000, 247),)
PACKAGES = ["eigenshape", "numpy", "scipy", "scikit-learn"]
COLUMNS = ("kernel", "method", "wall s", "ratio", "most GiB")
CUTOFF = 4.0


def sphere_points(n: int) -> np.ndarray:
    """Spread n points over the unit sphere along a Fibonacci spiral."""
    places = np.arange(n) + 0.5
    height, angle = 1 - 2 * places / n, np.pi * (1 + 5**0.5) * places
    ring = np.sqrt(1 - height**2)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), height])


def ours(points: np.ndarray, t: float) -> sp.csr_array:
    """Return the stiffness of `gaussian_laplacian`, which is also checked for symmetry."""
    return gaussian_laplacian(points, t, 2, cutoff=CUTOFF).stiffness


def kd_tree(points: np.ndarray, t: float) -> sp.csr_array:
    """Take all pairs from scipy's k-d tree."""
    tree = cKDTree(points)
    pairs = tree.query_pairs(CUTOFF * 2 * t**0.5, output_type="ndarray")
    squares = ((points[pairs[:, 0]] - points[pairs[:, 1]]) ** 2).sum(axis=1)
    half = sp.coo_array((np.exp(-squares / (4 * t)), pairs.T), shape=(len(points),) * 2).tocsr()
    return _stiffness(half + half.T, t)


def scikit_learn(points: np.ndarray, t: float) -> sp.csr_array:
    """Take all distances from scikit-learn's neighbor graph, on two processes' worth of threads."""
    graph = sp.csr_array(
        radius_neighbors_graph(points, CUTOFF * 2 * t**0.5, mode="distance", n_jobs=2)
    )
    graph.data = np.exp(-(graph.data**2) / (4 * t))
    return _stiffness(graph, t)


def _stiffness(kernel: sp.csr_array, t: float) -> sp.csr_array:
    n = kernel.shape[0]
    kernel.data *= 1 / (n * n * t * 4 * np.pi * t)
    return (sp.diags_array(kernel.sum(axis=1)) - kernel).tocsr()


METHODS = {"eigenshape": ours, "cKDTree": kd_tree, "scikit-learn": scikit_learn}


def measured(method: str, n: int, neighbors: int) -> Row:
    """Return seconds, peak GiB, the trace and the number of entries; run in a process of its own."""
    warnings.simplefilter("ignore")
    build: Callable[[np.ndarray, float], sp.csr_array] = METHODS[method]
    build(sphere_points(2000), 0.002)
    points, t = sphere_points(n), neighbors / (CUTOFF**2 * n)  # π (4h)² of 4π holds so many
    start = time.perf_counter()
    matrix = build(points, t)
    return {
        "wall": time.perf_counter() - start,
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
        "trace": float(matrix.diagonal().sum()),
        "entries": matrix.nnz,
    }


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    return [
        f"{row['n']:,} points, {row['entries'] / row['n']:.0f} entries a row",
        row["method"],
        f"{row['wall']:.2f}",
        ratio_text(row["ratio"]),
        f"{row['memory']:.1f}",
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    options = options_of(__doc__).parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells, threads="all threads")
    context = multiprocessing.get_context("spawn")
    for n, neighbors in QUICK if options.quick else FULL:
        ours = 0.0
        for method in METHODS:
            runs = []
            for _ in range(options.repeats):
                with context.Pool(1) as pool:
                    runs.append(pool.apply(measured, (method, n, neighbors)))
            median = statistics.median(run["wall"] for run in runs)
            ours = ours or median
            row = {"n": n, "method": method} | runs[0]
            report.add(row | {"wall": median, "ratio": median / ours})


if __name__ == "__main__":
    main()
