"""Kernels of `matching`: matches that agree, and distances by landmarks."""

import numpy as np
from jaxtyping import Float, Float32, Float64

from eigenshape._kernels import Out, kernel

ROUNDS = 20  # of the power method

Square = Float64[np.ndarray, "n n"]


def leading(
    ours: Float[np.ndarray, "n n"],
    theirs: Float[np.ndarray, "n n"],
    shares: Float[np.ndarray, " n"],
    ratio: float,
    slack: float,
    least: float,
) -> tuple[float, Float64[np.ndarray, " n"]]:
    """Return the largest eigenvalue of the agreement of matches, and the support of each match.

    `ours` and `theirs` are distances between matched points; the first are multiplied by `ratio`.
    Two matches agree by A = 1 - (error / slack)^2, where the error is a share of the longer
    distance. For the matrix √s A √s with the shares s, and its eigenvector v, the support is
    A √s v over the eigenvalue: this is v / √s, but finite even if a share is 0.
    """
    n = len(ours)
    agreeing = np.zeros((n, n))
    lengths = ours.astype(np.float64), theirs.astype(np.float64)
    fill_agreement(*lengths, ratio, slack, least, agreeing)
    roots, vector = np.sqrt(shares), np.ones(n)
    for _ in range(ROUNDS):
        support = agreeing @ (roots * vector)
        image = roots * support
        value = np.sqrt(np.cumsum(image * image)[-1])
        if value == 0:
            break
        vector, support = image / value, support / value
    return value, support


@kernel("n")
def fill_agreement(
    ours: Square,
    theirs: Square,
    ratio: float,
    slack: float,
    least: float,
    agreeing: Out[Square],
) -> None:
    """Fill how far two matches agree, as `leading` says; `agreeing` comes filled with 0."""


@kernel("n", "a")
def between_landmarks(
    lengths: Float32[np.ndarray, "n a"], found: Out[Float32[np.ndarray, "n n"]]
) -> None:
    """Write the mean of the bounds of each distance that distances to landmarks give."""
