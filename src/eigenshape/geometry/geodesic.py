"""Geodesic distances between all vertices that lie near each other on a triangle mesh."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from eigenshape._arrays import positive_values, whole_numbers
from eigenshape._errors import InvalidShapeError
from eigenshape._typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.geodesic_loops import balls
from eigenshape.geometry.simplices import in_length, scaled_corners
from eigenshape.geometry.simplicial import Mesh

SOURCES = 256  # a task


def geodesic_balls(mesh: MeshLike, radius: float) -> sp.csr_array:
    """Measure along the surface from each vertex to all vertices within a radius.

    Waves leave each vertex as in Dijkstra's algorithm, and cross each triangle as if what lies behind were flat: the
    source is laid into the triangle's plane by the distances of two corners (Novotni and Klein 2002). Exact on flat
    regions; the shorter of the two directions counts, so that the result is symmetric.

    Parameters
    ----------
    mesh : MeshLike
        Of dimension 2, in any R^d.
    radius : float
        In length.

    Returns
    -------
    (n, n) sparse
        Distances, in length, between different vertices; symmetric, columns ascending.

    Raises
    ------
    InvalidShapeError
        If the mesh is no surface.
    InvalidParameterError
        If the radius is not positive.
    """
    mesh = as_simplicial(mesh)
    _require_surface(mesh)
    positive_values(radius, "radius")
    corners, scale = scaled_corners(mesh)
    starts, others, sides = _fans(mesh, corners)
    firsts = range(0, mesh.n_points, SOURCES)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        sources = [np.arange(first, min(first + SOURCES, mesh.n_points)) for first in firsts]
        waves = pool.map(
            lambda some: balls(
                starts, *others, sides, radius / scale, some, np.arange(len(some) + 1)
            ),
            sources,
        )
        counts, columns, values = (np.concatenate(parts) for parts in zip(*waves, strict=True))
    rows = np.concatenate([[0], np.cumsum(counts)])
    found = sp.csr_array((in_length(values, scale, 1), columns, rows), shape=(mesh.n_points,) * 2)
    found.sort_indices()
    return found.minimum(found.T)  # what one direction alone reached counts as out of reach


def geodesic_distances(mesh: MeshLike, sources: ArrayLike) -> Float[np.ndarray, "k n"]:
    """Measure along the surface from some vertices to all others.

    As `geodesic_balls`, without limit, and in one direction: from the sources.

    Parameters
    ----------
    mesh : MeshLike
        Of dimension 2, in any R^d.
    sources : (k,) int
        Vertices.

    Returns
    -------
    (k, n) float
        In length; infinite from one component to another.

    Raises
    ------
    InvalidShapeError
        If the mesh is no surface.
    InvalidParameterError
        If a source is no vertex.
    """
    mesh = as_simplicial(mesh)
    wave = waves_on(mesh)
    wanted = whole_numbers(sources, "A source", 0, mesh.n_points - 1)
    return np.array([wave(source) for source in wanted]).reshape(-1, mesh.n_points)


def geodesic_distance_to_set(
    mesh: MeshLike, sources: ArrayLike, *, reach: float = np.inf
) -> Float[np.ndarray, " n"]:
    """Measure along the surface from each vertex to the nearest of some; one wave leaves all of them at once.

    As `geodesic_distances`; an edge between two of them is a source all along.

    Parameters
    ----------
    mesh : MeshLike
        Of dimension 2, in any R^d.
    sources : (k,) int
        Vertices.
    reach : float
        Length up to which distances are wanted; shorter ones are quicker.

    Returns
    -------
    (n,) float
        In length; infinite beyond `reach`, and where there is none on the same component.

    Raises
    ------
    InvalidShapeError
        If the mesh is no surface.
    InvalidParameterError
        If a source is no vertex.
    """
    mesh = as_simplicial(mesh)
    wave = waves_on(mesh)
    return wave(np.unique(whole_numbers(sources, "A source", 0, mesh.n_points - 1)), reach)


def waves_on(mesh: Mesh) -> Callable[..., Float[np.ndarray, " n"]]:
    """Return a function from one vertex or some, and a length, to all vertices' distances, infinite beyond it."""
    _require_surface(mesh)
    corners, scale = scaled_corners(mesh)
    starts, others, sides = _fans(mesh, corners)

    def wave(source: ArrayLike, reach: float = np.inf) -> Float[np.ndarray, " n"]:
        found = np.full(mesh.n_points, np.inf)
        sources = np.atleast_1d(np.asarray(source, dtype=np.int64))
        _, reached, values = balls(
            starts, *others, sides, reach / scale, sources, np.array([0, len(sources)])
        )
        found[reached] = in_length(values, scale, 1)
        return found

    return wave


