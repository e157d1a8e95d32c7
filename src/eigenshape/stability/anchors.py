"""Anchor nodes spread over a shape, and the regions around them (thesis 4.2.1)."""

from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, positive_number, positive_values, record, whole_number
from certeig.kit.errors import InvalidParameterError
from eigenshape._corners import longest_edges
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.distances.geodesic import unchecked_waves
from eigenshape.geometry.samples.surface_points import SurfacePoints, place_points
from eigenshape.stability.perturbation import OUTSIDE, Perturbation

# Relative margin for the rounding of a distance; a larger one tests a few more nodes exactly.
SLACK = 1e-12
Points = Float[np.ndarray, "_ d"]


@record
class AnchorNodes(ReadOnly):
    """A (δ, δ)-sample of a surface, chosen among its vertices.

    Attributes
    ----------
    vertices : (r,) int
        The nodes, in the order of choice. Any two are at least δ apart along the surface.
    points : (r, d) float
        Coordinates of the nodes, in length.
    reached : float
        Largest distance of a vertex to the nearest node, in length; less than δ.
    cover : float
        Upper bound of the distance of any point of the surface to the nearest node, in length:
        `reached` plus 1/√3 of the longest edge.

    See Also
    --------
    anchor_nodes : Choose nodes.

    Examples
    --------
    >>> import eigenshape as es
    >>> nodes = es.stability.anchor_nodes(es.shapes.grid(4, 1), 0.9)
    >>> nodes.vertices, nodes.reached < 0.9
    (array([0, 9, 1, 8]), True)
    """

    vertices: Int[np.ndarray, " r"]
    points: Float[np.ndarray, "r d"]
    reached: float
    cover: float


def anchor_nodes(mesh: MeshLike, delta: float, *, start: int = 0) -> AnchorNodes:
    """Choose anchor nodes by farthest-point sampling (thesis 4.2.1).

    The next node is the vertex with the largest geodesic distance to all earlier nodes, until that
    distance is less than δ. Nodes are then at least δ apart, and each vertex is less than δ from
    one.

    Parameters
    ----------
    mesh : MeshLike
        Of dimension 2.
    delta : float
        δ, in length.
    start : int
        The first node.

    Returns
    -------
    AnchorNodes

    Raises
    ------
    InvalidShapeError
        If the mesh is not a surface.
    InvalidParameterError
        If δ is not positive, or `start` is not a vertex.

    Examples
    --------
    >>> import eigenshape as es
    >>> nodes = es.stability.anchor_nodes(es.shapes.grid(4, 1), 0.9)
    >>> nodes.vertices
    array([0, 9, 1, 8])
    """
    mesh = as_simplicial(mesh)
    positive_values(delta, "delta")
    wave, least, chosen = unchecked_waves(mesh), np.full(mesh.n_points, np.inf), []
    vertex = whole_number(start, "start", 0, mesh.n_points - 1)
    while least[vertex] >= delta:
        chosen.append(vertex)
        # The wave need not go farther than it comes nearest.
        np.minimum(least, wave(np.array([vertex]), least.max()), out=least)
        vertex = int(least.argmax())
    reached = float(least.max())
    return AnchorNodes(
        vertices=np.array(chosen),
        points=mesh.points[chosen],
        reached=reached,
        cover=reached + float(longest_edges(mesh).max()) / 3**0.5,
    )


def anchor_region(points: Points, nodes: Points, delta: float) -> Bool[np.ndarray, " _"]:
    """Say which points of M are within Euclidean distance δ of some nodes (thesis 4.2.1).

    Parameters
    ----------
    points : (p, d) float
        Points of M, in length.
    nodes : (a, d) float
        The set A of nodes, in length.
    delta : float
        δ, in length.

    Returns
    -------
    (p,) bool

    Raises
    ------
    InvalidParameterError
        If δ is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> points = np.array([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]])
    >>> es.stability.anchor_region(points, points[:1], 1.5)
    array([ True,  True, False])
    """
    positive_values(delta, "delta")
    return cKDTree(nodes).query(points)[0] <= delta


