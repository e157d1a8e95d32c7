"""Faces laid flat one after another, for paths that cross them straight."""

import numpy as np
from jaxtyping import Complex, Float, Int

from certeig.kit.arrays import ReadOnly, record
from eigenshape._corners import face_angles, in_length, side_ends
from eigenshape._vectors import size_one
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.directions import side_twins

# An angle counts as less than π if it is by more than this: rounding of unfolded strips is 1e-13.
STRAIGHT = 1e-10


# Points of a path nearer than this share of its coordinates to the next are one point.
SAME = 1e-14


@record
class GeodesicPath(ReadOnly):
    """A polyline on a surface.

    Attributes
    ----------
    points : (p, 3) float
        Where it starts, where it crosses edges or passes vertices, and where it ends, in length.
    length : float
        In length.

    Examples
    --------
    The shortest path between opposite corners of a plane square is its diagonal:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> square = es.shapes.grid(5, 5)
    >>> path = es.calculus.geodesic_path(square, 0, square.n_vertices - 1)
    >>> round(path.length, 6)
    1.414214
    >>> steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    >>> round(float(steps.sum()), 6)
    1.414214
    """

    points: Float[np.ndarray, "p 3"]
    length: float


@record
class Sides:
    """What a walk over faces needs; side 3f + s runs from corner s of face f to the next."""

    tails: Int[np.ndarray, " h"]
    heads: Int[np.ndarray, " h"]
    twins: Int[np.ndarray, " h"]
    lengths: Float[np.ndarray, " h"]
    angles: Float[np.ndarray, " h"]
    around: Float[np.ndarray, " n"]
    of_edge: dict[tuple[int, int], int]


def walkable_sides(mesh: TriangleMesh) -> Sides:
    """Measure the sides of a manifold mesh."""
    tails, heads = side_ends(mesh.faces)
    lengths = np.linalg.norm(mesh.vertices[heads] - mesh.vertices[tails], axis=1)
    angles = face_angles(mesh).ravel()
    around = np.bincount(tails, angles, minlength=mesh.n_vertices)
    of_edge = dict(
        zip(zip(tails.tolist(), heads.tolist(), strict=True), range(len(tails)), strict=True)
    )
    return Sides(tails, heads, side_twins(mesh), lengths, angles, around, of_edge)


def flat_corners(corners: Float[np.ndarray, "3 3"]) -> Complex[np.ndarray, "3"]:
    """Lay a face in the plane of its frame, with its first corner at 0 and its first side along x."""
    sides = corners[1:] - corners[0]
    length = np.linalg.norm(sides[0])
    apex = sides[0] @ sides[1] + 1j * np.linalg.norm(np.cross(sides[0], sides[1]))
    return np.array([0, length, apex / length])


def next_side(side: int) -> int:
    """Return the side of the same face that starts where one ends."""
    return side - 2 if side % 3 == 2 else side + 1


def previous_side(side: int) -> int:
    """Return the side of the same face that ends where one starts."""
    return side + 2 if side % 3 == 0 else side - 1


def apex_of(sides: Sides, side: int, tail: complex, head: complex) -> complex:
    """Place the third corner of a face, on the left of its side from `tail` to `head`."""
    length = float(sides.lengths[side])
    reach = float(sides.lengths[previous_side(side)])
    angle = float(sides.angles[side])
    return tail + (head - tail) / length * reach * complex(np.cos(angle), np.sin(angle))


def cross(one: complex, two: complex) -> float:
    """Return a positive number if the second vector is on the left of the first."""
    return (one.conjugate() * two).imag


def point_on_side(
    mesh: TriangleMesh, sides: Sides, side: int, share: float
) -> Float[np.ndarray, "3"]:
    """Return the point at a share of the way from the tail of a side to its head."""
    tail, head = mesh.vertices[sides.tails[side]], mesh.vertices[sides.heads[side]]
    return (1 - share) * tail + share * head


def as_path(points: Float[np.ndarray, "p 3"]) -> GeodesicPath:
    """Keep each point of a path once, and measure it."""
    unit, scale = size_one(points)
    steps = np.linalg.norm(np.diff(unit, axis=0), axis=1)
    kept = np.append(True, steps > SAME)
    length = in_length(steps.sum(keepdims=True), scale, 1)
    return GeodesicPath(points[kept], float(length[0]))
