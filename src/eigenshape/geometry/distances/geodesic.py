"""Geodesic distances on surfaces, their averages, and farthest points."""

from collections.abc import Callable
from itertools import chain
from typing import Any

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int, Int32

from certeig.kit.arrays import number_from_zero, positive_values, whole_number
from certeig.kit.threads import SpareMemory, map_in_threads, one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import source_points, source_sets
from eigenshape._corners import in_length, scaled_corners
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.conversion import MeshLike, as_mesh, as_simplicial
from eigenshape.geometry.distances.geodesic_loops import (
    choose_farthest,
    fill_rows,
    list_fans,
    spread_waves,
)
from eigenshape.geometry.requirements import require_describable, warn_of_seams
from eigenshape.geometry.samples.surface_points import SurfacePoints, require_on
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.simplicial import Mesh
from eigenshape.geometry.topology import vertex_components

# Sources of one task of the thread pool: enough that starting a task costs nothing beside it, few
# enough that all cores have work.
SOURCES_PER_TASK = 256
# Waves over all vertices of one task: each takes a millisecond for 5,000 vertices.
ROWS_PER_TASK = 8
# Waves over all vertices for which a task has room at a time.
WAVES_OF_ROOM = 2

# Base points of the sum over the surface: about as many as Hilaga and others (2001) take. Time and
# memory grow with this number.
N_BASES = 150
# Where the neighbors of each vertex start, these neighbors, and two lengths of each.
Fans = tuple[Int[np.ndarray, " n1"], Int32[np.ndarray, " k"], Float[np.ndarray, "k 2"]]
Wave = Callable[..., Float[np.ndarray, " n"]]
Rows = Callable[..., Float[np.ndarray, "k n"]]


def geodesic_balls(mesh: MeshLike, radius: float) -> sp.csr_array:
    """Compute the geodesic distances between all vertices within a radius of each other.

    Parameters
    ----------
    mesh : MeshLike
        A surface, in any R^d.
    radius : float
        Largest distance, in length.

    Returns
    -------
    (n, n) scipy.sparse.csr_array
        Distances between different vertices, in length; symmetric, with sorted columns.

    Raises
    ------
    InvalidShapeError
        If the mesh does not have dimension 2.
    InvalidParameterError
        If the radius is not positive and finite.

    See Also
    --------
    geodesic_distances : Distances from some vertices to all others.

    Notes
    -----
    Waves start at each vertex as in Dijkstra's algorithm. A wave crosses a triangle as if the
    surface behind it were flat: the source is placed in the plane of the triangle by the distances
    of two corners (Novotni and Klein 2002). The result is exact on flat regions. Of the distances
    in the two directions the smaller one is returned.

    Examples
    --------
    On a flat grid with unit squares, vertex 0 has two neighbors at distance 1 and one at √2.

    >>> import eigenshape as es
    >>> grid = es.shapes.grid(3, 3, width=3, height=3)
    >>> es.geometry.geodesic_balls(grid, 1.5)[[0]].data.round(4).tolist()
    [1.0, 1.0, 1.4142]
    """
    mesh = as_simplicial(mesh)
    (fans, scale), n = _fans(mesh), mesh.n_points
    positive_values(radius, "radius")

    def waves_from(first: int) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        sources = np.arange(first, min(first + SOURCES_PER_TASK, n))
        scratch, counts = _scratch(n), np.empty(len(sources), dtype=np.int64)
        # Room for the longest wave, and for many short ones in each call.
        reached, distances = (
            np.empty(WAVES_OF_ROOM * n, dtype=np.int64),
            np.empty(WAVES_OF_ROOM * n),
        )
        waves = []
        while len(sources):
            done = spread_waves(fans, radius / scale, sources, scratch, counts, reached, distances)
            total = counts[:done].sum()
            waves.append((counts[:done].copy(), reached[:total].copy(), distances[:total].copy()))
            sources = sources[done:]
        return waves

    tasks = map_in_threads(waves_from, range(0, n, SOURCES_PER_TASK))
    parts = zip(*chain.from_iterable(tasks), strict=True)
    counts, columns, distances = (np.concatenate(part) for part in parts)
    rows = np.append(0, np.cumsum(counts))
    found = sp.csr_array((in_length(distances, scale, 1), columns, rows), shape=(n, n))
    found.sort_indices()
    # An entry that only one direction has is 0 in the other, and the minimum removes it.
    return found.minimum(found.T)