def witness_region(
    perturbation: Perturbation, points: SurfacePoints, nodes: Points, delta: float, *, rho: float
) -> Bool[np.ndarray, " _"]:
    """Say which points of N are in the witness region of an anchor region of M (thesis 4.2.1).

    The witness region R_N⁺(A) belongs to the anchor region R_M(A) of `anchor_region`. R_N is the
    region R_M(A), grown by ρδ. The witness region consists of Φ(R_N), outside the anomalous
    regions, and of all regions Y_i whose X_i meets R_N. Here R_N = {x in M: d(x, A) ≤ (ρ+1)δ}. It
    contains {x: d(x, R_M) ≤ ρδ} by the triangle inequality, equals it on a flat M, and lies in the
    same set with ρ + 1 in place of ρ. The statements of the thesis hold for it: it contains all
    points within ρδ of R_M along M, and Observation 4.2.2 (i) is exact.

    The proof of Observation 4.2.2 (ii), d(a, y) ≤ (ρ+2)δ, is valid outside the anomalous regions. A
    point y in Y_i lies in a ball of radius δ with some x of X_i for which d(a, x) ≤ (ρ+1)δ, so
    d(a, y) ≤ (ρ+3)δ, and no better bound holds in general.

    Parameters
    ----------
    perturbation : Perturbation
    points : SurfacePoints
        Points of N.
    nodes : (a, d) float
        The set A of nodes, in length.
    delta : float
        δ, in length.
    rho : float
        ρ, without unit; see `matching_reach`.

    Returns
    -------
    (q,) bool

    Raises
    ------
    InvalidParameterError
        If δ or ρ is not positive, or a point is in no simplex of N.

    See Also
    --------
    correspondence_graph : Join points by witness regions.

    Examples
    --------
    If nothing changed, these are the points within (ρ+1)δ of the nodes, here a cap of a sphere:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> same = es.stability.measure_perturbation(mesh, mesh)
    >>> points = es.geometry.sample_surface(mesh, 500, rng=np.random.default_rng(0))
    >>> node = mesh.vertices[:1]
    >>> inside = es.stability.witness_region(same, points, node, 0.3, rho=1.0)
    >>> distances = np.linalg.norm(points.points - node, axis=1)
    >>> bool((inside == (distances <= 0.6)).all())
    True
    """
    require_type(perturbation, Perturbation, "perturbation")
    require_type(points, SurfacePoints, "points")
    reach = (positive_number(rho, "rho") + 1) * positive_number(delta, "delta")
    labels, before = preimages(perturbation, points)
    inside = np.zeros(points.n_points, dtype=bool)
    inside[labels == OUTSIDE] = cKDTree(nodes).query(before)[0] <= reach
    met = np.any(regions_met(perturbation, nodes, reach), axis=0)
    inside[labels != OUTSIDE] = np.take(met, labels[labels != OUTSIDE])
    return inside


def preimages(
    perturbation: Perturbation, points: SurfacePoints
) -> tuple[Int[np.ndarray, " q"], Float[np.ndarray, "k d"]]:
    """Return the region of each point of N, and Φ⁻¹ of the points outside the regions.

    Φ⁻¹ keeps the barycentric coordinates and takes the corresponding simplex.

    Raise InvalidParameterError if a point is in no simplex of N.
    """
    n = len(perturbation.regions_two)
    wrong = np.flatnonzero((points.simplices < 0) | (points.simplices >= n))
    if wrong.size:
        raise InvalidParameterError(
            f"Points must lie on the second shape, in its simplices 0..{n - 1}; "
            f"point {wrong[0]} is in {points.simplices[wrong[0]]}."
        )
    labels = perturbation.regions_two[points.simplices]
    counterpart = np.full(n, OUTSIDE)
    counterpart[perturbation.outside_two] = perturbation.outside_one
    outside = labels == OUTSIDE
    before = place_points(
        perturbation.one, counterpart[points.simplices[outside]], points.weights[outside]
    )
    return labels, before.points


def regions_met(perturbation: Perturbation, nodes: Points, reach: float) -> Bool[np.ndarray, "_ r"]:
    """Say, for each node, which regions X_i have a point within reach.

    A corner within reach is sufficient. The squared distance of a node to a simplex is less than
    that to its nearest corner by at most the squared length of its longest edge, so the distance to
    simplices is computed for few nodes.
    """
    mesh, found = perturbation.one, np.empty((len(nodes), perturbation.n_regions), dtype=bool)
    for region in range(perturbation.n_regions):
        simplices = mesh.simplices[perturbation.regions_one == region]
        some, scale = size_one(mesh.points[simplices])
        within = reach / scale
        farthest = np.hypot(within, np.linalg.norm(some - some[:, :1], axis=2).max())
        corners = cKDTree(mesh.points[np.unique(simplices)] / scale)
        away = corners.query(nodes / scale, distance_upper_bound=farthest * (1 + SLACK))[0]
        found[:, region] = away <= within
        unsure = np.flatnonzero(~found[:, region] & np.isfinite(away))
        for node, point in zip(unsure, nodes[unsure] / scale, strict=True):
            near = some[(np.linalg.norm(some - point, axis=2) <= farthest).any(axis=1)]
            least = squared_distances(point[None], near).min(initial=np.inf)
            found[node, region] = least <= within**2
    return found


def squared_distances(
    points: Float[np.ndarray, "p d"], corners: Float[np.ndarray, "s corners d"]
) -> Float[np.ndarray, "p s"]:
    """Return the squared distance of each point to each simplex, in length².

    The nearest point of a simplex lies in the interior of one of its sides: the simplex itself, a
    facet, and so on down to a corner. There it is the foot of the perpendicular to the flat of that
    side. So the least distance over all sides that contain their foot is returned.
    """
    least = np.full((len(points), len(corners)), np.inf)
    numbers = range(corners.shape[1])
    for size in range(1, corners.shape[1] + 1):
        for side in combinations(numbers, size):
            origin, others = corners[:, side[0]], corners[:, side[1:]]
            sides, ways = others - origin[:, None], points[:, None] - origin
            weights = np.einsum("sda,psd->psa", np.linalg.pinv(sides), ways)
            inside = (weights >= 0).all(axis=2) & (weights.sum(axis=2) <= 1)
            left = ways - np.einsum("psa,sad->psd", weights, sides)
            squares = np.where(inside, np.einsum("psd,psd->ps", left, left), np.inf)
            np.minimum(least, squares, out=least)
    return least
