"""A z-buffer, for partial scans and for pictures."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import record
from eigenshape.scans.raster_loops import fill_buffer, fill_depth

# Twice the area, in square pixels, up to which a face is seen from its edge and covers no pixel.
LEAST_DOUBLED_AREA = 1e-12
# Pixels this far outside a face, in barycentric coordinates, count as inside, so that rounding
# leaves no gap between two faces.
EDGE_SLACK = 1e-9


@record
class Raster:
    """The nearest face at each pixel.

    Attributes
    ----------
    face : (h, w) int
        Index of the face, or -1 where there is none.
    weights : (h, w, 3) float
        Barycentric coordinates of the middle of the pixel in its face.
    depth : (h, w) float
        Third coordinate of that point; minus infinity where there is no face.
    """

    face: Int[np.ndarray, "h w"]
    weights: Float[np.ndarray, "h w 3"]
    depth: Float[np.ndarray, "h w"]

    @classmethod
    def of(
        cls,
        points: Float[np.ndarray, "n 3"],
        faces: Int[np.ndarray, "f 3"],
        width: int,
        height: int,
    ) -> "Raster":
        """Find the nearest face at the middle of each pixel.

        Parameters
        ----------
        points : (n, 3) float
            Columns: pixels to the right, pixels down, and height towards the viewer. The middle of the
            first pixel is at (0.5, 0.5).
        faces : (f, 3) int
            Corners of each face.
        width, height : int
            Size of the picture, in pixels.

        Returns
        -------
        Raster
            Of two faces at the same height the one with the lower index is visible.
        """
        depth = np.full((height, width), -np.inf)
        face = np.full((height, width), -1, dtype=np.int64)
        weights = np.zeros((height, width, 3))
        corners = np.ascontiguousarray(faces, dtype=np.int64)
        places = np.ascontiguousarray(points, dtype=np.float64)
        fill_buffer(places, corners, LEAST_DOUBLED_AREA, EDGE_SLACK, face, weights, depth)
        return cls(face, weights, depth)


def depths_at(
    points: Float[np.ndarray, "n 3"],
    faces: Int[np.ndarray, "f 3"],
    pixels: Int[np.ndarray, "p 2"],
    size: int,
) -> Float[np.ndarray, " p"]:
    """Return the `depth` of a square `Raster` at some pixels, each a column and a row."""
    column, row = pixels.T
    depth = np.full((size, size), np.inf)
    depth[row, column] = -np.inf
    fill_depth(points, faces, LEAST_DOUBLED_AREA, EDGE_SLACK, depth)
    return depth[row, column]
