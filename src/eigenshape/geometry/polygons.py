"""Polygons of any number of corners, cut into triangles."""

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.polygon_loops import clip_ears

# Points nearer than this to a line lie on it, up to rounding of their coordinates, which have size 1.
ROUNDING = 64 * 2.0**-52
# A fan is taken if each of its triangles has more than this share of its longest side squared as
# area. Corners on a line have 1e-7 in single precision, a regular polygon of 1,000 corners 8e-4.
THINNEST = 1e-6
BLOCK = 20_000  # corners at once, so that they stay in the cache
FULL_TURN = 2 * np.pi + 1e-9  # radians, with rounding


def triangulate_polygons(
    points: Float[np.ndarray, "n d"], starts: Int[np.ndarray, " p1"], corners: Int[np.ndarray, " k"]
) -> tuple[Int[np.ndarray, "t 3"], Int[np.ndarray, " t"]]:
    """Cut polygons into triangles, which are turned as the polygons are.

    A polygon may be convex or not, flat or not. A hole is joined to the outline by a bridge, a side
    that goes there and back. A polygon of c corners becomes c - 2 triangles, which use all of them:
    the fan around its first corner, if no triangle of it lies outside; otherwise the corners with
    the best-shaped triangles are cut off one by one (ear clipping, Meisters 1975). What lies outside
    is decided in the plane across the mean normal (Newell's).

    Polygons on a line, those with a corner that is not finite or not a point, and those in other
    dimensions than 2 and 3 become fans.

    Raise InvalidShapeError if a polygon crosses itself, or folds back so that it has no area.

    Parameters
    ----------
    points : (n, d) float
        In length.
    starts : (p + 1,) int
        Polygon i has the corners ``corners[starts[i] : starts[i + 1]]``.
    corners : (k,) int
        Indices of points.

    Returns
    -------
    triangles : (t, 3) int
        Indices of points, polygon by polygon.
    owners : (t,) int
        The polygon of each triangle.
    """
    triangles, owners, crossed = cut_polygons(points, starts, corners)
    if crossed.size:
        first = crossed[0]
        raise InvalidShapeError(
            "Faces must be polygons that do not cross themselves or fold back, as seen along their "
            f"normals; face {first} with the corners "
            f"{corners[starts[first] : starts[first + 1]].tolist()} does ({crossed.size} such). List its "
            "corners in the order of the outline, or save the mesh with triangles."
        )
    return triangles, owners


def cut_polygons(
    points: Float[np.ndarray, "n d"], starts: Int[np.ndarray, " p1"], corners: Int[np.ndarray, " k"]
) -> tuple[Int[np.ndarray, "t 3"], Int[np.ndarray, " t"], Int[np.ndarray, " q"]]:
    """Cut polygons as `triangulate_polygons` does; those that cross themselves become fans.

    Returns also the numbers of these.
    """
    n, dim = points.shape
    lengths = np.diff(starts)
    counts = np.maximum(lengths - 2, 0)
    owners = np.repeat(np.arange(len(lengths)), counts)
    first_triangles = np.cumsum(counts) - counts
    # Fans, as places in `corners`; some are replaced below
    tips = starts[owners]
    seconds = tips + 1 + np.arange(len(owners)) - first_triangles[owners]
    places = np.column_stack([tips, seconds, seconds + 1])
    space = np.full((3, n + 1), np.nan)  # the last for corners that are no points
    if dim in (2, 3):
        space[2, :n] = 0.0
        space[:dim, :n] = points.T
    indices = np.where((corners >= 0) & (corners < n), corners, n)
    crossed = np.zeros(len(lengths), dtype=bool)
    for length in np.unique(lengths[lengths > 3]).tolist():
        alike = np.flatnonzero(lengths == length)
        for numbers in np.array_split(alike, 1 + alike.size * length // BLOCK):
            rows = starts[numbers] + np.arange(length)[:, None]
            with np.errstate(all="ignore"):
                outlines = np.take(space, indices[rows], axis=1)
                spokes = outlines - outlines[:, :1]
                # A power of two changes no digits, so that corners on a line stay there.
                spokes *= np.ldexp(1.0, -np.frexp(np.abs(spokes).max(axis=(0, 1)))[1])
                flat = _flatten(spokes)
                is_left = ~_are_covered(flat) & np.isfinite(flat).all(axis=0)
            left = np.flatnonzero(is_left)
            cut = np.empty((left.size, length - 2, 3), dtype=np.int64)
            is_simple = np.empty(left.size, dtype=bool)
            outlines = np.stack([flat.real[:, left].T, flat.imag[:, left].T], axis=2)
            neighbors, shapes = np.empty((2, length), dtype=np.int64), np.empty(length)
            clip_ears(outlines, ROUNDING, cut, is_simple, neighbors, shapes)
            simple, others = numbers[left[is_simple]], left[~is_simple]
            rows = first_triangles[simple][:, None] + np.arange(length - 2)
            places[rows] = starts[simple][:, None, None] + cut[is_simple]
            # A polygon on a line, or nearly so, stays a fan.
            ranks = np.linalg.matrix_rank(spokes[:, :, others].transpose(2, 0, 1), THINNEST)
            crossed[numbers[others]] = ranks > 1
    return corners[places], owners, np.flatnonzero(crossed)


def _flatten(spokes: Float[np.ndarray, "3 c p"]) -> Complex[np.ndarray, "c p"]:
    """Return polygons in the planes across their normals, where they turn left."""
    normals = np.cross(spokes[:, 1:-1], spokes[:, 2:], axis=0).sum(axis=1)
    lengths = np.linalg.norm(normals, axis=0)
    normals = np.where(lengths > ROUNDING, normals / lengths, [[0.0], [0.0], [1.0]])
    # Two equally long axes at right angles, which are exact if the normal is along an axis
    first = np.cross(normals, np.eye(3)[:, np.abs(normals).argmin(axis=0)], axis=0)
    second = np.cross(normals, first, axis=0)
    return np.einsum("dp,dcp->cp", first + 1j * second, spokes)


def _are_covered(flat: Complex[np.ndarray, "c p"]) -> Bool[np.ndarray, " p"]:
    """Return whether the fan around the first corner covers a polygon without thin triangles.

    It does if all its triangles turn left, and they go round the corner at most once. The triangle
    at two equal corners has no area in any case.
    """
    spokes = flat[1:] - flat[0]
    turns = spokes[:-1].conj() * spokes[1:]
    sides = np.abs(np.stack([spokes[:-1], spokes[1:], spokes[1:] - spokes[:-1]]))
    are_good = (turns.imag > THINNEST * sides.max(axis=0) ** 2) | (sides.min(axis=0) == 0)
    return are_good.all(axis=0) & (np.angle(turns).sum(axis=0) <= FULL_TURN)
