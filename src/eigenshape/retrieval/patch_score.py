"""How far apart two shapes are by their patches: the least over relative sizes."""

import numpy as np
from jaxtyping import Float, Float32

SIZE_PRICE = 0.01  # of a step of size


def patch_distances(
    query: Float32[np.ndarray, "b s v"], others: Float32[np.ndarray, "k b s v"]
) -> Float[np.ndarray, " k"]:
    """Return 1 - the mean over base radii of the cosine between Fisher vectors, the least over steps of size.

    Cutting a part off makes the rest larger in its unit box, so a radius of one shape is compared with the same, the
    next or the next but one of the other, each step at a small price.

    Returns
    -------
    (k,) float
        0 for the same vectors, up to 2.
    """
    n_bases, n_sizes, _ = query.shape
    best = np.full(len(others), np.inf)
    for step in sorted(range(1 - n_sizes, n_sizes), key=abs):
        ours, theirs = query[:, max(-step, 0)], others[:, :, max(step, 0)]
        cosines = theirs.reshape(len(others), -1) @ ours.ravel() / n_bases
        best = np.minimum(best, 1.0 - cosines + SIZE_PRICE * abs(step))
    return best
