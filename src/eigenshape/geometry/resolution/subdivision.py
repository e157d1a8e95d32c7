"""Subdivision of simplices at the midpoints of their edges, in any dimension."""

from functools import lru_cache
from itertools import permutations
from typing import overload

import numpy as np
from jaxtyping import Int

from certeig.kit.arrays import freeze
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.measure import edge_lengths
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
        quarters = _quarters(mesh.faces, table.face_edges + mesh.n_vertices)
        faces = np.stack(quarters, axis=1)
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


def split_long_edges(
    mesh: TriangleMesh, length: float, most: int
) -> tuple[TriangleMesh, Int[np.ndarray, " m"]]:
    """Split edges at their midpoints until none is longer than a length. No point moves.

    A face becomes four triangles, or two where one of its sides is split. A round that would leave more
    than `most` vertices is left out.

    Returns the mesh, the old points first, and for each of its vertices a near one of the given mesh.
    """
    origins = np.arange(mesh.n_vertices)
    while True:
        table = edge_table(mesh)
        sides = table.face_edges
        is_split = edge_lengths(mesh) > length
        # Two sides of a face could be joined in two ways, so the third is split, too.
        while len(undecided := np.flatnonzero(is_split[sides].sum(axis=1) == 2)):
            is_split[sides[undecided]] = True
        ends = table.edges[is_split]
        if not len(ends) or mesh.n_vertices + len(ends) > most:
            return mesh, origins
        numbers = np.full(len(is_split), -1)
        numbers[is_split] = mesh.n_vertices + np.arange(len(ends))
        middles = numbers[sides]
        n_split = is_split[sides].sum(axis=1)
        whole, quartered = n_split == 0, n_split == 3
        faces = [mesh.faces[whole], *_quarters(mesh.faces[quartered], middles[quartered])]
        halved = np.flatnonzero(n_split == 1)
        first = middles[halved].argmax(axis=1)  # the corner that faces the split side
        a, b, c = (mesh.faces[halved, (first + step) % 3] for step in range(3))
        middle = middles[halved].max(axis=1)
        faces += [np.column_stack([a, b, middle]), np.column_stack([a, middle, c])]
        points = [mesh.vertices, mesh.vertices[ends].mean(axis=1)]
        mesh = TriangleMesh(np.concatenate(points), np.concatenate(faces))
        origins = np.append(origins, origins[ends[:, 0]])


def _quarters(
    faces: Int[np.ndarray, "f 3"], middles: Int[np.ndarray, "f 3"]
) -> list[Int[np.ndarray, "f 3"]]:
    """Return the quarters of faces at their corners, and those between, given the midpoint opposite each corner."""
    (a, b, c), (at_a, at_b, at_c) = faces.T, middles.T
    corners = [(a, at_c, at_b), (b, at_a, at_c), (c, at_b, at_a), (at_a, at_b, at_c)]
    return [np.column_stack(quarter) for quarter in corners]


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
