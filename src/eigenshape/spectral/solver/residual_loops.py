"""Compiled loop of `pencil`: the sums in Rayleigh quotients and residuals, in one pass."""

from eigenshape._compile import njit

SUMMED_ROWS = 256  # rows whose sums are added up separately first, for accuracy


@njit
def add_sums(stiffness, mass, vectors, values, weights, with_residuals, images, part, sums):
    """Add φᵀWφ, φᵀBφ and Σ (Wφ - λBφ)² / weights of each column to the rows of `sums`; W and B are symmetric.

    W and B are given by int64 pointers, indices and entries; `values` are the λ. Without residuals
    the values are not used and the last row of `sums` does not change. `images` (2, k) and `part`
    (3, k), filled with 0, are scratch. One loop for both uses compiles in half the time of two.
    """
    n, k = vectors.shape
    for i in range(n):
        _fill_image(stiffness, vectors, i, images[0])
        _fill_image(mass, vectors, i, images[1])
        for c in range(k):
            part[0, c] += vectors[i, c] * images[0, c]
            part[1, c] += vectors[i, c] * images[1, c]
        if with_residuals:
            for c in range(k):
                rest = images[0, c] - values[c] * images[1, c]
                part[2, c] += rest * rest / weights[i]
        if (i + 1) % SUMMED_ROWS == 0 or i + 1 == n:
            for row in range(3):
                for c in range(k):
                    sums[row, c] += part[row, c]
                    part[row, c] = 0.0


@njit
def _fill_image(matrix, vectors, i, image):
    """Fill `image` with row i of the matrix times the vectors."""
    starts, columns, entries = matrix
    for c in range(len(image)):
        image[c] = 0.0
    for place in range(starts[i], starts[i + 1]):
        value, j = entries[place], columns[place]
        for c in range(len(image)):
            image[c] += value * vectors[j, c]
