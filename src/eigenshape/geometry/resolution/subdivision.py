"""Subdivision of simplices at the midpoints of their edges, in any dimension."""

from functools import lru_cache
from itertools import permutations
from typing import overload

import numpy as np
from jaxtyping import Int

from certeig.kit.arrays import freeze
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh, SimplicialMesh
from eigenshape.geometry.topology import edge_table


@overload
def subdivide(mesh: TriangleMesh) -> TriangleMesh: ...
@overload
def subdivide(mesh: SimplicialMesh) -> SimplicialMesh: ...
@overload
def subdivide(mesh: MeshLike) -> Mesh: ...
def subdivide(mesh: MeshLike) -> Mesh:
    """Split each simplex at the midpoints of its edges into 2^m simplices.

    A triangle becomes four triangles with the same orientation, a tetrahedron eight tetrahedra. No
    point moves: the shape stays the same set of points.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension m.

    Returns
    -------
    TriangleMesh or SimplicialMesh
        The old points come first, in their order, then the midpoints.

    See Also
    --------
    icosphere : A subdivided icosahedron on the unit sphere.

    Notes
    -----
    Simplices that are not triangles in R³ are split by the edgewise subdivision (Edelsbrunner and
    Grayson 2000). Its pieces have at most m!/2 shapes however often it is repeated.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.subdivide(es.shapes.grid(1, 1))
    TriangleMesh(9 vertices, 8 faces)
    """
    mesh = as_simplicial(mesh)
    if isinstance(mesh, TriangleMesh):
        table = edge_table(mesh)
        middles = mesh.vertices[table.edges].mean(axis=1)
        a, b, c = mesh.faces.T
        at_a, at_b, at_c = (table.face_edges + mesh.n_vertices).T
        quarters = [(a, at_c, at_b), (b, at_a, at_c), (c, at_b, at_a), (at_a, at_b, at_c)]
        faces = np.stack([np.column_stack(quarter) for quarter in quarters], axis=1)
        return TriangleMesh(np.concatenate([mesh.vertices, middles]), faces.reshape(-1, 3))

    # The pieces depend on the order of the corners. If all simplices with an edge have its ends in
    # the same order, that order is used, and the pieces have such an order again; otherwise corners
    # are sorted by their points. So the pieces of neighbors match.
    corners = mesh.simplices
    edges = corners[:, np.column_stack(np.triu_indices(corners.shape[1], 1))].reshape(-1, 2)
    n_directed, n_edges = (len(np.unique(ends, axis=0)) for ends in (edges, np.sort(edges, axis=1)))
    if n_directed != n_edges:
        corners = np.sort(corners, axis=1)
    ends = np.sort(corners[:, pieces(mesh.dim)], axis=-1)
    simplices = ends[..., 0].copy()
    between = ends[..., 0] < ends[..., 1]
    edges, places = np.unique(ends[between], axis=0, return_inverse=True)
    simplices[between] = mesh.n_points + places
    points = np.concatenate([mesh.points, mesh.points[edges].mean(axis=1)])
    return SimplicialMesh(points, simplices.reshape(-1, mesh.dim + 1))


@lru_cache
def pieces(dim: int) -> Int[np.ndarray, "pieces corners 2"]:
    """Return the pieces of one simplex; each corner is the midpoint of two corners of the whole.

    In the simplex 2 ≥ x_1 ≥ ... ≥ x_m ≥ 0 these are Kuhn's simplices of the integer grid: walks of
    unit steps, one along each axis.
    """
    starts = np.tril(np.ones((dim + 1, dim), dtype=np.int64), -1)
    steps = np.array(
        [np.eye(dim, dtype=np.int64)[list(order)] for order in permutations(range(dim))]
    )
    walks = np.concatenate(
        [np.zeros((len(steps), 1, dim), dtype=np.int64), steps.cumsum(axis=1)], axis=1
    )
    places = (starts[:, None, None] + walks).reshape(-1, dim + 1, dim)
    inside = (np.diff(places, axis=2) <= 0).all(axis=(1, 2))
    return freeze(np.stack([(places[inside] >= least).sum(axis=2) for least in (1, 2)], axis=-1))
