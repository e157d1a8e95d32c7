"""Which side of a surface is out, where its faces do not say."""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import ConvexHull, QhullError

from eigenshape._threads import one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import area_vectors, enclosed_volume, mean_normals, unit_scaled
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_oriented
from eigenshape.geometry.simplices import scaled_corners, size_one
from eigenshape.geometry.topology import (
    edge_table,
    face_turns,
    is_closed,
    submesh,
    with_turned_faces,
)

FLAT = (
    1e-10  # volume over area^1.5 up to which rounding decides which side is out; a ball has 0.094
)


@one_blas_thread()
def orient_outward(mesh: MeshLike) -> TriangleMesh:
    """Turn all faces over if more of what lies on the convex hull faces into it than out of it.

    Where a surface touches its convex hull, its outside is the hull's outside, also on a part or a one-sided scan,
    whose signed volume says nothing. Corners of the hull's facets vote by N · n, by the area of the facet with normal
    n. Sound for what is seen from outside; a room from within, or a bowl without an outer side, is turned over.

    Parameters
    ----------
    mesh : MeshLike
        One decision is made for all faces, so neighbors must agree.

    Returns
    -------
    TriangleMesh
        The same mesh where it faces out already, or is flat and has no outside.

    Raises
    ------
    InvalidShapeError
        If two neighboring faces are turned against each other.
    """
    mesh = as_mesh(mesh)
    require_oriented(mesh)
    points, _ = unit_scaled(mesh)
    try:
        hull = ConvexHull(points)
    except QhullError:
        return mesh
    areas = np.linalg.norm(area_vectors(points[hull.simplices]), axis=1)
    sums = mean_normals(mesh)[hull.simplices].sum(axis=1)
    vote = areas @ np.einsum("fi,fi->f", sums, hull.equations[:, :3])
    return mesh if vote >= 0 else TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def orient_closed_outward(mesh: TriangleMesh) -> TriangleMesh:
    """Turn all faces of a closed mesh over if its signed volume is negative.

    An open mesh, whose signed volume says nothing, is returned as it is; `orient_outward` decides
    for those.

    Raises
    ------
    InvalidShapeError
        If two neighboring faces of a closed mesh are turned against each other.
    """
    if not is_closed(mesh) or enclosed_volume(mesh) >= 0:
        return mesh
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def faces_to_turn(
    mesh: TriangleMesh,
) -> tuple[Bool[np.ndarray, " f"], Bool[np.ndarray, " f"], Int[np.ndarray, " f"]]:
    """Find which faces to turn over so that neighbors agree and pieces face out.

    A closed piece faces out where its signed volume is positive. One inside another is turned with the outermost: it
    may be a cavity, whose faces look into it. An open piece whose faces agree is left as it is; any other is turned as
    a whole by `orient_outward`. A piece here ends at edges with more than two faces.

    Returns
    -------
    turned : (f,) bool
    one_sided : (f,) bool
        Faces of pieces that cannot be oriented, such as a Möbius strip; none of them is turned.
    piece : (f,) int
        Number of the piece of each face.
    """
    turns = face_turns(mesh)
    agreed = with_turned_faces(mesh, turns.turned)
    _, piece = np.unique(turns.patches, return_inverse=True)
    table = edge_table(mesh)
    at_end = (table.n_faces != 2)[table.face_edges].any(axis=1)
    is_open = np.bincount(piece, weights=at_end) > 0
    disagreed = np.bincount(piece, weights=turns.turned) > 0
    sided = np.bincount(piece, weights=turns.orientable) > 0
    over = np.zeros(len(is_open), dtype=bool)
    over[~is_open & sided] = _faces_in(agreed, piece, np.flatnonzero(~is_open & sided))
    for number in np.flatnonzero(is_open & sided & disagreed):
        part, _ = submesh(agreed, piece == number)
        over[number] = orient_outward(part) is not part
    return turns.turned ^ over[piece], ~turns.orientable, piece


def _faces_in(
    mesh: TriangleMesh, piece: Int[np.ndarray, " f"], closed: Int[np.ndarray, " c"]
) -> Bool[np.ndarray, " c"]:
    """Say of each closed piece whether it, or the outermost piece around it, faces in."""
    corners, _ = scaled_corners(mesh)
    rows = np.argsort(piece, kind="stable")
    starts = np.searchsorted(piece[rows], closed)
    ends = np.searchsorted(piece[rows], closed, side="right")
    pieces = [corners[rows[start:end]] for start, end in zip(starts, ends, strict=True)]
    volumes = np.array([_relative_volume(faces) for faces in pieces])
    inward = volumes < -FLAT
    if not inward.any() or len(pieces) == 1:
        return inward
    low, high = (
        np.array([extreme(faces, axis=(0, 1)) for faces in pieces]) for extreme in (np.min, np.max)
    )
    largest_first = np.argsort(-(high - low).prod(axis=1), kind="stable")
    found = inward.copy()
    for number, faces in enumerate(pieces):
        around = (low < low[number]).all(axis=1) & (high > high[number]).all(axis=1)
        for other in largest_first[around[largest_first]]:
            if abs(_winding_number(pieces[other], faces[0, 0])) > 0.5:
                found[number] = inward[other]
                break
    return found


def _relative_volume(corners: Float[np.ndarray, "f 3 3"]) -> float:
    """Return the signed volume under some faces, over the power 1.5 of their area; 0 where they have none."""
    corners, _ = size_one(corners - corners.mean(axis=(0, 1)))  # a speck's cubes would be no floats
    a, b, c = corners.transpose(1, 0, 2)
    area = float(np.linalg.norm(area_vectors(corners), axis=1).sum())
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6 / area**1.5 if area else 0.0


def _winding_number(corners: Float[np.ndarray, "f 3 3"], point: Float[np.ndarray, "3"]) -> float:
    """Count how often closed faces wind around a point: ±1 inside, 0 outside (Van Oosterom and Strackee 1983)."""
    a, b, c = (corners - point).transpose(1, 0, 2)
    one, two, three = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    products = [np.einsum("ij,ij->i", *pair) for pair in ((b, c), (c, a), (a, b))]
    below = one * two * three + products[0] * one + products[1] * two + products[2] * three
    return float(np.arctan2(volume, below).sum() / (2 * np.pi))
