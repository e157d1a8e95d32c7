"""Coordinates of points and triangles: their size, lengths and areas, and what fits points to points."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, Real

# How much the rotation of points follows a given one, as a share of their moments: a rotation about
# the own axis of a limb as round as a finger, or of an eye, is hardly shown by its points.
FOLLOW = 0.02
ONE_PLACE = 1e-14  # mean square distance, in sizes², that is lost in rounding


def size_of(coordinates: Float[np.ndarray, "..."]) -> float:
    """Return the power of two at or below the largest absolute value; 1 if all are zero."""
    largest = max(coordinates.max(initial=0.0), -coordinates.min(initial=0.0))
    # One less than the exponent of frexp, so that the power exists for the largest float too.
    return float(2.0 ** (np.frexp(largest)[1] - 1)) if largest > 0 else 1.0


def size_one(coordinates: Float[np.ndarray, "..."]) -> tuple[Float[np.ndarray, "..."], float]:
    """Return coordinates divided by a power of two that brings the largest to size 1, and it."""
    scale = size_of(coordinates)
    return coordinates / scale, scale


def scale_to_unit(points: Float[np.ndarray, "n d"]) -> tuple[Float[np.ndarray, "n d"], float]:
    """Return points relative to their mean, scaled to size 1, and the scale.

    The scale is a power of two, so dividing by it is exact. Squares and cubes of the scaled
    coordinates neither overflow nor underflow, whatever their unit.
    """
    points, scale = size_one(points)
    points, inner_scale = size_one(points - points.mean(axis=0))
    return points, scale * inner_scale


def unit_vectors(vectors: Float[np.ndarray, "k d"]) -> Float[np.ndarray, "k d"]:
    """Give vectors the length 1, and make zeros of those without one."""
    norms = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, norms, out=np.zeros_like(vectors), where=norms > 0)


def unit_vector(vector: Real[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """Give a vector the length 1, however long or short it is; it must not be zero."""
    vector = vector / np.abs(vector).max()
    return vector / np.linalg.norm(vector)


def frames_across(normals: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 2 3"]:
    """Return two unit vectors that with each unit normal form a right-handed frame."""
    firsts = unit_vectors(np.cross(np.eye(3)[np.abs(normals).argmin(axis=1)], normals))
    return np.stack([firsts, np.cross(normals, firsts)], axis=1)


def row_dots(
    one: Float[np.ndarray, "k d"], two: Float[np.ndarray, "k d"]
) -> Float[np.ndarray, " k"]:
    """Return the inner product of each row with the same row of another table."""
    return np.einsum("ki,ki->k", one, two)


def sum_rows(
    groups: Int[np.ndarray, " k"], rows: Float[np.ndarray, "k c"], n_groups: int = 0
) -> Float[np.ndarray, "g c"]:
    """Return the sum of the rows of each group; of groups beyond those that occur, zeros."""
    return np.column_stack([np.bincount(groups, column, n_groups) for column in rows.T])


def area_vectors(corners: Float[np.ndarray, "f 3 3"]) -> Float[np.ndarray, "f 3"]:
    """Return the unit normal of each triangle times its area."""
    a, b, c = corners.transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


def triangle_areas(corners: Float[np.ndarray, "f 3 3"]) -> Float[np.ndarray, " f"]:
    """Return the area of each triangle, in the unit of its corners."""
    return np.linalg.norm(area_vectors(corners), axis=1)


def mean_radius(points: Float[np.ndarray, "n 3"]) -> float:
    """Return the root mean square distance of points from their middle."""
    return float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1))))


def nearest_rotations(matrices: Float[np.ndarray, "k d d"]) -> Float[np.ndarray, "k d d"]:
    """Return the rotation nearest to each matrix in the Frobenius norm (Kabsch 1976)."""
    return rotations_and_stretches(matrices)[0]


def rotations_and_stretches(
    matrices: Float[np.ndarray, "*k d d"],
) -> tuple[Float[np.ndarray, "*k d d"], Float[np.ndarray, "*k d"]]:
    """Return the rotation R nearest to each matrix M, and signed stretches, whose sum is trace(RᵀM).

    They are the singular values; the smallest is negative if M reflects.
    """
    left, stretches, right = np.linalg.svd(matrices)
    # A reflection becomes a rotation by a change of sign along the smallest singular value.
    signs = np.sign(np.linalg.det(left @ right))
    left[..., -1] *= signs[..., None]
    stretches[..., -1] *= signs
    return left @ right, stretches


class Similarities(NamedTuple):
    """Rotation, factor of size, and center before and after, of k similarity transformations."""

    rotations: Float[np.ndarray, "k 3 3"]
    factors: Float[np.ndarray, " k"]
    before: Float[np.ndarray, "k 3"]
    after: Float[np.ndarray, "k 3"]

    def move(self, points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, "p 3"]:
        """Move a point by each, or all points by one."""
        turned = np.einsum("...ij,...j->...i", self.rotations, points - self.before)
        return self.after + self.factors[:, None] * turned


def fit_similarities(
    average: Callable[[Float[np.ndarray, "n c"]], Float[np.ndarray, "k c"]],
    before: Float[np.ndarray, "n 3"],
    after: Float[np.ndarray, "n 3"],
    follow: Float[np.ndarray, "3 3"] | None = None,
) -> Similarities:
    """Fit similarities to n pairs of points by least squares, one for each of k weighted means (Umeyama 1991).

    `average` returns the k means of each column of a table; it defines the weights. Rotations follow
    a given one where points hardly show how they are turned.
    """
    # About the middle and in unit size, so that moments keep their digits
    middles = before.mean(axis=0), after.mean(axis=0)
    (one, size), (two, size_after) = size_one(before - middles[0]), size_one(after - middles[1])
    products = np.einsum("ni,nj->nij", two, one).reshape(-1, 9)
    means = average(np.column_stack([one, two, products, np.sum(one**2, axis=1)]))
    center, there = means[:, :3], means[:, 3:6]
    moments = means[:, 6:15].reshape(-1, 3, 3) - there[:, :, None] * center[:, None, :]
    spreads = means[:, 15] - np.sum(center**2, axis=1)
    if follow is not None:
        moments += FOLLOW * np.linalg.norm(moments, axis=(1, 2), keepdims=True) * follow
    rotations, stretches = rotations_and_stretches(moments)
    # Points in one place have no size: they keep theirs.
    has_size = spreads > ONE_PLACE
    factors = np.divide(stretches.sum(axis=1), spreads, out=np.ones_like(spreads), where=has_size)
    return Similarities(
        rotations,
        factors * (size_after / size),
        middles[0] + size * center,
        middles[1] + size_after * there,
    )
