"""Make a surface of a frame of a depth camera, along the grid of its pixels."""

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import area_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repair_report import RepairedMesh
from eigenshape.geometry.simplices import size_one
from eigenshape.geometry.topology import submesh

# Neighboring pixels are connected if their depths differ by at most this many times the width of a
# pixel at that depth. A larger value connects limbs with what lies behind them.
LARGEST_JUMP = 4.0


def pixel_faces(depth: Float[np.ndarray, "h w"], focal: float) -> Int[np.ndarray, "f 3"]:
    """Make two triangles of each square of pixels, along the diagonal with the smaller jump.

    Parameters
    ----------
    depth : (h, w) float
        Depth of each pixel; infinite where nothing was measured.
    focal : float
        Pixels across one unit of length at depth 1.

    Returns
    -------
    (f, 3) int
        Pixels, numbered row by row. Triangles across a jump in depth are left out.
    """
    corner = np.arange(depth.size).reshape(depth.shape)
    a, b, c, d = (
        part.ravel()
        for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    )
    flat = depth.ravel()
    with np.errstate(invalid="ignore"):
        along = ~(np.abs(flat[a] - flat[c]) > np.abs(flat[b] - flat[d]))
    one = np.where(along[:, None], np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    two = np.where(along[:, None], np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    faces = np.concatenate([one, two])
    faces = faces[np.isfinite(flat[faces]).all(axis=1)]
    depths = flat[faces]
    return faces[np.ptp(depths, axis=1) <= LARGEST_JUMP * depths.mean(axis=1) / focal]


def triangulate_frame(points: Float[np.ndarray, "h w 3"]) -> RepairedMesh[TriangleMesh]:
    """Connect neighboring pixels of a frame whose camera was at the origin.

    The width of a pixel is measured: the median angle between the rays of neighboring pixels.

    Parameters
    ----------
    points : (h, w, 3) float
        What each pixel saw. A point that is not finite, or is the origin, was not measured.

    Returns
    -------
    RepairedMesh
        The surface, which faces the camera; the pixel of each vertex, numbered row by row; and a
        report of one sentence.

    Raises
    ------
    InvalidShapeError
        If no three neighboring pixels see one surface.
    """
    n_rows, n_columns, _ = points.shape
    seen = np.isfinite(points).all(axis=2) & points.any(axis=2)
    placed, scale = size_one(np.where(seen[:, :, None], points, 0))
    distance = np.where(seen, np.linalg.norm(placed, axis=2), np.inf)
    rays = placed / distance[:, :, None]
    angles = [
        np.linalg.norm(rays[1:] - rays[:-1], axis=2)[seen[1:] & seen[:-1]],
        np.linalg.norm(rays[:, 1:] - rays[:, :-1], axis=2)[seen[:, 1:] & seen[:, :-1]],
    ]
    width = float(np.median(np.concatenate([*angles, [0.0]])))
    faces = pixel_faces(distance, 1 / width) if width > 0 else np.empty((0, 3), np.int64)
    if not len(faces):
        raise InvalidShapeError(
            f"A frame must show a surface; of {n_rows} x {n_columns} pixels, {seen.sum()} measured "
            "a point, and no three neighbors see one surface. Check that the camera is at the "
            "origin of the coordinates."
        )
    corners = placed.reshape(-1, 3)[faces]
    if np.einsum("fi,fi->", area_vectors(corners), corners.mean(axis=1)) > 0:
        faces = faces[:, ::-1]  # towards the camera, whichever way rows are counted
    whole = TriangleMesh(placed.reshape(-1, 3) * scale, faces)
    mesh, pixels = submesh(whole, np.ones(len(faces), dtype=bool))
    sentence = (
        f"triangulate_frame joined {len(pixels):,} pixels of a frame of {n_rows} x {n_columns} to "
        f"{mesh.n_faces:,} faces"
    )
    return RepairedMesh(mesh, (sentence,), pixels)
