"""How far apart two shapes are by their patches: the least over relative sizes."""

import numpy as np
from jaxtyping import Float, Float32, Int

from eigenshape._threads import one_blas_thread

SIZE_PRICE = 0.01  # of a step of size


@one_blas_thread()
def patch_distances(
    query: Float32[np.ndarray, "b s v"], others: Float32[np.ndarray, "k b s v"]
) -> Float[np.ndarray, " k"]:
    """Return 1 - the mean over base radii of the cosine between Fisher vectors of any length, least over steps of size.

    Cutting a part off makes the rest larger in its unit box, so a radius of one shape is compared with the same, the
    next or the next but one of the other, each step at a small price.

    Returns
    -------
    (k,) float
        0 for the same vectors, up to 2.
    """
    cosines = (
        others @ query.transpose(0, 2, 1) / (_lengths(others)[..., None] * _lengths(query)[:, None])
    )
    steps = range(1 - query.shape[1], query.shape[1])
    means = [
        cosines[:, :, max(step, 0), max(-step, 0)].mean(axis=1) - SIZE_PRICE * abs(step)
        for step in steps
    ]
    return 1.0 - np.max(means, axis=0).astype(np.float64)


def _lengths(codes: Float32[np.ndarray, "*k v"]) -> Float32[np.ndarray, "*k"]:
    return np.sqrt(np.einsum("...v,...v->...", codes, codes))


@one_blas_thread()
def view_distances(
    query: Float32[np.ndarray, "b s v"],
    others: Float32[np.ndarray, "k b s v"],
    views: Float32[np.ndarray, "w b s v"],
    of: Int[np.ndarray, " w"],
    *,
    query_views: Float32[np.ndarray, "u b s v"] | None = None,
) -> Float[np.ndarray, " k"]:
    """Return the means of `patch_distances` to shapes and to what is nearest of each, itself or one of its views.

    A partial scan is nearer to a scan from the same side than to the whole; a whole stays nearest to the whole. Where
    a shape has no views, since it is a part, those of the query serve in their place.

    Parameters
    ----------
    query : (b, s, v) float32
    others : (k, b, s, v) float32
    views : (w, b, s, v) float32
        What single viewpoints see of them, of as many or as few as there are.
    of : (w,) int
        Which of the others each is a view of.
    query_views : (u, b, s, v) float32, optional
        What single viewpoints see of the query, if it is closed.
    """
    own = patch_distances(query, others)
    nearest = own.copy()
    np.minimum.at(nearest, of, patch_distances(query, views))
    parts = np.setdiff1d(np.arange(len(others)), of)
    for view in query_views if query_views is not None else []:
        nearest[parts] = np.minimum(nearest[parts], patch_distances(view, others[parts]))
    return (own + nearest) / 2
