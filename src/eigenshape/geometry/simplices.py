"""Volumes of simplices in any dimension and codimension, right at any scale of the coordinates."""

from itertools import combinations
from math import factorial

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import InvalidShapeError, try_auto
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.simplicial import Mesh

# A simplex thinner than this, volume over that of a cube on its longest side, is flat as far as rounding can tell.
THINNEST = 1e-14
# Points nearer than this to a line or a plane lie in it as far as the rounding of coordinates of size 1 can tell.
SPAN_ROUNDING = 64 * float(np.finfo(np.float64).eps)
FLATS = {1: "on a line", 2: "in a plane"}
# Powers of two up to which areas and volumes are handed out: beyond, sums overflow or small simplices lose digits.
LARGEST_EXPONENT = 1000
MEASURES = {
    1: ("Segments", "segment", "length"),
    2: ("Faces", "face", "area"),
    3: ("Tetrahedra", "tetrahedron", "volume"),
}


def scaled_corners(mesh: Mesh) -> tuple[Float[np.ndarray, "s corners d"], float]:
    """Return the corners of each simplex, divided by a power of two that brings them to size 1, and that power.

    Nothing is moved: what is measured between corners depends on them alone, to the last digit, and not on the order
    of the vertices, nor on those that no simplex uses.
    """
    corners = mesh.points[mesh.simplices]
    scale = _size(corners)
    corners /= scale
    return corners, scale


def size_one(coordinates: Float[np.ndarray, "..."]) -> tuple[Float[np.ndarray, "..."], float]:
    """Return coordinates divided by a power of two that brings the largest to size 1, and that power."""
    scale = _size(coordinates)
    return coordinates / scale, scale


def _size(coordinates: Float[np.ndarray, "..."]) -> float:
    largest = max(coordinates.max(), -coordinates.min())
    # One below the exponent of frexp, so that the largest of all numbers has a power too.
    return float(2.0 ** (np.frexp(largest)[1] - 1)) if largest > 0 else 1.0


def in_length(
    values: Float[np.ndarray, "..."], scale: float, power: int
) -> Float[np.ndarray, "..."]:
    """Return values times scale to a whole power; `scale` is a power of two.

    Raises
    ------
    InvalidShapeError
        If floats cannot hold lengths to that power.
    """
    exponent = power * (int(np.frexp(scale)[1]) - 1)
    if abs(exponent) > LARGEST_EXPONENT:
        noun = {-2: "eigenvalues", 1: "lengths", 2: "areas", 3: "volumes"}.get(
            power, f"{power}-volumes"
        )
        most = 301 // abs(power)
        raise InvalidShapeError(
            f"To measure {noun} the largest coordinate must lie within 1e-{most}..1e{most}; it is about {scale:.0e}. "
            "Choose another unit, or normalize_box."
        )
    return np.ldexp(values, exponent)


def triangular_sides(
    corners: Float[np.ndarray, "s corners d"],
) -> tuple[Float[np.ndarray, "s d m"], Float[np.ndarray, "s m m"]]:
    """Write the sides from corner 0 of each simplex in an orthonormal basis of its own, as an upper triangle R.

    Column i of R is the side to corner i + 1. RᵀR is the Gram matrix of the sides; the factor keeps the digits that
    forming that matrix would lose. Gram-Schmidt (modified), all simplices at once; a simplex without volume has zeros
    on the diagonal, and in the basis.
    """
    sides = np.ascontiguousarray((corners[:, 1:] - corners[:, :1]).transpose(1, 2, 0))
    dim, _, n = sides.shape
    triangles = np.zeros((dim, dim, n))
    for i in range(dim):
        length = np.sqrt(np.einsum("as,as->s", sides[i], sides[i]), out=triangles[i, i])
        sides[i] /= np.where(length > 0, length, 1.0)
        for j in range(i + 1, dim):
            np.einsum("as,as->s", sides[i], sides[j], out=triangles[i, j])
            sides[j] -= triangles[i, j] * sides[i]
    return sides.transpose(2, 1, 0), triangles.transpose(2, 0, 1)


def volumes(corners: Float[np.ndarray, "s corners d"]) -> Float[np.ndarray, " s"]:
    """Return the m-volume of each simplex, √det(Gram matrix of its sides) / m!."""
    _, triangles = triangular_sides(corners)
    return volumes_of(triangles)


