"""Distances between Fisher vectors of shapes: the least over relative sizes."""

import numpy as np
from jaxtyping import Float, Float32, Int

from eigenshape._threads import one_blas_thread

# Added to a distance for each step of 1.25 in relative size, so that of equally good steps the
# smallest counts.
SIZE_PRICE = 0.01


@one_blas_thread()
def patch_distances(
    query: Float32[np.ndarray, "b s v"], others: Float32[np.ndarray, "k b s v"]
) -> Float[np.ndarray, " k"]:
    """Return 1 - the mean cosine of Fisher vectors over base radii, at the best relative size.

    Cutting a part off makes the rest larger in its unit box. So a radius of one shape is compared
    with the same radius, the next and the next but one of the other, at a small price for each
    step.

    Returns
    -------
    (k,) float
        0 for the same vectors, up to 2.
    """
    products = others @ query.transpose(0, 2, 1)
    cosines = products / (_lengths(others)[..., None] * _lengths(query)[:, None])
    means = []
    for step in range(1 - query.shape[1], query.shape[1]):
        mean = cosines[:, :, max(step, 0), max(-step, 0)].mean(axis=1)
        means.append(mean - SIZE_PRICE * abs(step))
    return 1.0 - np.max(means, axis=0).astype(np.float64)


def _lengths(codes: Float32[np.ndarray, "*k v"]) -> Float32[np.ndarray, "*k"]:
    return np.sqrt(np.einsum("...v,...v->...", codes, codes))


@one_blas_thread()
def view_distances(
    query: Float32[np.ndarray, "b s v"],
    others: Float32[np.ndarray, "k b s v"],
    views: Float32[np.ndarray, "w b s v"],
    shape_of_view: Int[np.ndarray, " w"],
    *,
    query_views: Float32[np.ndarray, "u b s v"] | None = None,
) -> Float[np.ndarray, " k"]:
    """For each stored shape, average two distances: to it, and to the closest of it and its views.

    A partial scan is nearer to a scan from the same side than to the whole; a whole stays nearest
    to the whole. If a stored shape has no views, since it is a part, the views of the query serve
    in their place.

    Parameters
    ----------
    query : (b, s, v) float32
    others : (k, b, s, v) float32
    views : (w, b, s, v) float32
        Partial views of all the others, any number of each.
    shape_of_view : (w,) int
        Number, below k, of the shape that each is a view of.
    query_views : (u, b, s, v) float32, optional
        Partial views of the query, if it is closed.

    Returns
    -------
    (k,) float
    """
    own = patch_distances(query, others)
    nearest = own.copy()
    np.minimum.at(nearest, shape_of_view, patch_distances(query, views))
    parts = np.setdiff1d(np.arange(len(others)), shape_of_view)
    for view in query_views if query_views is not None else []:
        nearest[parts] = np.minimum(nearest[parts], patch_distances(view, others[parts]))
    return (own + nearest) / 2
