"""Regions of similar values on a surface, and the means of the values over them."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, real_numbers, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import label_components, require_finite_rows
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import edge_table

LOST = 0.05  # share of the variance that regions lose by default
SAME = 1e-12  # of the largest value: values that differ by less differ by rounding


@record
class CondensedFeatures(ReadOnly):
    """Values of a surface, averaged over regions.

    Attributes
    ----------
    labels : (n,) int
        Region of each vertex.
    values : (r, q) float
        Mean of each column over each region, weighted by the area.
    areas : (r,) float
        In length².
    centers : (r, 3) float
        Mean position of each region.
    lost : float
        Share of the variance of all columns that the means do not hold, between 0 and 1.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> found = es.features.condense(mesh, mesh.vertices[:, 2])
    >>> len(found.areas) < 20, found.lost <= 0.05
    (True, True)
    """

    labels: Int[np.ndarray, " n"]
    values: Float[np.ndarray, "r q"]
    areas: Float[np.ndarray, " r"]
    centers: Float[np.ndarray, "r 3"]
    lost: float


@one_blas_thread()
def condense(mesh: MeshLike, values: ArrayLike, tolerance: float = LOST) -> CondensedFeatures:
    """Join neighboring vertices with similar values into regions, and average over these.

    With the logarithm of a heat kernel signature these are the condensed features of connectomics
    (Pedigo and others 2025), from which spines, shafts and cell bodies of neurons are told apart:
    some thousand rows for millions of vertices. Regions R and S that share an edge are joined in
    the order of the variance that is lost, |R||S| / (|R| + |S|) · ‖mean over R - mean over S‖²
    (Ward 1963), as long as all that is lost stays below the tolerance.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices. Pieces that are not connected do not share a region.
    values : (n,) or (n, q) float
        On the vertices, in columns of comparable spread.
    tolerance : float
        Largest share of the variance to lose, 0 to 1. More regions keep more.

    Returns
    -------
    CondensedFeatures

    Raises
    ------
    InvalidParameterError
        If there is not one finite row for each vertex, or the tolerance is out of range.
    InvalidShapeError
        If a vertex has no area.

    See Also
    --------
    es.spectral.approximate_heat_signature : Signatures of large shapes.
    parcellate : Averages over given parcels.

    Examples
    --------
    >>> import numpy as np, eigenshape as es
    >>> mesh = es.make_creature("quadruped", n_vertices=2000)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 100)
    >>> heat = es.heat_kernel_signature(spectrum, es.spectral.default_times(spectrum))
    >>> found = es.features.condense(mesh, np.log(heat))
    >>> found.values.shape[1] == heat.shape[1], len(found.areas) < 100
    (True, True)
    """
    mesh = as_mesh(mesh)
    rows = real_numbers(values, "values").astype(np.float64)
    if rows.ndim not in (1, 2) or len(rows) != mesh.n_vertices or not rows.size:
        raise InvalidParameterError(
            f"values must hold one row for each of {mesh.n_vertices} vertices; the shape is "
            f"{rows.shape}."
        )
    if not 0 <= tolerance <= 1:
        raise InvalidParameterError(f"tolerance must lie between 0 and 1; it is {tolerance}.")
    require_finite_rows(rows, "values", "vertex")
    rows = rows.reshape(len(rows), -1)
    require_sound(mesh)
    areas = dual_volumes(mesh)
    shares = areas / areas.sum()
    scaled, size = size_one(rows - shares @ rows)
    scaled = scaled - shares @ scaled
    spread = float(shares @ np.square(scaled).sum(axis=1))
    most = tolerance * spread + float(SAME * np.abs(rows).max() / size) ** 2
    joined, losses = _join_regions(edge_table(mesh).edges, shares, scaled, most)
    # The joins that lose least come first; one that needs others comes after them.
    order = np.argsort(losses[:, 1], kind="stable")
    kept = order[np.cumsum(losses[order, 0]) <= most]
    n_nodes = mesh.n_vertices + len(joined)
    _, labels = label_components(
        n_nodes, joined[kept].ravel(), np.repeat(mesh.n_vertices + kept, 2)
    )
    _, labels = np.unique(labels[: mesh.n_vertices], return_inverse=True)
    sizes = np.bincount(labels, areas)
    means = [np.bincount(labels, areas * column) / sizes for column in (*rows.T, *mesh.vertices.T)]
    return CondensedFeatures(
        labels=labels,
        values=np.column_stack(means[:-3]),
        areas=sizes,
        centers=np.column_stack(means[-3:]),
        lost=min(1.0, float(losses[kept, 0].sum() / spread)) if spread else 0.0,
    )


def _join_regions(
    edges: Int[np.ndarray, "e 2"],
    weights: Float[np.ndarray, " n"],
    means: Float[np.ndarray, "n q"],
    most: float,
) -> tuple[Int[np.ndarray, "j 2"], Float[np.ndarray, "j 2"]]:
    """Join pairs of regions that are each other's cheapest neighbor, in rounds.

    Join j makes the region n + j. Of each, the two regions that it joins are returned, what it
    loses, and the most that one join below it loses, itself included. No join loses more than
    `most`.
    """
    n = len(weights)
    number, dearest = np.arange(n), np.zeros(n)
    joined, losses, n_joined = [np.empty((0, 2), dtype=np.int64)], [np.empty((0, 2))], 0
    while True:
        # Regions that touch no other are complete.
        used, places = np.unique(edges, return_inverse=True)
        edges = places.reshape(-1, 2)
        weights, means, number, dearest = weights[used], means[used], number[used], dearest[used]
        one, two = edges.T
        common = weights[one] * weights[two] / (weights[one] + weights[two])
        price = common * np.square(means[one] - means[two]).sum(axis=1)
        cheap = np.flatnonzero(price <= most)
        # Where prices are equal, the first edge counts as the cheaper one.
        rank = np.full(len(edges), len(edges))
        rank[cheap[np.argsort(price[cheap], kind="stable")]] = np.arange(len(cheap))
        first = np.full(len(used), len(edges))
        np.minimum.at(first, one, rank)
        np.minimum.at(first, two, rank)
        chosen = cheap[(first[one[cheap]] == rank[cheap]) & (first[two[cheap]] == rank[cheap])]
        if not len(chosen):
            return np.concatenate(joined), np.concatenate(losses)
        one, two = edges[chosen].T
        joined.append(number[edges[chosen]])
        above = np.maximum(price[chosen], dearest[edges[chosen]].max(axis=1))
        losses.append(np.column_stack([price[chosen], above]))
        total = weights[one] + weights[two]
        sums = weights[one, None] * means[one] + weights[two, None] * means[two]
        means[one], weights[one], dearest[one] = sums / total[:, None], total, above
        number[one] = n + n_joined + np.arange(len(chosen))
        n_joined += len(chosen)
        target = np.arange(len(used))
        target[two] = one
        edges = np.sort(target[edges], axis=1)
        edges = edges[edges[:, 0] < edges[:, 1]]
        edges = np.column_stack(np.divmod(np.unique(edges @ [len(used), 1]), len(used)))
