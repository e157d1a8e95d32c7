"""Make a surface of a depth scan, along the grid of its pixels."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import Delaunay

from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import area_vectors, size_one
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_report import RepairedMesh
from eigenshape.geometry.topology import submesh

# Measured pixels are connected if their depths differ by at most this many times their distance in
# the picture, in pixels: surfaces are connected up to a slant of 83 degrees.
LARGEST_JUMP = 8.0
# Largest distance, in columns or rows, of pixels that are connected across pixels that measured
# nothing. A surface that turns away loses many of its pixels.
LARGEST_GAP = 3
# Distance in pixels from the picture to the corners that bound the triangulation of gaps. They lie
# outside every circle through three pixels at most LARGEST_GAP apart, whose radius is below 40.
FAR = 100.0


def pixel_faces(depth: Float[np.ndarray, "h w"], focal: float) -> Int[np.ndarray, "f 3"]:
    """Connect the measured pixels of a picture where they see one surface.

    Each square of four measured pixels gives two triangles, along the diagonal with the smaller
    jump. Elsewhere the triangles are those of Delaunay in the plane of the picture, if no side of
    them is longer than 3 columns or rows, so that single lost pixels leave no holes.

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
    measured = np.isfinite(depth)
    is_full = measured[:-1, :-1] & measured[:-1, 1:] & measured[1:, 1:] & measured[1:, :-1]
    # Two triangles of each full square, along the diagonal with the smaller jump.
    a = np.flatnonzero(np.pad(is_full, ((0, 1), (0, 1))))
    b, c, d = a + 1, a + depth.shape[1] + 1, a + depth.shape[1]
    flat = depth.ravel()
    along = np.abs(flat[a] - flat[c]) <= np.abs(flat[b] - flat[d])
    one = np.where(along[:, None], np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    two = np.where(along[:, None], np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    # The small Delaunay triangles of the measured pixels that lie in no full square.
    # The corners of these triangles belong to a square that is not full, and full squares are
    # cells of the Delaunay triangulation. So it needs only those pixels; what it has within full
    # squares is left out.
    beside = np.zeros_like(measured)
    for rows in (slice(None, -1), slice(1, None)):
        for columns in (slice(None, -1), slice(1, None)):
            beside[rows, columns] |= ~is_full
    pixels = np.argwhere(measured & beside)
    n_rows, n_columns = measured.shape
    bottom, right = n_rows + FAR, n_columns + FAR
    bounds = [[-FAR, -FAR], [-FAR, right], [bottom, -FAR], [bottom, right]]
    triangles = Delaunay(np.concatenate([pixels, bounds])).simplices
    triangles = triangles[(triangles < len(pixels)).all(axis=1)]

    places = pixels[triangles]
    rows, columns = (places.sum(axis=1) // 3).T  # the square in which the middle lies
    outside = ~is_full[np.minimum(rows, n_rows - 2), np.minimum(columns, n_columns - 2)]
    small = np.ptp(places, axis=1).max(axis=1) <= LARGEST_GAP
    triangles, places = triangles[outside & small], places[outside & small]

    # Faces turn as the squares do: from the columns to the rows.
    first, second = (places[:, 1] - places[:, 0]).T, (places[:, 2] - places[:, 0]).T
    turn = first[1] * second[0] - first[0] * second[1]
    triangles = np.where(turn[:, None] < 0, triangles[:, ::-1], triangles)[turn != 0]
    numbers = pixels[:, 0] * n_columns + pixels[:, 1]
    faces = np.concatenate([one, two, numbers[triangles]])

    # A face may be as deep as its extent in the picture allows.
    places = np.stack(np.divmod(faces, depth.shape[1]), axis=2)
    extents = np.ptp(places, axis=1).max(axis=1)
    depths = depth.ravel()[faces]
    widths = depths.mean(axis=1) / focal
    return faces[np.ptp(depths, axis=1) <= LARGEST_JUMP * extents * widths]


def triangulate_frame(points: Float[np.ndarray, "h w 3"]) -> RepairedMesh[TriangleMesh]:
    """Connect the pixels of a depth scan whose camera was at the origin, across small gaps too.

    Each vertex is a measured point. The width of a pixel is measured: the median angle between the
    rays of neighboring pixels.

    Raise InvalidShapeError if no three neighboring pixels see one surface.

    Parameters
    ----------
    points : (h, w, 3) float
        What each pixel saw. A point that is not finite, or is the origin, was not measured.

    Returns
    -------
    RepairedMesh
        The surface, which faces the camera; the pixel of each vertex, numbered row by row; and a
        report of one sentence.
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