def geodesic_distances(
    mesh: MeshLike, sources: ArrayLike | SurfacePoints, *, reach: float = np.inf
) -> Float[np.ndarray, "k n"]:
    """Compute the geodesic distances from some vertices, sets of vertices, or points, to all vertices.

    The method is that of `geodesic_balls`, in the direction from the sources only. From a set of
    vertices one wave starts at all of them at once; an edge between two of them is a source along
    its whole length.

    Parameters
    ----------
    mesh : MeshLike
        A surface, in any R^d.
    sources : (k,) int, k lists of int, or SurfacePoints
        Vertices, or points inside faces. The distance from a list of vertices is that to the nearest
        of them.
    reach : float
        Largest distance that is needed, in length. A smaller reach takes less time.

    Returns
    -------
    (k, n) float
        Distance from each source to each vertex, in length; infinite between components, and
        beyond `reach`.

    Raises
    ------
    InvalidShapeError
        If the mesh does not have dimension 2.
    InvalidParameterError
        If a source is not a vertex or a point of this mesh, or the reach is negative or no number.

    See Also
    --------
    geodesic_balls : Distances between all near vertices.
    geodesic_waves : Distances from many sources, one after the other.

    Examples
    --------
    From the first vertex of a grid, and from its left side:

    >>> import eigenshape as es
    >>> grid = es.shapes.grid(2, 2, width=2, height=2)
    >>> es.geometry.geodesic_distances(grid, [0]).round(4).tolist()
    [[0.0, 1.0, 2.0, 1.0, 1.4142, 2.2361, 2.0, 2.2361, 2.8284]]
    >>> es.geometry.geodesic_distances(grid, [[0, 1, 2]]).round(6).tolist()
    [[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0]]

    From a point inside a face:

    >>> place = es.geometry.closest_points(grid, [[0.5, 0.25, 0]])
    >>> es.geometry.geodesic_distances(grid, place).round(4)[0, :3].tolist()
    [0.559, 0.9014, 1.82]
    """
    mesh = as_simplicial(mesh)
    warn_of_seams(mesh)
    rows_of, radius = unchecked_rows(mesh), number_from_zero(reach, "reach")
    if isinstance(sources, SurfacePoints):
        require_on(mesh, sources, "sources")
        pairs = zip(sources.points, sources.simplices, strict=True)
        return np.stack([_distances_from(mesh, rows_of, *pair, radius) for pair in pairs])
    wanted = source_sets(sources, mesh.n_points)
    ends = np.cumsum([len(source) for source in wanted], dtype=np.int64)
    flat = np.concatenate([*wanted, np.empty(0, dtype=np.int64)])
    return rows_of(flat, ends, radius)


def _distances_from(
    mesh: Mesh, rows_of: Rows, place: Float[np.ndarray, " d"], simplex: Integer, reach: float
) -> Float[np.ndarray, " n"]:
    """Return the distances from a point of a face, of those from its corners.

    The plane of the face is laid out beyond each side, as far as the other point, which two corners
    place there: the rule by which waves cross triangles.
    """
    corners = mesh.simplices[simplex]
    spots = mesh.points[corners]
    spokes = np.linalg.norm(spots - place, axis=1)
    rows = rows_of(corners, np.arange(1, 4), reach + spokes.max())
    found = (rows + spokes[:, None]).min(axis=0)
    for one, two in ((0, 1), (1, 2), (2, 0)):
        side = np.linalg.norm(spots[[two]] - spots[one], axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):  # infinite distances place nothing
            along, beyond = _place(np.repeat(side, mesh.n_points), rows[one], rows[two])
            own, above = _place(side, spokes[[one]], spokes[[two]])
            crossing = along + (own - along) * beyond / (beyond + above)
            straight = np.hypot(own - along, above + beyond)
            is_nearer = (crossing >= 0) & (crossing <= side) & (straight < found)
        found = np.where(is_nearer, straight, found)
    return np.where(found <= reach, found, np.inf)


def geodesic_waves(mesh: MeshLike) -> Wave:
    """Return a function that computes geodesic distances on one mesh, many times.

    What `geodesic_distances` prepares at each call is prepared once. On 25,000 vertices that
    takes 60 ms, and a disc of a thousand vertices then takes less than 1 ms.

    Parameters
    ----------
    mesh : MeshLike
        A surface, in any R^d.

    Returns
    -------
    callable
        Called as ``wave(sources, reach)`` with one or several vertices and the largest distance
        that is needed, in length. Returns the distance of each vertex to the nearest source, (n,),
        infinite beyond the reach. Raises an InvalidParameterError if a source is not a vertex, or
        the reach is negative or no number.

    Raises
    ------
    InvalidShapeError
        If the mesh does not have dimension 2.

    See Also
    --------
    geodesic_distances : Distances from some sources, once.

    Examples
    --------
    >>> import eigenshape as es
    >>> wave = es.geometry.geodesic_waves(es.shapes.grid(2, 2, width=2, height=2))
    >>> wave(0, 1.0).tolist()
    [0.0, 1.0, inf, 1.0, inf, inf, inf, inf, inf]
    """
    mesh = as_simplicial(mesh)
    warn_of_seams(mesh)
    wave, n = unchecked_waves(mesh), mesh.n_points

    def checked_wave(source: ArrayLike, reach: float = np.inf) -> Float[np.ndarray, " n"]:
        return wave(source_points(source, n), number_from_zero(reach, "reach"))

    return checked_wave


