"""Smooth the boundaries between parts: move each to a shortest cut that follows creases."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import breadth_first_order, dijkstra, maximum_flow

from certeig.kit.arguments import require_type
from certeig.kit.arrays import positive_values, record
from eigenshape._arrays import adjacency_matrix, label_components
from eigenshape.features.segmentation import Segmentation, adjacent_parts
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas, scale_to_unit
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table, face_pairs
from eigenshape.operators.anisotropic import curvature_tensors

# α of `curvature_tensors`, without unit: the strength of creases. The best of 1, 5, 10, 20, 40 and
# 100 on the tuning half of experiments/ch5_parts.
CONCAVITY = 10.0
# Half width of the band, as a share of the square root of the smaller part's area. The best of 0.1
# to 1.2 on the tuning half of experiments/ch5_parts.
WIDTH = 0.4
# The band covers at most this share of a part's depth, so that faces remain that surely belong to
# the part.
MOST_OF_DEPTH = 0.9
# Sum of all edge capacities. `maximum_flow` counts in 32-bit integers: a larger sum could overflow,
# a smaller one would round the costs more coarsely.
CAPACITY = 2.0**30
# Faces of a band above which it is cut coarsely first. The time of `maximum_flow` grows much faster
# than the number of faces. On twelve tuning shapes of experiments/ch5_parts, the largest among them
# (54,000 faces), the parts have the same Rand index as without.
MOST_FACES = 20_000
# Cells of the coarse band, about. On creatures of 160,000 and 320,000 vertices the cut costs 0.1 %
# more than the cheapest one; with 4,000 cells and 3 around it was 7 % more.
N_CELLS = 10_000
# Half width of the finer band around a coarse cut, in sides of a cell: the coarse cut follows the
# cells, and may be some of them away from the cheapest one.
CELLS_AROUND = 5
# Conductivity (1 on a plane) below which two faces lie on different sides of a crease. No cell
# extends across a crease, because cuts follow these: without this rule cuts cost twice as much.
CREASE = 0.3


def smooth_boundaries(
    mesh: MeshLike, segmentation: Segmentation, *, width: float = WIDTH
) -> Segmentation:
    """Move the boundary between adjacent parts to a shortest cut nearby.

    Each pair of adjacent parts is cut anew inside a band around their boundary, by a maximum flow
    between the faces on either side of the band. A cut costs the length of its edges times the
    conductivity across them. Conductivity is low in concave creases (`curvature_tensors`), so the
    cheapest cut is short and follows creases. Katz and Tal (2003, section 4.4) do the same with
    costs from dihedral angles. Pairs of parts are treated in ascending order. Each part keeps the
    faces at its feature point. A boundary that would break a part into pieces is not moved.

    Parameters
    ----------
    mesh : MeshLike
        With faces counter-clockwise as seen from outside, so that concave creases differ from
        ridges.
    segmentation : Segmentation
    width : float
        Reach of the band to both sides, measured between face centers, as a share of the square
        root of the smaller part's area. The band covers at most nine tenths of a part's depth.

    Returns
    -------
    Segmentation
        With the same feature points and new labels.

    Raises
    ------
    InvalidParameterError
        If the width is not positive.
    InvalidShapeError
        If a face has no area.

    See Also
    --------
    find_parts : Find parts and smooth their boundaries.
    segment : Cut a tree into parts.

    Examples
    --------
    Fewer edges lie between parts with smooth boundaries:

    >>> import eigenshape as es
    >>> mesh = es.make_creature("biped", n_vertices=1200)
    >>> rough = es.segment(es.find_parts(mesh).tree, n_regions=6)
    >>> smooth = es.features.smooth_boundaries(mesh, rough)
    >>> def count_cut_edges(parts):
    ...     regions = (mesh.faces[parts.labels == part] for part in range(6))
    ...     pieces = (es.TriangleMesh(mesh.vertices, faces) for faces in regions)
    ...     return sum(len(es.geometry.boundary_edges(piece)) for piece in pieces) // 2
    >>> count_cut_edges(smooth) < count_cut_edges(rough)
    True
    """
    mesh = as_mesh(mesh)
    require_type(segmentation, Segmentation, "segmentation")
    (share,) = positive_values(width, "width")
    tensors = curvature_tensors(mesh, CONCAVITY, concave=True)
    return move_boundaries(mesh, segmentation, tensors, share)


def move_boundaries(
    mesh: TriangleMesh,
    segmentation: Segmentation,
    tensors: Float[np.ndarray, "f 3 3"],
    share: float = WIDTH,
) -> Segmentation:
    """Do what `smooth_boundaries` does, with tensors that are there already."""
    labels, network = segmentation.labels.copy(), build_network(mesh, tensors)
    tips = segmentation.features.vertices[segmentation.labels]
    fixed = (mesh.faces == tips[:, None]).any(axis=1)
    for one, two in adjacent_parts(mesh, labels).tolist():
        _move_boundary(network, labels, (one, two), fixed, share)
    return Segmentation(labels, segmentation.features)


@record
class _Network:
    """Graph of faces joined over edges, for a mesh scaled to unit size.

    pairs: the two faces of each inner edge; lengths: distance of their centers; costs: cost of a
    cut along the edge; conductivity: across the edge; areas, centers: of the faces.
    """

    pairs: Int[np.ndarray, "p 2"]
    lengths: Float[np.ndarray, " p"]
    costs: Float[np.ndarray, " p"]
    areas: Float[np.ndarray, " f"]
    centers: Float[np.ndarray, "f 3"]
    conductivity: Float[np.ndarray, " p"]


def build_network(mesh: TriangleMesh, tensors: Float[np.ndarray, "f 3 3"]) -> _Network:
    """Measure the graph of the faces, with the cost of a cut along each inner edge."""
    points, _ = scale_to_unit(mesh)
    unit = TriangleMesh(points, mesh.faces)
    table = edge_table(mesh)  # which this mesh has listed already
    pairs, edges = face_pairs(table)
    centers = points[mesh.faces].mean(axis=1)
    across = centers[pairs[:, 1]] - centers[pairs[:, 0]]
    lengths = np.linalg.norm(across, axis=1)
    # Conductivity in the direction across the edge: the mean of the two faces' tensors.
    between = tensors[pairs].mean(axis=1)
    squares = np.einsum("pi,pij,pj->p", across, between, across)
    conductivity = np.divide(squares, lengths**2, out=np.ones_like(lengths), where=lengths > 0)
    sides = np.linalg.norm(np.diff(points[table.edges[edges]], axis=1)[:, 0], axis=1)
    costs, areas = sides * conductivity, face_areas(unit)
    return _Network(pairs, lengths, costs, areas, centers, conductivity)


def _move_boundary(
    network: _Network,
    labels: Int[np.ndarray, " f"],
    parts: tuple[int, int],
    fixed: Bool[np.ndarray, " f"],
    share: float,
) -> None:
    """Move the boundary between two parts; `labels` changes in place."""
    # Restrict the network to the faces of the two parts.
    is_either = (labels == parts[0]) | (labels == parts[1])
    faces = np.flatnonzero(is_either)
    local = np.full(len(labels), -1)
    local[faces] = np.arange(len(faces))
    inside = is_either[network.pairs[:, 0]] & is_either[network.pairs[:, 1]]
    pairs, side = local[network.pairs[inside]], labels[faces] == parts[0]
    crossing = side[pairs[:, 0]] != side[pairs[:, 1]]
    if not crossing.any():  # an earlier cut has separated them
        return

    # The band: faces near the boundary, measured along the graph.
    areas = network.areas[faces]
    graph = adjacency_matrix(pairs, network.lengths[inside], len(faces))
    depth = dijkstra(graph, indices=np.unique(pairs[crossing]), min_only=True)
    reach = share * min(areas[side].sum(), areas[~side].sum()) ** 0.5
    deepest = np.where(side, depth[side].max(), depth[~side].max())
    band = depth < np.minimum(reach, MOST_OF_DEPTH * deepest)
    band &= ~fixed[faces]
    if band[side].all() or band[~side].all():
        return
    part = _Network(
        pairs,
        network.lengths[inside],
        network.costs[inside],
        areas,
        network.centers[faces],
        network.conductivity[inside],
    )
    cut = _cheapest_cut(part, side, band)
    # A cut that breaks a part into pieces is not made.
    n_after, n_before = (
        label_components(len(faces), *pairs[which[pairs[:, 0]] == which[pairs[:, 1]]].T)[0]
        for which in (cut, side)
    )
    if n_after <= n_before:
        labels[faces] = np.where(cut, *parts)


def _cheapest_cut(
    network: _Network, side: Bool[np.ndarray, " k"], band: Bool[np.ndarray, " k"]
) -> Bool[np.ndarray, " k"]:
    """Say which faces lie on the first side of the cheapest cut through the band.

    A band of many faces is cut into cells, whose cheapest cut is found first. Then only the faces
    near that cut are free, and so on until they are few.
    """
    while np.count_nonzero(band) > MOST_FACES:
        # A cell is a connected set of faces of the band with centers in one cube of a grid. Each face
        # beyond the band is a cell by itself.
        length = float((network.areas[band].sum() / N_CELLS) ** 0.5)
        cubes = np.floor(network.centers / length).astype(np.int64)
        one, two = network.pairs.T
        together = band[one] & band[two] & (cubes[one] == cubes[two]).all(axis=1)
        together &= network.conductivity > CREASE
        _, cell = label_components(len(band), one[together], two[together])
        free = np.zeros(cell.max() + 1, dtype=bool)
        free[cell[band]] = True
        of_cell = np.zeros(len(free), dtype=bool)
        of_cell[cell] = side
        ends = cell[network.pairs]
        between = ends[:, 0] != ends[:, 1]
        cut = _minimum_cut(ends[between], network.costs[between], of_cell, free)[cell]

        # The next band: what is near this cut, and was free before.
        crossing = cut[network.pairs[:, 0]] != cut[network.pairs[:, 1]]
        if not crossing.any():
            return cut
        near = np.unique(network.pairs[crossing])
        graph = adjacency_matrix(network.pairs, network.lengths, len(side))
        reach = CELLS_AROUND * length
        depth = dijkstra(graph, indices=near, min_only=True, limit=reach)
        narrow = band & (depth <= reach)
        side = cut
        if np.count_nonzero(narrow) > np.count_nonzero(band) / 2:  # cells do not help here
            return _minimum_cut(network.pairs, network.costs, side, narrow)
        band = narrow
    return _minimum_cut(network.pairs, network.costs, side, band)


def _minimum_cut(
    pairs: Int[np.ndarray, "p 2"],
    costs: Float[np.ndarray, " p"],
    side: Bool[np.ndarray, " k"],
    band: Bool[np.ndarray, " k"],
) -> Bool[np.ndarray, " k"]:
    """Say which faces lie on the first side of the cheapest cut through the band."""
    # Node 0 is the first side beyond the band, node 1 the second; each face of the band has a node
    # of its own.
    node = np.where(side, 0, 1)
    node[band] = 2 + np.arange(np.count_nonzero(band))
    n_nodes = 2 + int(np.count_nonzero(band))
    ends = node[pairs]
    kept = ends[:, 0] != ends[:, 1]
    capacities = np.int64(1) + np.floor(CAPACITY * costs[kept] / costs[kept].sum()).astype(np.int64)
    capacities[(ends[kept] < 2).all(axis=1)] = 0
    graph = sp.csr_matrix(adjacency_matrix(ends[kept], capacities, n_nodes).astype(np.int32))
    # Maximum flow, minimum cut: the first side is what the source reaches in the residual graph.
    residual = graph - maximum_flow(graph, 0, 1).flow
    residual.data = (residual.data > 0).astype(np.int8)
    residual.eliminate_zeros()
    reached = np.zeros(graph.shape[0], dtype=bool)
    reached[breadth_first_order(residual, 0, return_predecessors=False)] = True
    return reached[node]