def volumes_of(triangles: Float[np.ndarray, "s m m"]) -> Float[np.ndarray, " s"]:
    """Return the m-volume of each simplex from its triangle of sides."""
    return np.einsum("sii->si", triangles).prod(axis=1) / factorial(triangles.shape[1])


def simplex_volumes(mesh: MeshLike) -> Float[np.ndarray, " s"]:
    """Return the m-volume of each simplex, in length^m."""
    mesh = as_simplicial(mesh)
    corners, scale = scaled_corners(mesh)
    return in_length(volumes(corners), scale, mesh.dim)


def dual_volumes(mesh: MeshLike) -> Float[np.ndarray, " n"]:
    """Return A_j = 1/(m+1) of the volume of the simplices at each point, in length^m (thesis 2.1)."""
    mesh = as_simplicial(mesh)
    return at_points(mesh, simplex_volumes(mesh) / (mesh.dim + 1))


def at_points(mesh: Mesh, values: Float[np.ndarray, " s"]) -> Float[np.ndarray, " n"]:
    """Sum at each point a number of each of its simplices."""
    corners = mesh.simplices.shape[1]
    return np.bincount(
        mesh.simplices.ravel(), weights=np.repeat(values, corners), minlength=mesh.n_points
    )


def mean_side_length(mesh: MeshLike) -> float:
    """Return e, the mean length of the sides of all simplices: a side that two share counts twice, in length."""
    mesh = as_simplicial(mesh)
    corners, scale = scaled_corners(mesh)
    first, second = np.triu_indices(corners.shape[1], 1)
    lengths = np.linalg.norm(corners[:, first] - corners[:, second], axis=2)
    return float(in_length(lengths.mean(keepdims=True), scale, 1)[0, 0])


def degenerate_simplices(mesh: Mesh) -> Int[np.ndarray, " k"]:
    """Return the simplices without volume: at most 1e-14 of the cube on their longest side."""
    corners, _ = scaled_corners(mesh)
    longest = np.zeros(len(corners))
    for first, second in combinations(range(corners.shape[1]), 2):
        side = corners[:, first] - corners[:, second]
        np.maximum(longest, np.sqrt(np.einsum("sd,sd->s", side, side)), out=longest)
    return np.flatnonzero(factorial(mesh.dim) * volumes(corners) <= THINNEST * longest**mesh.dim)


def require_span(points: Float[np.ndarray, "n d"], dim: int, noun: str) -> None:
    """Refuse points that lie in a flat of fewer than `dim` dimensions, as far as the rounding of coordinates can tell.

    Raises
    ------
    InvalidShapeError
        With that flat.
    """
    offsets = size_one(points)[0]
    offsets = offsets - offsets[0]
    for found in range(dim):
        lengths = np.linalg.norm(offsets, axis=1)
        farthest = int(lengths.argmax())
        if lengths[farthest] > SPAN_ROUNDING:
            direction = offsets[farthest] / lengths[farthest]
            offsets = offsets - np.outer(offsets @ direction, direction)
        elif not found:
            raise InvalidShapeError(
                f"{noun} must differ; all {len(points)} are {points[0].tolist()}."
            )
        else:
            flat = FLATS.get(found, f"in a flat of {found} dimensions")
            raise InvalidShapeError(
                f"{noun} must span {dim} dimensions; all {len(points)} lie {flat} through point 0, "
                f"{points[0].tolist()}."
            )


def require_volumes(mesh: Mesh) -> None:
    """Refuse a mesh with a simplex that has no volume, naming the first.

    Raises
    ------
    InvalidShapeError
        With the index, corners and number of such simplices; or if rounding alone gives them volume.
    """
    flat = degenerate_simplices(mesh)
    all_of, one, measure = MEASURES.get(mesh.dim, ("Simplices", "simplex", "volume"))
    if flat.size == len(mesh.simplices):
        raise InvalidShapeError(
            f"{all_of} must have {measure}; all {flat.size} have none: their points are equal or "
            f"{'on a line' if mesh.dim == 2 else 'in a flat of lower dimension'}."
        )
    if flat.size:
        corners = mesh.simplices[flat[0]]
        raise InvalidShapeError(
            f"{all_of} must have {measure}; {one} {flat[0]} is {corners.tolist()} with corners "
            f"{mesh.points[corners].tolist()} ({flat.size} such). {try_auto()}"
        )
    used = np.zeros(mesh.n_points, dtype=bool)
    used[mesh.simplices] = True
    require_span(mesh.points[used], mesh.dim, "The points of a mesh")
