"""Corners of simplices as arrays: volumes and gradients accurate at any scale, normals, sides, and sums at points."""

from math import factorial
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import area_vectors, size_of, sum_rows, unit_vectors

# Areas and volumes are returned if their scale is within 2^-1000..2^1000. Beyond, sums would
# overflow, or small simplices would lose digits (floats end at 2^1024 and 2^-1074).
LARGEST_EXPONENT = 1000


@runtime_checkable
class HasSimplices(Protocol):
    """What meshes of all dimensions have in common: points, and simplices with corners among them."""

    @property
    def points(self) -> Float[np.ndarray, "n d"]:
        """Return the coordinates."""

    @property
    def simplices(self) -> Int[np.ndarray, "s corners"]:
        """Return the corners of each simplex."""


def scaled_corners(mesh: HasSimplices) -> tuple[Float[np.ndarray, "s corners d"], float]:
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


def at_points(mesh: HasSimplices, values: Float[np.ndarray, " s"]) -> Float[np.ndarray, " n"]:
    """Return for each point the sum of the values of its simplices."""
    corners = mesh.simplices.shape[1]
    return np.bincount(
        mesh.simplices.ravel(), weights=np.repeat(values, corners), minlength=len(mesh.points)
    )


def side_lengths(corners: Float[np.ndarray, "s corners d"]) -> Float[np.ndarray, "s sides"]:
    """Return the lengths of the sides of each simplex, in the order of `np.triu_indices`."""
    first, second = np.triu_indices(corners.shape[1], 1)
    return np.linalg.norm(corners[:, first] - corners[:, second], axis=2)


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


def side_ends(
    faces: Int[np.ndarray, "f 3"],
) -> tuple[Int[np.ndarray, " h"], Int[np.ndarray, " h"]]:
    """Return the vertex at which each side starts, and that at which it ends.

    Side 3f + s runs from corner s of face f to the next.
    """
    return faces.ravel(), np.roll(faces, -1, axis=1).ravel()


def edge_keys(faces: Int[np.ndarray, "f 3"], n: int) -> Int[np.ndarray, " h"]:
    """Return for each side, the first from corner 0 to corner 1, a number that sides with the same ends share."""
    tails, heads = side_ends(faces)
    return np.minimum(tails, heads) * n + np.maximum(tails, heads)


def shared_facets(
    simplex_facets: Int[np.ndarray, "..."],
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]]:
    """Return pairs of sides that lie on one facet; they chain all sides of the facet.

    Side (m+1)·s + a is the one of simplex s opposite to its corner a.
    """
    facets = simplex_facets.ravel()
    order = np.argsort(facets, kind="stable")
    same = facets[order][1:] == facets[order][:-1]
    return order[:-1][same], order[1:][same]


def half_edges(faces: Int[np.ndarray, "f 3"]) -> Int[np.ndarray, "s 2"]:
    """Return the directed edges of faces: those opposite to corner 0 first, then 1, then 2."""
    a, b, c = faces.T
    return np.concatenate([np.column_stack(side) for side in ((b, c), (c, a), (a, b))])


def mean_normals(mesh: HasSimplices) -> Float[np.ndarray, "n 3"]:
    """Return `vertex_normals` of any surface; normals of neighbors that disagree cancel in part."""
    vectors = np.repeat(area_vectors(scaled_corners(mesh)[0]), 3, axis=0)
    return unit_vectors(sum_rows(mesh.simplices.ravel(), vectors, len(mesh.points)))


def longest_edges(mesh: HasSimplices) -> Float[np.ndarray, " s"]:
    """Return the length of the longest edge of each simplex."""
    corners, scale = scaled_corners(mesh)
    return in_length(side_lengths(corners).max(axis=1), scale, 1)


def face_angles(mesh: HasSimplices) -> Float[np.ndarray, "f 3"]:
    """Return the angle at each corner of each triangle, in radians."""
    corners, _ = scaled_corners(mesh)
    one, two = (np.roll(corners, -turn, axis=1) - corners for turn in (1, 2))
    sines = np.linalg.norm(np.cross(one, two), axis=2)
    return np.arctan2(sines, np.einsum("fij,fij->fi", one, two))


def unique_edges(
    one: Int[np.ndarray, "..."], two: Int[np.ndarray, "..."], n: int
) -> Int[np.ndarray, "e 2"]:
    """Return pairs of n points without duplicates, the lower first, in lexicographic order."""
    # np.unique hashes integers, which takes several times as long as sorting them.
    keys = np.sort((np.minimum(one, two) * n + np.maximum(one, two)).ravel())
    return np.column_stack(np.divmod(keys[np.diff(keys, prepend=-1) > 0], n))


def edges_of(mesh: HasSimplices) -> Int[np.ndarray, "e 2"]:
    """Return the edges of a mesh of any dimension, the lower point first, in lexicographic order."""
    corners = mesh.simplices
    first, second = np.triu_indices(corners.shape[1], 1)
    return unique_edges(corners[:, first], corners[:, second], len(mesh.points))
