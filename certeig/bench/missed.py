"""Count how often `scipy.sparse.linalg.eigsh` misses a copy of a multiple eigenvalue, and draw one such spectrum.

    python bench/missed.py [PICTURE]

The graph is a hypercube of dimension 8: 256 points, whose Laplacian has the eigenvalue 2j as often as
j of 8 can be chosen, 1, 8, 28, 56, ... times. Takes matplotlib.
"""

import sys
from functools import reduce
from math import comb

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh

import certeig

DIMENSION, K, STARTS = 8, 37, 100
EXACT = np.repeat(
    2.0 * np.arange(DIMENSION + 1), [comb(DIMENSION, j) for j in range(DIMENSION + 1)]
)


def main(picture: str | None = None) -> None:
    """Print how many of the random starts miss a copy, and draw the first that does."""
    edge = sp.csc_array([[1.0, -1.0], [-1.0, 1.0]])
    hypercube = reduce(lambda one, two: sp.kronsum(one, two, format="csc"), [edge] * DIMENSION)
    found = []
    for seed in range(STARTS):
        start = np.random.default_rng(seed).standard_normal(hypercube.shape[0])
        values = eigsh(hypercube, k=K, sigma=-0.05, v0=start, return_eigenvectors=False)
        found.append(np.sort(values))
    wrong = [values for values in found if np.abs(values - EXACT[:K]).max() > 1e-6]
    print(f"eigsh misses a copy in {len(wrong)} of {STARTS} starts, and does not say so.")
    proved = certeig.eigenpairs(hypercube, k=K)
    print(f"certeig: {proved.certificate.explain()}")
    if picture and wrong:
        draw(picture, wrong[0], proved.eigenvalues)


def draw(picture: str, wrong: np.ndarray, proved: np.ndarray) -> None:
    """Draw the eigenvalues of both by their numbers."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 2.6), layout="constrained")
    numbers = np.arange(1, K + 1)
    axes.plot(numbers, proved, "o", color="0.75", markersize=8, label="certeig, all proved")
    axes.plot(numbers, wrong, ".", color="tab:red", label="scipy.sparse.linalg.eigsh")
    off = np.flatnonzero(np.abs(wrong - proved) > 1e-6)
    place = int(off[0])
    axes.annotate(
        f"copies of {EXACT[place]:.0f} that are missing: {len(off)}",
        (numbers[place], wrong[place]),
        xytext=(-12, -4),
        textcoords="offset points",
        ha="right",
    )
    axes.set(xlabel="number", ylabel="eigenvalue", yticks=[0, 2, 4, 6])
    axes.legend(loc="lower right")
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    main(*sys.argv[1:])