def farthest_points(
    mesh: MeshLike, count: int, *, reach: float = np.inf
) -> tuple[Int[np.ndarray, " c"], Float[np.ndarray, "c n"], Int[np.ndarray, " n"]]:
    """Choose vertices of a surface, each as far along it from those before as can be (Eldar and others 1997).

    The first is the one farthest from vertex 0; another piece is farther than all else.

    Parameters
    ----------
    mesh : MeshLike
    count : int
    reach : float
        Length up to which distances are wanted; shorter ones are quicker.

    Returns
    -------
    chosen : (c,) int
        Vertices.
    distances : (c, n) float
        From each to all vertices, in length; infinite from one piece to another, and perhaps beyond `reach`.
    nearest : (n,) int
        For each vertex the number of the nearest.
    """
    mesh = as_simplicial(mesh)
    wave, n = waves_on(mesh), mesh.n_points
    chosen, rows = np.empty(count, dtype=np.int64), np.empty((count, n))
    least, nearest = np.full(n, np.inf), np.zeros(n, dtype=np.int64)
    first = int(wave(0).argmax())
    for number, (vertex, row) in enumerate(
        islice(farthest_first(wave, n, first, reach=reach), count)
    ):
        chosen[number], rows[number] = vertex, row
        nearer = row < least
        least[nearer], nearest[nearer] = row[nearer], number
    return chosen, rows, nearest


def farthest_first(
    wave: Callable[..., Float[np.ndarray, " n"]], n: int, first: int, *, reach: float = 0.0
) -> Iterator[tuple[int, Float[np.ndarray, " n"]]]:
    """Go through n vertices by the waves of their surface, each as far from those before as can be, without end.

    With each come the distances from it, as those of `farthest_points`; at least those below what they were before.
    """
    least, following = np.full(n, np.inf), first
    while True:
        row = wave(following, max(reach, least.max()))
        yield following, row
        np.minimum(least, row, out=least)
        following = int(least.argmax())


def _require_surface(mesh: Mesh) -> None:
    if mesh.dim != 2:
        raise InvalidShapeError(
            f"Geodesic distances are measured on surfaces; this mesh has dimension {mesh.dim}."
        )


def _fans(
    mesh: Mesh, corners: Float[np.ndarray, "f 3 d"]
) -> tuple[
    Int[np.ndarray, " n1"],
    tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]],
    Float[np.ndarray, "k 3"],
]:
    """List at each vertex its triangles by their other two corners, with the lengths to these and between them."""
    turns = [np.roll(np.arange(3), -turn) for turn in range(3)]
    triples = np.concatenate([mesh.simplices[:, turn] for turn in turns])
    lengths = np.concatenate([_lengths(corners[:, turn]) for turn in turns])
    order = np.argsort(triples[:, 0], kind="stable")
    starts = np.searchsorted(triples[order, 0], np.arange(mesh.n_points + 1))
    one, two = (np.ascontiguousarray(triples[order, place]) for place in (1, 2))
    return starts, (one, two), lengths[order]


def _lengths(corners: Float[np.ndarray, "f 3 d"]) -> Float[np.ndarray, "f 3"]:
    a, b, c = corners.transpose(1, 0, 2)
    return np.column_stack([np.linalg.norm(side, axis=1) for side in (b - a, c - a, c - b)])
