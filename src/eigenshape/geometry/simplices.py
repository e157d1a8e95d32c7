"""Volumes of simplices in any dimension and codimension, accurate at any scale."""

from itertools import combinations
from math import factorial

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import EPS
from eigenshape._corners import at_points, in_length, scaled_corners, side_lengths, volumes
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import row_dots, size_one
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
# Plural, singular and measure of simplices, by dimension, for messages.
MEASURES = {
    1: ("Segments", "segment", "length"),
    2: ("Faces", "face", "area"),
    3: ("Tetrahedra", "tetrahedron", "volume"),
}


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


def degenerate_simplices(mesh: Mesh) -> Int[np.ndarray, " k"]:
    """Return the simplices with at most 1e-14 of the volume of a cube on their longest side."""
    corners, _ = scaled_corners(mesh)
    longest = np.zeros(len(corners))
    for first, second in combinations(range(corners.shape[1]), 2):
        side = corners[:, first] - corners[:, second]
        np.maximum(longest, np.sqrt(row_dots(side, side)), out=longest)
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
