"""Volumes of simplices in any dimension and codimension, accurate at any scale."""

from itertools import combinations
from math import factorial

import numpy as np
from jaxtyping import Bool, Float, Int

from certeig.kit.arrays import EPS
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_of, size_one
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.simplicial import Mesh

# A simplex counts as degenerate if its volume is at most this share of a cube on its longest side:
# below, the volume is mostly rounding of the coordinates.
THINNEST = 1e-14
# Points of size 1 nearer than this to a line or plane lie in it, up to rounding: some tens of
# roundings of one coordinate.
SPAN_ROUNDING = 64 * EPS
# Names of flats by dimension, for messages.
FLATS = {1: "on a line", 2: "in a plane"}
# Areas and volumes are returned if their scale is within 2^-1000..2^1000. Beyond, sums would
# overflow, or small simplices would lose digits (floats end at 2^1024 and 2^-1074).
LARGEST_EXPONENT = 1000
# Plural, singular and measure of simplices, by dimension, for messages.
MEASURES = {
    1: ("Segments", "segment", "length"),
    2: ("Faces", "face", "area"),
    3: ("Tetrahedra", "tetrahedron", "volume"),
}


def scaled_corners(mesh: Mesh) -> tuple[Float[np.ndarray, "s corners d"], float]:
    """Return the corners of each simplex, scaled to size 1, and the scale, a power of two.

    The corners are not translated. So measurements between them depend on these corners only, to
    the last digit, and not on the order of the vertices or on unreferenced ones.
    """
    corners = np.take(mesh.points, mesh.simplices, axis=0)
    scale = size_of(corners)
    corners /= scale
    return corners, scale


def in_length(
    values: Float[np.ndarray, "..."], scale: float, power: int
) -> Float[np.ndarray, "..."]:
    """Return values times `scale` to the given power; `scale` is a power of two.

    Raise InvalidShapeError if floats cannot represent them.
    """
    exponent = power * (int(np.frexp(scale)[1]) - 1)
    if abs(exponent) > LARGEST_EXPONENT:
        noun = {-2: "eigenvalues", -1: "gradients", 1: "lengths", 2: "areas", 3: "volumes"}.get(
            power, f"{power}-volumes"
        )
        most = 301 // abs(power)
        raise InvalidShapeError(
            f"To measure {noun} the largest coordinate must lie within 1e-{most}..1e{most}; "
            f"it is about {scale:.0e}. Choose another unit, as "
            'normalize_mesh(mesh, "box") does for surfaces.'
        )
    return np.ldexp(values, exponent)


