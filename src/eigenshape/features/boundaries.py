"""Boundaries between parts, moved to where a cut is shortest and follows creases."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import breadth_first_order, connected_components, dijkstra, maximum_flow

from eigenshape._arguments import require_type
from eigenshape._arrays import frozen, positive_values
from eigenshape.features.segmentation import Segmentation, touching_parts
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas, unit_scaled
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table, face_pairs
from eigenshape.operators.anisotropic import curvature_tensors

CONCAVITY = 10.0  # α of `curvature_tensors`
WIDTH = 0.4  # of the square root of the smaller part's area
CORE = 0.9  # of a part's depth: no band reaches deeper
CAPACITY = 2.0**30  # of all edges together: what the flow counts with has 31 bits


def smooth_boundaries(
    mesh: MeshLike, segmentation: Segmentation, *, width: float = WIDTH
) -> Segmentation:
    """Move the boundary between each two parts to the least cut in a band around it.

    A cut costs the length of its edges times the conductivity across them, which is low in concave creases
    (`curvature_tensors`), so that the least is short and follows creases (as Katz and Tal 2003, 4.4, whose costs are of
    dihedral angles alone). It is a maximum flow between what of the two parts lies beyond the band. Pairs of parts are
    taken in their order. A part keeps its feature point and does not fall apart: where it would, the boundary stays.

    Parameters
    ----------
    mesh : MeshLike
        Its faces seen from outside counter-clockwise, so that creases are known from ridges.
    segmentation : Segmentation
    width : float
        How far the band reaches to both sides, along face centres, as a share of the square root of the smaller part's
        area. It never reaches deeper than nine tenths of a part.

    Returns
    -------
    Segmentation
        The same feature points, with other labels.

    Raises
    ------
    InvalidParameterError
        If the width is not positive.
    InvalidShapeError
        If a face has no area.
    """
    mesh = as_mesh(mesh)
    require_type(segmentation, Segmentation, "segmentation")
    (share,) = positive_values(width, "width")
    network, labels = _network(mesh), segmentation.labels.copy()
    held = _faces_at(mesh, segmentation)
    for one, two in touching_parts(mesh, labels).tolist():
        _move(network, labels, (one, two), held, share)
    return Segmentation(frozen(labels), segmentation.features)


@dataclass(frozen=True, eq=False)
class _Network:
    """Faces joined over edges: pairs (p, 2), the way between their centres, what a cut there costs; areas (f,)."""

    pairs: Int[np.ndarray, "p 2"]
    ways: Float[np.ndarray, " p"]
    costs: Float[np.ndarray, " p"]
    areas: Float[np.ndarray, " f"]


def _network(mesh: TriangleMesh) -> _Network:
    points, _ = unit_scaled(mesh)
    unit = TriangleMesh(points, mesh.faces)
    table = edge_table(unit)
    pairs, edges = face_pairs(table)
    centres = points[mesh.faces].mean(axis=1)
    across = centres[pairs[:, 1]] - centres[pairs[:, 0]]
    ways = np.linalg.norm(across, axis=1)
    tensors = curvature_tensors(unit, CONCAVITY, concave=True)[pairs].mean(axis=1)
    squares = np.einsum("pi,pij,pj->p", across, tensors, across)
    conductivity = np.divide(squares, ways**2, out=np.ones_like(ways), where=ways > 0)
    lengths = np.linalg.norm(np.diff(points[table.edges[edges]], axis=1)[:, 0], axis=1)
    return _Network(pairs, ways, lengths * conductivity, face_areas(unit))


def _faces_at(mesh: TriangleMesh, segmentation: Segmentation) -> Bool[np.ndarray, " f"]:
    """Mark the faces at the feature point of their own part."""
    tips = segmentation.features.vertices[segmentation.labels]
    return (mesh.faces == tips[:, None]).any(axis=1)


def _move(
    network: _Network,
    labels: Int[np.ndarray, " f"],
    parts: tuple[int, int],
    held: Bool[np.ndarray, " f"],
    share: float,
) -> None:
    """Cut two parts anew, in place."""
    faces = np.flatnonzero(np.isin(labels, parts))
    local = np.full(len(labels), -1)
    local[faces] = np.arange(len(faces))
    inside = (local[network.pairs] >= 0).all(axis=1)
    pairs, side = local[network.pairs[inside]], labels[faces] == parts[0]
    crossing = side[pairs[:, 0]] != side[pairs[:, 1]]
    if not crossing.any():  # an earlier cut has parted them
        return
    band = _band(
        network.areas[faces],
        _graph(pairs, network.ways[inside], len(faces)),
        side,
        pairs[crossing],
        share,
    )
    band &= ~held[faces]
    if band[side].all() or band[~side].all():
        return
    cut = _least_cut(pairs, network.costs[inside], side, band)
    if _pieces(pairs, cut) <= _pieces(pairs, side):
        labels[faces] = np.where(cut, *parts)


def _graph(pairs: Int[np.ndarray, "p 2"], weights: np.ndarray, n: int) -> sp.csr_array:
    both = np.concatenate([pairs, pairs[:, ::-1]]).T
    return sp.coo_array((np.concatenate([weights, weights]), both), shape=(n, n)).tocsr()


def _band(
    areas: Float[np.ndarray, " k"],
    graph: sp.csr_array,
    side: Bool[np.ndarray, " k"],
    crossing: Int[np.ndarray, "c 2"],
    share: float,
) -> Bool[np.ndarray, " k"]:
    depth = dijkstra(graph, indices=np.unique(crossing), min_only=True)
    reach = share * min(areas[side].sum(), areas[~side].sum()) ** 0.5
    deepest = np.where(side, depth[side].max(), depth[~side].max())
    return depth < np.minimum(reach, CORE * deepest)


def _least_cut(
    pairs: Int[np.ndarray, "p 2"],
    costs: Float[np.ndarray, " p"],
    side: Bool[np.ndarray, " k"],
    band: Bool[np.ndarray, " k"],
) -> Bool[np.ndarray, " k"]:
    """Say which faces lie on the first side of the least cut through the band."""
    node = np.where(side, 0, 1)
    node[band] = 2 + np.arange(np.count_nonzero(band))
    ends = node[pairs]
    kept = ends[:, 0] != ends[:, 1]
    capacities = np.int64(1) + np.floor(CAPACITY * costs[kept] / costs[kept].sum()).astype(np.int64)
    capacities[(ends[kept] < 2).all(axis=1)] = 0
    graph = sp.csr_matrix(
        _graph(ends[kept], capacities, 2 + int(np.count_nonzero(band))).astype(np.int32)
    )
    residual = graph - maximum_flow(graph, 0, 1).flow
    residual.data = (residual.data > 0).astype(np.int8)
    residual.eliminate_zeros()
    reached = np.zeros(graph.shape[0], dtype=bool)
    reached[breadth_first_order(residual, 0, return_predecessors=False)] = True
    return reached[node]


def _pieces(pairs: Int[np.ndarray, "p 2"], side: Bool[np.ndarray, " k"]) -> int:
    """Count the pieces into which both sides fall."""
    whole = side[pairs[:, 0]] == side[pairs[:, 1]]
    return int(
        connected_components(_graph(pairs[whole], np.ones(whole.sum()), len(side)), directed=False)[
            0
        ]
    )
