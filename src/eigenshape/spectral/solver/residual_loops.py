"""Compiled loops of `pencil`: what Rayleigh quotients and residuals sum over points, in one pass over the vectors."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit

ROWS = 256  # whose sums are added up before they are added to those of others, for accuracy


@njit
@no_type_check
def quotient_sums(stiffness, mass, vectors, sums):
    """Add φᵀWφ and φᵀBφ of each column to the rows of `sums`; W and B are symmetric."""
    images, part = np.empty((2, vectors.shape[1])), np.zeros(sums.shape)
    for i in range(len(vectors)):
        _image(stiffness, vectors, i, images[0])
        _image(mass, vectors, i, images[1])
        for c in range(len(images[0])):
            part[0, c] += vectors[i, c] * images[0, c]
            part[1, c] += vectors[i, c] * images[1, c]
        _pass_on(part, sums, i, len(vectors))


@njit
@no_type_check
def residual_sums(stiffness, mass, vectors, values, weights, sums):
    """Add Σ (Wφ - λBφ)² / weights and φᵀBφ of each column to the rows of `sums`."""
    images, part = np.empty((2, vectors.shape[1])), np.zeros(sums.shape)
    for i in range(len(vectors)):
        _image(stiffness, vectors, i, images[0])
        _image(mass, vectors, i, images[1])
        for c in range(len(values)):
            rest = images[0, c] - values[c] * images[1, c]
            part[0, c] += rest * rest / weights[i]
            part[1, c] += vectors[i, c] * images[1, c]
        _pass_on(part, sums, i, len(vectors))


@njit
@no_type_check
def _image(matrix, vectors, i, image):
    starts, columns, entries = matrix
    image[:] = 0
    for place in range(starts[i], starts[i + 1]):
        value, j = entries[place], columns[place]
        for c in range(len(image)):
            image[c] += value * vectors[j, c]


@njit
@no_type_check
def _pass_on(part, sums, i, n):
    if (i + 1) % ROWS == 0 or i + 1 == n:
        sums += part
        part[:] = 0
