"""Anchor-nodes spread over a shape, and the regions around them on it and on a changed shape (thesis 4.2.1)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree

from eigenshape._arguments import require_type
from eigenshape._arrays import frozen, positive_values, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.geodesic import farthest_first, waves_on
from eigenshape.geometry.simplex_distance import squared_distances
from eigenshape.geometry.simplices import size_one
from eigenshape.geometry.surface_points import SurfacePoints, place_points
from eigenshape.operators.crouzeix_raviart import longest_edges
from eigenshape.stability.perturbation import OUTSIDE, Perturbation

SLACK = 1e-12  # of a distance: more than its rounding
Points = Float[np.ndarray, "_ d"]


@dataclass(frozen=True, eq=False)
class AnchorNodes:
    """A (δ, δ)-sample of a surface, among its vertices.

    Attributes
    ----------
    vertices : (r,) int
        In the order in which they were chosen. Any two are at least δ apart along the surface.
    points : (r, d) float
        Where they lie, in length.
    reached : float
        Largest distance of a vertex to the nearest node, below δ, in length.
    cover : float
        Distance to the nearest node that no point of the surface exceeds, in length: `reached`, and at most 1/√3 of the
        longest edge from a point to a vertex. With short edges it is below δ too.
    """

    vertices: Int[np.ndarray, " r"]
    points: Float[np.ndarray, "r d"]
    reached: float
    cover: float


def anchor_nodes(mesh: MeshLike, delta: float, *, start: int = 0) -> AnchorNodes:
    """Choose anchor-nodes: at least δ apart, and none of the surface farther than δ from all (thesis 4.2.1).

    Vertices stand for the points of the surface. The one that is farthest from all before, along the surface, is the
    next, until it is less than δ away.

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
        If the mesh is no surface.
    InvalidParameterError
        If δ is not positive, or `start` no vertex.
    """
    mesh = as_simplicial(mesh)
    positive_values(delta, "delta")
    least, chosen = np.full(mesh.n_points, np.inf), []
    first = whole_number(start, "start", 0, mesh.n_points - 1)
    for vertex, row in farthest_first(waves_on(mesh), mesh.n_points, first):
        if least[vertex] < delta:
            break
        chosen.append(vertex)
        np.minimum(least, row, out=least)
    reached = float(least.max())
    return AnchorNodes(
        vertices=frozen(np.array(chosen)),
        points=frozen(mesh.points[chosen]),
        reached=reached,
        cover=reached + float(longest_edges(mesh).max()) / 3**0.5,
    )


def anchor_region(points: Points, nodes: Points, delta: float) -> Bool[np.ndarray, " _"]:
    """Say which points of M are in R_M(A), within Euclidean δ of a set of nodes (thesis 4.2.1).

    Parameters
    ----------
    points : (p, d) float
        Points of M, in length.
    nodes : (a, d) float
        The set A.
    delta : float
        δ, in length.

    Returns
    -------
    (p,) bool

    Raises
    ------
    InvalidParameterError
        If δ is not positive.
    """
    positive_values(delta, "delta")
    return _nearest(points, nodes) <= delta


def witness_region(
    perturbation: Perturbation, points: SurfacePoints, nodes: Points, delta: float, *, rho: float
) -> Bool[np.ndarray, " _"]:
    """Say which points of N are in R_N⁺(A), the region that witnesses for the anchor-region R_M(A) (thesis 4.2.1).

    R_M(A) grown by ρδ is R_N, a region of M. Taken to N it is Φ(R_N) outside the anomalous regions, and all of those
    Y_i whose X_i meets R_N. Here R_N is {x in M: d(x, A) ≤ (ρ+1)δ}, which holds {x: d(x, R_M) ≤ ρδ} by the triangle
    inequality, is the same on a flat M, and lies in the same with ρ + 1 for ρ. What the thesis proves of R_N holds for
    it: it has all within ρδ of R_M along M, and Observation 4.2.2 (i) is exact.

    Of Observation 4.2.2 (ii), d(a, y) ≤ (ρ+2)δ, the proof holds outside. A y in Y_i is in a ball of radius δ with some
    x of X_i for which d(a, x) ≤ (ρ+1)δ, so that d(a, y) ≤ (ρ+3)δ, and not less in general.

    Parameters
    ----------
    perturbation : Perturbation
    points : SurfacePoints
        Points of N.
    nodes : (a, d) float
        The set A.
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
        If δ or ρ is not positive, or a point lies in no simplex of N.
    """
    require_type(perturbation, Perturbation, "perturbation")
    require_type(points, SurfacePoints, "points")
    reach = (positive_values(rho, "rho")[0] + 1) * positive_values(delta, "delta")[0]
    labels, before = preimages(perturbation, points)
    inside = np.zeros(points.n_points, dtype=bool)
    inside[labels == OUTSIDE] = _nearest(before, nodes) <= reach
    met = np.any(regions_met(perturbation, nodes, reach), axis=0)
    inside[labels != OUTSIDE] = np.take(met, labels[labels != OUTSIDE])
    return inside


def preimages(
    perturbation: Perturbation, points: SurfacePoints
) -> tuple[Int[np.ndarray, " q"], Float[np.ndarray, "k d"]]:
    """Return the region of each point of N, and Φ⁻¹ of those outside: in the same place of the corresponding simplex.

    Raises
    ------
    InvalidParameterError
        If a point lies in no simplex of N.
    """
    n = len(perturbation.regions_two)
    wrong = np.flatnonzero((points.simplices < 0) | (points.simplices >= n))
    if wrong.size:
        raise InvalidParameterError(
            f"Points must lie on the second shape, in its simplices 0..{n - 1}; point {wrong[0]} is in "
            f"{points.simplices[wrong[0]]}."
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
    """Say which regions X_i have a point within reach of each node.

    A corner within reach says so. The squared distance to a simplex is at most the squared radius of a ball around it
    less than that to its nearest corner, so that few nodes are left to be told by the simplices.
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
            found[node, region] = (
                squared_distances(point[None], near).min(initial=np.inf) <= within**2
            )
    return found


def _nearest(points: Points, nodes: Points) -> Float[np.ndarray, " _"]:
    return cKDTree(nodes).query(points)[0]