def triangular_sides(
    corners: Float[np.ndarray, "s corners d"],
) -> tuple[Float[np.ndarray, "s d m"], Float[np.ndarray, "s m m"]]:
    """Factor the sides of each simplex: an orthonormal basis and an upper triangular matrix R.

    Column i of R is the side from corner 0 to corner i + 1 in that basis. RᵀR is the Gram matrix of
    the sides; R keeps digits that forming the Gram matrix would lose. The method is modified
    Gram-Schmidt on all simplices at once. A degenerate simplex has zeros on the diagonal of R and
    in its basis.
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


def barycentric_gradients(
    corners: Float[np.ndarray, "s corners d"],
) -> tuple[
    Float[np.ndarray, "s d m"], Float[np.ndarray, "s m m"], Float[np.ndarray, "s corners m"]
]:
    """Return the two factors of `triangular_sides`, and the gradients of barycentric coordinates.

    Row a holds the gradient of the coordinate of corner a, in the orthonormal basis of the simplex.
    The gradients are computed from the triangular factor, because the Gram matrix of the sides
    would have the squared condition number.
    """
    basis, triangles = triangular_sides(corners)
    inner = _inverse_triangles(triangles)
    gradients = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
    return basis, triangles, gradients


def _inverse_triangles(triangles: Float[np.ndarray, "s m m"]) -> Float[np.ndarray, "s m m"]:
    """Invert upper triangular matrices by back substitution, all at once."""
    inverses = np.zeros_like(triangles)
    for column in range(triangles.shape[1]):
        inverses[:, column, column] = 1 / triangles[:, column, column]
        for row in range(column - 1, -1, -1):
            rest = sum(
                triangles[:, row, i] * inverses[:, i, column] for i in range(row + 1, column + 1)
            )
            inverses[:, row, column] = -rest * inverses[:, row, row]
    return inverses


def volumes(corners: Float[np.ndarray, "s corners d"]) -> Float[np.ndarray, " s"]:
    """Return the m-volume of each simplex, √det(Gram matrix of its sides) / m!."""
    _, triangles = triangular_sides(corners)
    return volumes_of(triangles)


def volumes_of(triangles: Float[np.ndarray, "s m m"]) -> Float[np.ndarray, " s"]:
    """Return the m-volume of each simplex from its triangular factor."""
    return np.einsum("sii->si", triangles).prod(axis=1) / factorial(triangles.shape[1])


def simplex_volumes(mesh: MeshLike) -> Float[np.ndarray, " s"]:
    """Compute the m-volume of each simplex: lengths, areas, volumes and so on.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension m, in any length unit.

    Returns
    -------
    (s,) float
        Volumes, in length^m; 0 for a degenerate simplex.

    See Also
    --------
    dual_volumes : The volume at each point.

    Examples
    --------
    A unit cube of six equal tetrahedra.

    >>> import eigenshape as es
    >>> (6 * es.geometry.simplex_volumes(es.shapes.box(1, 1, 1))).round(6).tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    """
    mesh = as_simplicial(mesh)
    corners, scale = scaled_corners(mesh)
    return in_length(volumes(corners), scale, mesh.dim)


def dual_volumes(mesh: MeshLike) -> Float[np.ndarray, " n"]:
    """Compute the volume at each point: 1/(m+1) of the volume of its simplices (A_j of thesis 2.1).

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension m, in any length unit.

    Returns
    -------
    (n,) float
        Volumes, in length^m. They sum to the volume of the mesh; a point without simplices has 0.

    See Also
    --------
    simplex_volumes : The volume of each simplex.

    Examples
    --------
    >>> import eigenshape as es
    >>> (6 * es.geometry.dual_volumes(es.shapes.grid(1, 1))).round(6).tolist()
    [2.0, 1.0, 1.0, 2.0]
    """
    mesh = as_simplicial(mesh)
    return at_points(mesh, simplex_volumes(mesh) / (mesh.dim + 1))


def at_points(mesh: Mesh, values: Float[np.ndarray, " s"]) -> Float[np.ndarray, " n"]:
    """Return for each point the sum of the values of its simplices."""
    corners = mesh.simplices.shape[1]
    return np.bincount(
        mesh.simplices.ravel(), weights=np.repeat(values, corners), minlength=mesh.n_points
    )


def mean_side_length(mesh: MeshLike) -> float:
    """Compute the mean length e of the sides of all simplices.

    A side counts once for each simplex that has it, so sides inside a surface count twice.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension m, in any length unit.

    Returns
    -------
    float
        Mean length of the sides, in length.

    See Also
    --------
    edge_lengths : The length of each edge of a triangle mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> round(es.geometry.mean_side_length(es.shapes.grid(1, 1)), 6)  # (2 + 2**0.5) / 3
    1.138071
    """
    mesh = as_simplicial(mesh)
    corners, scale = scaled_corners(mesh)
    lengths = side_lengths(corners)
    return float(in_length(lengths.mean(keepdims=True), scale, 1)[0, 0])


def side_lengths(corners: Float[np.ndarray, "s corners d"]) -> Float[np.ndarray, "s sides"]:
    """Return the lengths of the sides of each simplex, in the order of `np.triu_indices`."""
    first, second = np.triu_indices(corners.shape[1], 1)
    return np.linalg.norm(corners[:, first] - corners[:, second], axis=2)


def degenerate_simplices(mesh: Mesh) -> Int[np.ndarray, " k"]:
    """Return the simplices with at most 1e-14 of the volume of a cube on their longest side."""
    corners, _ = scaled_corners(mesh)
    longest = np.zeros(len(corners))
    for first, second in combinations(range(corners.shape[1]), 2):
        side = corners[:, first] - corners[:, second]
        np.maximum(longest, np.sqrt(np.einsum("sd,sd->s", side, side)), out=longest)
    return np.flatnonzero(factorial(mesh.dim) * volumes(corners) <= THINNEST * longest**mesh.dim)


def require_span(points: Float[np.ndarray, "n d"], dim: int, noun: str) -> None:
    """Raise an error if points lie in a flat of fewer than `dim` dimensions, up to rounding."""
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
                f"{noun} must span {dim} dimensions; "
                f"all {len(points)} lie {flat} through point 0, {points[0].tolist()}."
            )


def cut_tetrahedra(
    corners: Int[np.ndarray, "t 4"], inside: Bool[np.ndarray, "t 4"]
) -> Int[np.ndarray, "q 3 2"]:
    """Return the triangles that part the inner corners of tetrahedra from the others.

    Each corner of a triangle is given by the edge that it lies on, the inner end first. A lone
    corner is cut off by a triangle; two and two are parted by a quadrilateral, cut along a diagonal.
    """
    order = np.argsort(~inside, axis=1, kind="stable")
    ordered, n_inside = np.take_along_axis(corners, order, axis=1), inside.sum(axis=1)
    cuts = [
        (1, [(0, 1), (0, 2), (0, 3)]),
        (3, [(0, 3), (1, 3), (2, 3)]),
        (2, [(0, 2), (0, 3), (1, 3)]),
        (2, [(0, 2), (1, 3), (1, 2)]),
    ]
    return np.concatenate([ordered[n_inside == count][:, cut] for count, cut in cuts])
