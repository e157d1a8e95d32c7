"""Simplices cut into smaller ones at the middles of their edges, in any dimension."""

from functools import lru_cache
from itertools import permutations
from typing import overload

import numpy as np
from jaxtyping import Int

from eigenshape._arrays import frozen
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
    """Split each simplex at the middles of its edges: a triangle in four, which face as it does, in general in 2^m.

    Nothing moves: it is the same shape with finer simplices.
    """
    mesh = as_simplicial(mesh)
    if isinstance(mesh, TriangleMesh):
        return _quartered(mesh)
    return halve_simplices(mesh)


def _quartered(mesh: TriangleMesh) -> TriangleMesh:
    table = edge_table(mesh)
    middles = mesh.vertices[table.edges].mean(axis=1)
    a, b, c = mesh.faces.T
    at_a, at_b, at_c = (table.face_edges + mesh.n_vertices).T
    quarters = [(a, at_c, at_b), (b, at_a, at_c), (c, at_b, at_a), (at_a, at_b, at_c)]
    faces = np.stack([np.column_stack(quarter) for quarter in quarters], axis=1).reshape(-1, 3)
    return TriangleMesh(np.concatenate([mesh.vertices, middles]), faces)


def halve_simplices(mesh: SimplicialMesh) -> SimplicialMesh:
    """Split each simplex in 2^m at the middles of its edges, so that neighbours match.

    The edgewise subdivision (Edelsbrunner and Grayson 2000), whose pieces have at most m!/2 shapes however often it is
    repeated. It takes the corners of each simplex in their order, if neighbours agree on it, and gives such an order to
    the pieces; otherwise it begins with the order of the points.
    """
    corners = mesh.simplices if _agree(mesh.simplices) else np.sort(mesh.simplices, axis=1)
    ends = np.sort(corners[:, pieces(mesh.dim)], axis=-1)
    simplices = ends[..., 0].copy()
    between = ends[..., 0] < ends[..., 1]
    edges, places = np.unique(ends[between], axis=0, return_inverse=True)
    simplices[between] = mesh.n_points + places
    points = np.concatenate([mesh.points, mesh.points[edges].mean(axis=1)])
    return SimplicialMesh(points, simplices.reshape(-1, mesh.dim + 1))


def _agree(simplices: Int[np.ndarray, "s corners"]) -> bool:
    """Say whether each edge has the same end first in all of its simplices."""
    edges = simplices[:, np.column_stack(np.triu_indices(simplices.shape[1], 1))].reshape(-1, 2)
    return len(np.unique(edges, axis=0)) == len(np.unique(np.sort(edges, axis=1), axis=0))


@lru_cache
def pieces(dim: int) -> Int[np.ndarray, "pieces corners 2"]:
    """Return the pieces of one simplex, each corner as the two corners of the whole that it lies midway between.

    In the simplex 2 ≥ x_1 ≥ ... ≥ x_m ≥ 0 these are Kuhn's simplices of the whole numbers: walks of unit steps.
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
    return frozen(np.stack([(places[inside] >= least).sum(axis=2) for least in (1, 2)], axis=-1))
