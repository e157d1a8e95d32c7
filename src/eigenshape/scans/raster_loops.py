"""Kernels of `raster`: a z-buffer."""

import numpy as np
from jaxtyping import Float64, Int64

from certeig.kit.kernels import Out, kernel


@kernel("n_faces", "height", "width")
def fill_buffer(
    points: Float64[np.ndarray, "n 3"],
    faces: Int64[np.ndarray, "n_faces 3"],
    least_doubled_area: float,
    slack: float,
    face_at: Out[Int64[np.ndarray, "height width"]],
    weights: Out[Float64[np.ndarray, "height width 3"]],
    depth: Out[Float64[np.ndarray, "height width"]],
) -> None:
    """Write the nearest face at the middle of each pixel, its weights there, and its height.

    `depth` is minus infinity on entry, `face_at` -1 and `weights` 0. Of faces at equal height the
    one with the lowest index stays, because later ones must be higher.
    """


@kernel("n_faces", "height", "width")
def fill_depth(
    points: Float64[np.ndarray, "n 3"],
    faces: Int64[np.ndarray, "n_faces 3"],
    least_doubled_area: float,
    slack: float,
    depth: Out[Float64[np.ndarray, "height width"]],
) -> None:
    """Write the height of the nearest face at each pixel that is minus infinity on entry.

    Pixels that are infinite on entry stay so, which takes a third of the time.
    """