def unchecked_waves(mesh: Mesh) -> Wave:
    """Return what `geodesic_waves` does, for arrays of vertices that ascend, and a reach from zero on.

    The checks of these cost as much as a short wave.
    """
    rows_of = unchecked_rows(mesh)

    def wave(sources: Int[np.ndarray, " s"], reach: float = np.inf) -> Float[np.ndarray, " n"]:
        return rows_of(sources, np.array([len(sources)]), reach)[0]

    return wave


def unchecked_rows(mesh: Mesh) -> Rows:
    """Return a function of sources, the ends of sets of these, and a reach from zero on.

    It returns the distances of all vertices from each set, whose vertices ascend.
    """
    (fans, scale), n = _fans(mesh), mesh.n_points
    # A wave leaves its scratch as it was, so that the next one need not fill it.
    memory = SpareMemory(lambda: (_scratch(n), np.empty(n, dtype=np.int64), np.empty(n)))

    def rows_of(
        sources: Int[np.ndarray, " s"], ends: Int[np.ndarray, " k"], reach: float = np.inf
    ) -> Float[np.ndarray, "k n"]:
        rows, begin = np.empty((len(ends), n)), np.append(0, ends)

        def fill_task(first: int) -> None:
            some = slice(first, first + ROWS_PER_TASK)
            own, own_ends = sources[begin[first] :], ends[some] - begin[first]
            with memory.lend() as scratch:
                fill_rows(fans, reach / scale, own, own_ends, *scratch, rows[some])
            rows[some] = in_length(rows[some], scale, 1)

        map_in_threads(fill_task, range(0, len(ends), ROWS_PER_TASK))
        return rows

    return rows_of


def farthest_points(
    mesh: MeshLike, count: Integer, *, reach: float = np.inf
) -> tuple[Int[np.ndarray, " c"], Float[np.ndarray, "c n"], Int[np.ndarray, " n"]]:
    """Choose vertices of a surface, each as far as possible from those chosen before.

    The first is the vertex farthest from vertex 0 (Eldar and others 1997). A component without a
    chosen vertex is farther than everything else.

    Parameters
    ----------
    mesh : MeshLike
        A surface, in any R^d.
    count : int
        Number c of vertices to choose, at most n.
    reach : float
        Largest distance that is needed in `distances`, in length. A smaller reach takes less time.

    Returns
    -------
    chosen : (c,) int
        Vertices, in the order in which they were chosen.
    distances : (c, n) float
        Geodesic distance from each of them to all vertices, in length; infinite between
        components, and possibly beyond `reach`.
    nearest : (n,) int
        For each vertex, the position in `chosen` of the nearest chosen vertex; 0 in a component
        that has none.

    Raises
    ------
    InvalidParameterError
        If count is not in 1..n, or the reach is negative or no number.
    InvalidShapeError
        If the mesh does not have dimension 2.

    See Also
    --------
    geodesic_distances : Distances from given vertices.

    Examples
    --------
    >>> import eigenshape as es
    >>> strip = es.shapes.grid(4, 1, width=4, height=0.1)
    >>> chosen, _, nearest = es.geometry.farthest_points(strip, 2)
    >>> strip.vertices[chosen, 0].tolist()
    [4.0, 0.0]
    """
    mesh = as_simplicial(mesh)
    (fans, scale), n = _fans(mesh), mesh.n_points
    count = whole_number(count, "count", 1, n)
    chosen, nearest, least = np.empty(count, np.int64), np.empty(n, np.int64), np.empty(n)
    # Each choice waits for the wave before it. So where all distances are wanted, waves that only
    # reach what they come nearest to make the choices, and long ones follow, side by side. The short
    # ones add about a fiftieth.
    everywhere = bool(np.isinf(number_from_zero(reach, "reach")))
    rows = np.empty((0 if everywhere else count, n))
    scratch = _scratch(n), np.empty(n, dtype=np.int64), np.empty(n)
    radius = 0.0 if everywhere else reach / scale
    choose_farthest(fans, radius, *scratch, chosen, least, nearest, rows)
    if everywhere:
        return chosen, unchecked_rows(mesh)(chosen, np.arange(1, count + 1)), nearest
    for row in rows:
        row[:] = in_length(row, scale, 1)
    return chosen, rows, nearest


