"""Compiled loops of `matching`: matches that agree, and distances by landmarks."""

import numpy as np

from eigenshape._compile import njit

ROUNDS = 20  # of the power method


@njit
def leading(ours, theirs, shares, ratio, slack, least):
    """Return the largest eigenvalue of the agreement of matches, and the support of each match.

    `ours` and `theirs` are distances between matched points; the first are multiplied by `ratio`.
    Two matches agree by A = 1 - (error / slack)^2, where the error is a share of the longer
    distance. For the matrix √s A √s with the shares s, and its eigenvector v, the support is
    A √s v over the eigenvalue: this is v / √s, but finite even if a share is 0.
    """
    count = len(ours)
    agreeing = np.zeros((count, count))
    for one in range(count):
        for two in range(one):
            a, b = ratio * ours[one, two], theirs[one, two]
            if np.isinf(a) or np.isinf(b):
                continue
            error = abs(a - b) / max(a, b, least) / slack
            if error < 1:
                agreeing[one, two] = agreeing[two, one] = 1 - error * error
    roots, vector = np.sqrt(shares), np.ones(count)
    support, value = np.zeros(count), 0.0
    for _ in range(ROUNDS):
        support = agreeing @ (roots * vector)
        image = roots * support
        value = np.sqrt((image * image).sum())
        if value == 0:
            break
        vector, support = image / value, support / value
    return value, support


@njit
def between_landmarks(lengths, found):
    """Write the mean of the bounds of each distance that distances to landmarks give."""
    n_points, n_landmarks = lengths.shape
    for one in range(n_points):
        found[one, one] = 0.0
        for two in range(one):
            most, least = np.inf, 0.0
            for landmark in range(n_landmarks):
                a, b = lengths[one, landmark], lengths[two, landmark]
                most = min(most, a + b)
                if a != b:  # two infinite distances have no difference
                    least = max(least, abs(a - b))
            found[one, two] = found[two, one] = (most + least) / 2
