"""The facets of a mesh, its simplices' sides of one dimension less, and what holds together through them."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int
from scipy.sparse.csgraph import connected_components

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import size_one
from eigenshape.geometry.simplicial import Mesh, SimplicialMesh


@dataclass(frozen=True, eq=False)
class FacetTable:
    """The facets of a mesh once each: edges of triangles, triangles of tetrahedra, ends of segments.

    Attributes
    ----------
    facets : (q, m) int
        Corners of each facet, ascending, and the facets in the order of their corners.
    simplex_facets : (s, m+1) int
        Facet of each simplex opposite to its corner 0, 1, ..., m.
    n_simplices : (q,) int
        Simplices at each facet: 1 on a boundary, 2 inside, more where the mesh is not a manifold.
    """

    facets: Int[np.ndarray, "q m"]
    simplex_facets: Int[np.ndarray, "s corners"]
    n_simplices: Int[np.ndarray, " q"]

    @property
    def boundary(self) -> Int[np.ndarray, " b"]:
        """The facets that one simplex alone has, ascending."""
        return np.flatnonzero(self.n_simplices == 1)


def facet_table(mesh: MeshLike) -> FacetTable:
    """List the facets of the mesh once each, with the simplices' way to them."""
    mesh = as_simplicial(mesh)
    named = mesh.simplices[np.arange(len(mesh.simplices))[:, None, None], _corners_of_facets(mesh)]
    facets, inverse, counts = np.unique(
        named.reshape(-1, mesh.dim), axis=0, return_inverse=True, return_counts=True
    )
    return FacetTable(facets, inverse.reshape(mesh.simplices.shape), counts)


def boundary_surface(mesh: MeshLike) -> TriangleMesh:
    """Return the surface around tetrahedra in R³: the triangles that one tetrahedron alone has, turned outward.

    Points inside are left out; the others keep their order.

    Raises
    ------
    InvalidShapeError
        If the mesh is not one of tetrahedra in R³.
    """
    solid = as_simplicial(mesh)
    if (solid.dim, solid.points.shape[1]) != (3, 3):
        raise InvalidShapeError(
            f"Only tetrahedra in R^3 have a surface around them; the mesh is a {solid!r}."
        )
    table = facet_table(solid)
    owner, apex = np.nonzero(table.n_simplices[table.simplex_facets] == 1)
    triangles = table.facets[table.simplex_facets[owner, apex]]
    points, _ = size_one(solid.points)
    a, b, c = (points[corner] for corner in triangles.T)
    inside = points[solid.simplices[owner, apex]]
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), inside - a) > 0
    triangles[inward] = triangles[inward][:, ::-1]
    used, renumbered = np.unique(triangles, return_inverse=True)
    return TriangleMesh(solid.points[used], renumbered.reshape(-1, 3))


def _corners_of_facets(mesh: Mesh) -> Int[np.ndarray, "s corners m"]:
    """Return which corners of each simplex lie opposite to each of its corners, in the order of their points."""
    corners = np.arange(mesh.dim + 1)
    others = np.array([np.delete(corners, corner) for corner in corners])
    order = np.argsort(mesh.simplices[:, others], axis=2)
    return np.take_along_axis(np.broadcast_to(others, order.shape), order, axis=2)


def _neighbours(table: FacetTable) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]]:
    """Return sides that lie on one facet, by pairs that chain all of its sides; side (m+1)·s + a is facet a of s."""
    at = table.simplex_facets.ravel()
    order = np.argsort(at, kind="stable")
    same = at[order][1:] == at[order][:-1]
    return order[:-1][same], order[1:][same]


def facet_components(table: FacetTable) -> tuple[int, Int[np.ndarray, " s"]]:
    """Count the parts that facets hold together, and number each simplex with its own.

    Parts that touch in less than a facet, as two triangles in a point, are two: no heat flows through there.
    """
    n, corners = table.simplex_facets.shape
    one, two = (side // corners for side in _neighbours(table))
    return _components(n, one, two)


def without_pinches(mesh: Mesh) -> SimplicialMesh:
    """Give each point a copy for every group of its simplices that facets at the point hold together.

    Continuous functions on the new mesh are continuous across facets of the old one, and may jump where simplices touch
    in less than a facet. The simplices keep their order, copies stand where their point did, and loose points go.
    """
    corners, table = _corners_of_facets(mesh), facet_table(mesh)
    n, n_corners = mesh.simplices.shape
    ids = (np.arange(n)[:, None, None] * n_corners + corners).reshape(-1, mesh.dim)
    one, two = _neighbours(table)
    count, fans = _components(n * n_corners, ids[one].ravel(), ids[two].ravel())
    points = np.empty(count, dtype=np.int64)
    points[fans] = mesh.simplices.ravel()
    order = np.argsort(points, kind="stable")
    places = np.empty(count, dtype=np.int64)
    places[order] = np.arange(count)
    return SimplicialMesh(mesh.points[points[order]], places[fans].reshape(n, n_corners))


def _components(
    n: int, one: Int[np.ndarray, " k"], two: Int[np.ndarray, " k"]
) -> tuple[int, Int[np.ndarray, " n"]]:
    graph = sp.coo_array((np.ones(len(one), dtype=np.int8), (one, two)), shape=(n, n))
    count, labels = connected_components(graph, directed=False)
    return int(count), labels.astype(np.int64)
