"""Polygons of any number of corners, cut into triangles."""

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.polygon_loops import clip_ears, crosses_itself

# A fan is taken if each of its triangles has more than this share of its longest side squared as
# area. Corners on a line have 1e-7 in single precision, a regular polygon of 1,000 corners 8e-4.
THINNEST = 1e-6
FULL_TURN = 2 * np.pi + 1e-9  # radians, with rounding
BLOCK = 20_000  # corners at once, so that they stay in the cache


def triangulate_polygons(
    points: Float[np.ndarray, "n d"], starts: Int[np.ndarray, " p1"], corners: Int[np.ndarray, " k"]
) -> tuple[Int[np.ndarray, "t 3"], Int[np.ndarray, " t"]]:
    """Cut polygons into triangles, which are turned as the polygons are.

    A polygon may be convex or not, flat or not. A hole is joined to the outline by a bridge, a side
    that goes there and back. A polygon of c corners becomes c - 2 triangles, which use all of them:
    the fan around its first corner, if no triangle of it lies outside; otherwise the corners with
    the best-shaped triangles are cut off one by one (ear clipping, Meisters 1975). What lies outside
    is decided in the plane across the mean normal (Newell's).

    Polygons without area, those with a corner that is not finite or not a point, and those in other
    dimensions than 2 and 3 become fans.

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

    Raises
    ------
    InvalidShapeError
        If a polygon crosses itself.
    """
    triangles, owners, crossed = cut_polygons(points, starts, corners)
    if crossed.size:
        first = crossed[0]
        raise InvalidShapeError(
            "Faces must be polygons that do not cross themselves, as seen along their normals; face "
            f"{first} with the corners {corners[starts[first] : starts[first + 1]].tolist()} does "
            f"({crossed.size} such). List its corners in the order of the outline, or save the mesh "
            "with triangles."
        )
    return triangles, owners


def cut_polygons(
    points: Float[np.ndarray, "n d"], starts: Int[np.ndarray, " p1"], corners: Int[np.ndarray, " k"]
) -> tuple[Int[np.ndarray, "t 3"], Int[np.ndarray, " t"], Int[np.ndarray, " q"]]:
    """Cut polygons as `triangulate_polygons` does; those that cross themselves become fans.

    Returns also the numbers of these.
    """
    lengths = np.diff(starts)
    counts = np.maximum(lengths - 2, 0)
    owners = np.repeat(np.arange(len(lengths)), counts)
    first_triangles = np.cumsum(counts) - counts
    # Places of corners in their polygons: those of fans, unless others are found below
    middle = np.arange(1, len(owners) + 1) - first_triangles[owners]
    places = np.column_stack([np.zeros_like(middle), middle, middle + 1])
    n, dim = points.shape
    space = np.full((3, n + 1), np.nan)
    if dim in (2, 3):
        space[2, :n] = 0.0
        space[:dim, :n] = points.T
    indices = np.where((corners >= 0) & (corners < n), corners, n)
    crossed = []
    for length in np.unique(lengths[lengths > 3]).tolist():
        alike = np.flatnonzero(lengths == length)
        for chosen in np.array_split(alike, 1 + alike.size * length // BLOCK):
            rows = indices[starts[chosen] + np.arange(length)[:, None]]
            outlines = np.take(space, rows, axis=1)
            with np.errstate(all="ignore"):
                flat, areas = _flatten(outlines)
                left = np.flatnonzero(~_are_covered(flat))
            for number in left[np.isfinite(flat[:, left]).all(axis=0)].tolist():
                cut = _cut_outline(flat[:, number].copy())
                first = first_triangles[chosen[number]]
                if cut is not None:
                    places[first : first + length - 2] = cut
                elif areas[number] > THINNEST:
                    crossed.append(chosen[number])
    triangles = corners[starts[owners][:, None] + places]
    return triangles, owners, np.sort(np.array(crossed, dtype=np.int64))


def _cut_outline(points: Complex[np.ndarray, " c"]) -> Int[np.ndarray, "t 3"] | None:
    """Cut a polygon in the plane; None if it crosses itself."""
    length = len(points)
    ring = np.arange(length)
    triangles = np.empty((length - 2, 3), dtype=np.int64)
    is_cut = clip_ears(
        points, np.roll(ring, 1), np.roll(ring, -1), np.full(length, -1.0), triangles
    )
    return triangles if is_cut and not crosses_itself(points) else None


def _flatten(
    outlines: Float[np.ndarray, "3 c p"],
) -> tuple[Complex[np.ndarray, "c p"], Float[np.ndarray, " p"]]:
    """Return polygons of size 1 in the plane, turning left, and how large their fans are in space."""
    spokes = outlines - outlines[:, :1]
    # A power of two changes no digits, so that corners on a line stay there.
    spokes *= np.ldexp(1.0, -np.frexp(np.abs(spokes).max(axis=(0, 1)))[1])
    vectors = np.cross(spokes[:, 1:-1], spokes[:, 2:], axis=0)
    normals = vectors.sum(axis=1)
    lengths = np.linalg.norm(normals, axis=0)
    x, y, z = normals / np.where(lengths > 0, lengths, 1.0)
    # An orthonormal basis around the normal, exact for those along axes (Duff et al. 2017)
    sign = np.copysign(1.0, z)
    a = -1 / (sign + z)
    first = np.array([1 + sign * x * x * a, sign * x * y * a, -sign * x])
    second = np.array([x * y * a, sign + y * y * a, -y])
    flat = np.einsum("dp,dcp->cp", first + 1j * second, spokes)
    return flat, np.abs(vectors).sum(axis=(0, 1))


def _are_covered(points: Complex[np.ndarray, "c p"]) -> Bool[np.ndarray, " p"]:
    """Return whether the fan around the first corner covers a polygon without thin triangles.

    It does if all its triangles turn left, and they go round the corner at most once. The triangle
    at two equal corners has no area in any case.
    """
    spokes = points[1:] - points[0]
    turns = spokes[:-1].conj() * spokes[1:]
    lengths, sides = np.abs(spokes), np.abs(spokes[1:] - spokes[:-1])
    sizes = np.stack([lengths[:-1], lengths[1:], sides])
    are_good = (turns.imag > THINNEST * sizes.max(axis=0) ** 2) | (sizes.min(axis=0) == 0)
    return are_good.all(axis=0) & (np.angle(turns).sum(axis=0) <= FULL_TURN)
