"""CPU time of `solve_spectrum` beside ARPACK in shift-invert mode, in one run on one core.

    python benchmarks/bench_spectrum.py                      icospheres
    python benchmarks/bench_spectrum.py a.off b.ply -k 300   meshes of your own

ARPACK is called as libraries call it (scipy.sparse.linalg.eigsh, a small negative shift, its default tolerance) and
proves nothing; our time includes the proof. Each figure is the median of three. A ratio under 1.4 is a tie.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy.sparse.linalg as spl
from threadpoolctl import threadpool_limits

from eigenshape import Laplacian, cotangent_laplacian, icosphere, read_mesh, solve_spectrum

REPEATS = 3


def arpack(laplacian: Laplacian, k: int) -> np.ndarray:
    """Shift-invert ARPACK, the shift being a hundredth of the first eigenvalue's size."""
    level = laplacian.stiffness.trace() / laplacian.mass.trace()
    shift = -0.01 * level / laplacian.n_points
    return spl.eigsh(laplacian.stiffness.tocsc(), k, M=laplacian.mass.tocsc(), sigma=shift, return_eigenvectors=True)[0]


def median_seconds(run: Callable[[], object]) -> float:
    """Median CPU time of a few runs."""
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return statistics.median(times)


def row(name: str, laplacian: Laplacian, k: int) -> str:
    """One line of the table: sizes, times, ratio and the largest difference of eigenvalues."""
    ours = median_seconds(lambda: solve_spectrum(laplacian, k))
    theirs = median_seconds(lambda: arpack(laplacian, k))
    spectrum = solve_spectrum(laplacian, k)
    difference = np.abs(spectrum.eigenvalues - np.sort(arpack(laplacian, k))).max() / spectrum.eigenvalues[-1]
    residual = spectrum.certificate.max_residual
    return (
        f"{name:<20} {laplacian.n_points:>7} {k:>5} {ours:>8.2f} {theirs:>8.2f} {theirs / ours:>7.2f} "
        f"{residual:>10.1e} {difference:>11.1e}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", nargs="*", type=Path)
    parser.add_argument("-k", type=int, nargs="+", default=[50, 300])
    arguments = parser.parse_args()
    shapes = [(path.name, read_mesh(path)) for path in arguments.meshes]
    shapes = shapes or [(f"icosphere({level})", icosphere(level)) for level in (4, 5)]
    header = ("n", 7), ("k", 5), ("ours", 8), ("ARPACK", 8), ("ratio", 7), ("residual", 10), ("difference", 11)
    sys.stdout.write(f"{'mesh':<20} " + " ".join(f"{title:>{width}}" for title, width in header) + "\n")
    with threadpool_limits(1, user_api="blas"):
        for name, mesh in shapes:
            for k in arguments.k:
                sys.stdout.write(row(name, cotangent_laplacian(mesh), k) + "\n")
                sys.stdout.flush()


if __name__ == "__main__":
    main()
