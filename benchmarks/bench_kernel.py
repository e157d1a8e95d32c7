"""Time and peak memory to assemble a Gaussian kernel, beside scipy's and scikit-learn's trees, in one run.

    python benchmarks/bench_kernel.py              both sizes (about five minutes)
    python benchmarks/bench_kernel.py --repeats 1

Points lie on the unit sphere. The first size is that of the mesh Laplacian at t = e²; the second a million points with
100 neighbors each. Every method ends with the same matrix, W as sparse rows; each runs in a process of its own, after
one small run that loads and compiles what it needs. Wall seconds, median; a ratio under 1.4 is a tie. What bounds the
work is memory: a matrix of z entries has 12 z bytes, to be written once, and z exponentials.
"""

import argparse
import multiprocessing
import resource
import statistics
import sys
import time
import warnings
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from sklearn.neighbors import radius_neighbors_graph

from eigenshape.operators import gaussian_laplacian

SIZES = {"mesh Laplacian, t = e²": (160_000, 247), "graph, 100 neighbors": (1_000_000, 100)}
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


def measured(method: str, n: int, neighbors: int, repeats: int) -> tuple[float, float, float, int]:
    """Return seconds, peak GiB, a checksum and the number of entries; run in a process of its own."""
    warnings.simplefilter("ignore")
    build: Callable[[np.ndarray, float], sp.csr_array] = METHODS[method]
    build(sphere_points(2000), 0.002)
    points, t = sphere_points(n), neighbors / (CUTOFF**2 * n)  # π (4h)² of 4π holds so many
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        matrix = build(points, t)
        times.append(time.perf_counter() - start)
        checksum, entries = float(matrix.diagonal().sum()), matrix.nnz
        del matrix
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return statistics.median(times), peak, checksum, entries


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3)
    repeats = parser.parse_args().repeats
    sys.stdout.write(
        f"{'':<26} {'n':>8} {'entries':>10} {'seconds':>8} {'ratio':>6} {'peak GiB':>9} {'trace':>14}\n"
    )
    context = multiprocessing.get_context("spawn")
    for size, (n, neighbors) in SIZES.items():
        base = 0.0
        for method in METHODS:
            with context.Pool(1) as pool:
                seconds, peak, checksum, entries = pool.apply(
                    measured, (method, n, neighbors, repeats)
                )
            base = base or seconds
            sys.stdout.write(
                f"{method:<26} {n:>8} {entries:>10} {seconds:>8.2f} {seconds / base:>6.2f} {peak:>9.2f} "
                f"{checksum:>14.8g}   {size}\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main()
