"""Kernels of `matching`: matches that agree, and distances by landmarks."""

import numpy as np
from jaxtyping import Float32, Float64

from certeig.kit.blas import blas_routine
from certeig.kit.kernels import Out, kernel


def leading(
    ours: Float32[np.ndarray, "n n"],
    theirs: Float32[np.ndarray, "n n"],
    shares: Float64[np.ndarray, " n"],
    ratio: float,
    slack: float,
    shortest: float,
) -> tuple[float, Float64[np.ndarray, " n"]]:
    """Return the largest eigenvalue of the agreement of matches, and the support of each match.

    `ours` and `theirs` are distances between matched points; the first are multiplied by `ratio`.
    Two matches agree by A = 1 - (error / slack)^2, where the error is a share of the longer
    distance. For the matrix √s A √s with the shares s, and its eigenvector v, the support is
    A √s v over the eigenvalue: this is v / √s, but finite even if a share is 0.
    """
    n = len(shares)
    agreeing, (vector, scaled), support = np.empty((n, n)), np.empty((2, n)), np.empty(n)
    scratch, blas = (agreeing, vector, scaled), (blas_routine("dgemv"),)
    value = find_leading(ours, theirs, shares, ratio, slack, shortest, *scratch, support, blas)
    return value, support


@kernel("n")
def find_leading(
    ours: Float32[np.ndarray, "n n"],
    theirs: Float32[np.ndarray, "n n"],
    shares: Float64[np.ndarray, " n"],
    ratio: float,
    slack: float,
    shortest: float,
    agreeing: Out[Float64[np.ndarray, "n n"]],
    vector: Out[Float64[np.ndarray, " n"]],
    scaled: Out[Float64[np.ndarray, " n"]],
    support: Out[Float64[np.ndarray, " n"]],
    blas: tuple[int],
) -> float:
    """Return the value of `leading`, and fill the support; the other arrays are scratch."""


@kernel("n_points", "n_landmarks")
def between_landmarks(
    lengths: Float32[np.ndarray, "n_points n_landmarks"],
    found: Out[Float32[np.ndarray, "n_points n_points"]],
) -> None:
    """Write the mean of the bounds of each distance that distances to landmarks give."""