@one_blas_thread()
def average_geodesic_distance(
    mesh: MeshLike, *, n_bases: Integer = N_BASES
) -> Float[np.ndarray, " n"]:
    """Compute the mean geodesic distance from each vertex to all points of the surface.

    The mean a(x) = ∫ g(x, y) dy / area is approximated by Σ_b g(x, b) A_b / area over base points
    b, where A_b is the area of the vertices whose nearest base point is b [1]_. The base points are
    farthest points; the first is the vertex farthest from vertex 0. If every vertex is a base
    point, the sum runs over all vertices of the mesh.

    Parameters
    ----------
    mesh : MeshLike
        A connected surface.
    n_bases : int
        Number of base points, at least 1; at most n are used. Each base point costs one geodesic
        wave over the whole mesh.

    Returns
    -------
    (n,) float
        Mean distance of each vertex, in length.

    Raises
    ------
    InvalidShapeError
        If the mesh has several components, a vertex without a face, or a face twice.
    InvalidParameterError
        If `n_bases` is less than 1.

    See Also
    --------
    geodesic_distances : Distances from given vertices.
    farthest_points : The choice of base points.

    Notes
    -----
    Hilaga and others leave out the division by the area. Section 5.4 of the thesis compares the
    maxima of this function as feature points.

    References
    ----------
    .. [1] M. Hilaga, Y. Shinagawa, T. Kohmura and T. L. Kunii, "Topology matching for fully
       automatic similarity estimation of 3D shapes", SIGGRAPH 2001.

    Examples
    --------
    On the unit sphere the mean distance is π/2 at every point.

    >>> import eigenshape as es
    >>> distances = es.geometry.average_geodesic_distance(es.icosphere(3))
    >>> bool(abs(distances - 3.14159 / 2).max() < 0.02)
    True
    """
    mesh = as_mesh(mesh)
    count = min(whole_number(n_bases, "n_bases", 1), mesh.n_vertices)
    require_describable(mesh)
    n_components, _ = vertex_components(mesh)
    if n_components > 1:
        raise InvalidShapeError(
            "A mesh must be connected to have average distances; "
            f"this one has {n_components} components. "
            'Try repair(mesh, ["largest_component"]).'
        )
    _, distances, nearest = farthest_points(mesh, count)
    areas = dual_volumes(mesh)
    shares = np.bincount(nearest, weights=areas / areas.sum(), minlength=count)
    return shares @ distances


def _scratch(n: int) -> Any:
    """Return the memory that a wave over n vertices needs while it runs."""
    senders, places, heap = np.empty((3, n), dtype=np.int64)
    return np.full(n, np.inf), np.zeros(n, dtype=np.bool_), senders, places, np.empty(n), heap


def _fans(mesh: Mesh) -> tuple[Fans, float]:
    """List the neighbors around each vertex, as the kernels take them, and the scale of lengths.

    That a wave computes the places of corners from lengths anew takes less time than to read them.
    """
    if mesh.dim != 2:
        raise InvalidShapeError(
            f"Geodesic distances need a mesh of dimension 2; this one has dimension {mesh.dim}."
        )
    corners, scale = scaled_corners(mesh)
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    n, n_corners = mesh.n_points, mesh.simplices.size
    # Two neighbors a triangle, if each vertex has triangles that share no edge; else about one
    fans = (
        np.empty(n + 1, dtype=np.int64),
        np.empty(2 * n_corners, dtype=np.int32),
        np.empty((2 * n_corners, 2)),
    )
    by_vertex, later = np.empty((2, n_corners), dtype=np.int64)
    listing = by_vertex, np.empty(n + 1, dtype=np.int64), later, np.full(n, -1), np.zeros(n, int)
    list_fans(mesh.simplices, sides, listing, fans)
    return fans, scale


def _place(
    edge: Float[np.ndarray, " f"], left: Float[np.ndarray, " f"], right: Float[np.ndarray, " f"]
) -> tuple[Float[np.ndarray, " f"], Float[np.ndarray, " f"]]:
    """Return where the third corners of triangles are, along an edge and away from it.

    `left` and `right` are the distances of the corner from the first and the other end of the edge.
    Where an edge has no length, no wave passes through it, and the place is not used.
    """
    length = np.where(edge > 0, edge, 1)
    along = (left * left - right * right + edge * edge) / (2 * length)
    return along, np.sqrt(np.maximum(left * left - along * along, 0))
