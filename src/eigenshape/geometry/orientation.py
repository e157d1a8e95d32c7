"""Orientation of surfaces: which side is outside."""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import ConvexHull, QhullError

from eigenshape._threads import one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.face_turns import face_turns, turn_faces
from eigenshape.geometry.measure import enclosed_volume, mean_normals, scale_to_unit, triangle_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_oriented
from eigenshape.geometry.simplices import scaled_corners, size_one
from eigenshape.geometry.topology import edge_table, is_closed, submesh

# Signed volumes up to this share of area^1.5 are rounding, and do not tell which side is outside.
# A ball has 0.094.
NEGLIGIBLE_VOLUME = 1e-10


@one_blas_thread()
def orient_outward(mesh: MeshLike) -> TriangleMesh:
    """Turn all faces of a surface over if they face inward where it touches its convex hull.

    Where a surface touches its convex hull, its outside is the outside of the hull. This also holds
    for a part or for a scan from one side, whose signed volume says nothing.

    Parameters
    ----------
    mesh : MeshLike
        Consistently oriented, because all faces are turned together.

    Returns
    -------
    TriangleMesh
        The mesh itself if it faces outward already, or is flat.

    Raises
    ------
    InvalidShapeError
        If two neighboring faces are turned against each other.

    See Also
    --------
    repair : "orient" turns single faces over so that neighbors agree.

    Notes
    -----
    The corners of each facet of the hull vote by N · n, weighted by the area of the facet, with N
    the normal of the surface and n that of the facet. The result is right for a surface seen from
    outside. A room scanned from within, or a bowl without its outer side, is turned over.

    Examples
    --------
    >>> import eigenshape as es
    >>> sphere = es.icosphere(1)
    >>> inverted = es.TriangleMesh(sphere.vertices, sphere.faces[:, ::-1])
    >>> es.geometry.enclosed_volume(inverted) < 0
    True
    >>> es.geometry.enclosed_volume(es.geometry.orient_outward(inverted)) > 0
    True
    """
    mesh = as_mesh(mesh)
    require_oriented(mesh)
    return mesh if outward_vote(mesh) >= 0 else TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def outward_vote(mesh: TriangleMesh) -> float:
    """Return how far normals agree with those of the convex hull, -1 to 1; 0 for a flat surface."""
    points, _ = scale_to_unit(mesh)
    try:
        hull = ConvexHull(points)
    except QhullError:
        return 0.0
    areas = triangle_areas(points[hull.simplices])
    means = mean_normals(mesh)[hull.simplices].mean(axis=1)
    return float(areas @ np.einsum("fi,fi->f", means, hull.equations[:, :3]) / areas.sum())


def orient_closed_outward(mesh: TriangleMesh) -> TriangleMesh:
    """Turn all faces of a closed mesh over if its signed volume is negative.

    An open mesh, whose signed volume says nothing, is returned as it is; `orient_outward` decides
    for those.

    Raise InvalidShapeError if two neighboring faces of a closed mesh are turned against each other.
    """
    if not is_closed(mesh) or enclosed_volume(mesh) >= 0:
        return mesh
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def faces_to_turn(
    mesh: TriangleMesh,
) -> tuple[Bool[np.ndarray, " f"], Bool[np.ndarray, " f"], Int[np.ndarray, " f"]]:
    """Find which faces to turn over so that neighbors agree and pieces face outward.

    A closed piece faces outward if its signed volume is positive. A closed piece inside another one
    is turned together with the outermost, because it may be a cavity, whose faces look into it. An
    open piece whose faces agree is left as it is; any other open piece is turned as a whole by
    `orient_outward`. Pieces end at edges with more than two faces.

    Returns
    -------
    turned : (f,) bool
        Whether to turn each face over.
    one_sided : (f,) bool
        Whether the piece of each face cannot be oriented, such as a Möbius strip. Such a piece is
        not turned.
    piece : (f,) int
        The piece of each face.
    """
    turns = face_turns(mesh)
    agreed = turn_faces(mesh, turns.turned)
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
    """Tell for each closed piece whether it, or the outermost piece around it, faces inward."""
    corners, _ = scaled_corners(mesh)
    rows = np.argsort(piece, kind="stable")
    starts = np.searchsorted(piece[rows], closed)
    ends = np.searchsorted(piece[rows], closed, side="right")
    pieces = [corners[rows[start:end]] for start, end in zip(starts, ends, strict=True)]
    inward = np.zeros(len(pieces), dtype=bool)
    for number, faces in enumerate(pieces):
        # A tiny piece is scaled up first, because its volume would underflow.
        local, _ = size_one(faces - faces.mean(axis=(0, 1)))
        a, b, c = local.transpose(1, 0, 2)
        volume = float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6
        area = float(triangle_areas(local).sum())
        inward[number] = area > 0 and volume / area**1.5 < -NEGLIGIBLE_VOLUME
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


def _winding_number(corners: Float[np.ndarray, "f 3 3"], point: Float[np.ndarray, "3"]) -> float:
    """Return how often closed faces wind around a point: ±1 inside, 0 outside.

    The sum of the faces' solid angles (Van Oosterom and Strackee 1983).
    """
    a, b, c = (corners - point).transpose(1, 0, 2)
    one, two, three = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    products = [np.einsum("ij,ij->i", *pair) for pair in ((b, c), (c, a), (a, b))]
    below = one * two * three + products[0] * one + products[1] * two + products[2] * three
    return float(np.arctan2(volume, below).sum() / (2 * np.pi))
