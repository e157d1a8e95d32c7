"""A z-buffer in NumPy, for partial scans and for pictures."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

# Pairs of a face and a pixel in its bounding box that are tested at a time; a pair takes about 100
# bytes.
CANDIDATES_AT_ONCE = 2_000_000
# Twice the area, in square pixels, up to which a face is seen from its edge and covers no pixel.
LEAST_DOUBLED_AREA = 1e-12
# Pixels this far outside a face, in barycentric coordinates, count as inside, so that rounding
# leaves no gap between two faces.
EDGE_SLACK = 1e-9


@dataclass(frozen=True, eq=False)
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


def rasterize(
    points: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "f 3"], width: int, height: int
) -> Raster:
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
    depth = np.full(width * height, -np.inf)
    face = np.full(width * height, -1, dtype=np.int64)
    weights = np.zeros((width * height, 3))
    corners = points[faces]
    for candidates in _chunks(corners, width, height):
        index, pixel, inside = _find_covered_pixels(corners, candidates, width)
        height_there = np.einsum("ij,ij->i", inside, corners[index, :, 2])
        before = depth[pixel]
        np.maximum.at(depth, pixel, height_there)
        # Of faces at equal height the one with the lowest index must win: faces of earlier chunks
        # are not overwritten, and within a chunk faces are written in reverse order.
        nearest = np.flatnonzero((height_there == depth[pixel]) & (height_there > before))[::-1]
        face[pixel[nearest]] = index[nearest]
        weights[pixel[nearest]] = inside[nearest]
    return Raster(
        face.reshape(height, width), weights.reshape(height, width, 3), depth.reshape(height, width)
    )


def _chunks(
    corners: Float[np.ndarray, "f 3 3"], width: int, height: int
) -> Iterator[Int[np.ndarray, "k 5"]]:
    """Yield rows (face, left, top, columns, rows): the box of pixels that a face may cover."""
    size = np.array([width, height])
    low = np.clip(np.ceil(corners[:, :, :2].min(axis=1) - 0.5), 0, size).astype(np.int64)
    high = np.clip(np.floor(corners[:, :, :2].max(axis=1) - 0.5) + 1, 0, size).astype(np.int64)
    span = np.maximum(high - low, 0)
    seen = np.flatnonzero(
        (span.prod(axis=1) > 0) & (np.abs(_doubled_area(corners)) > LEAST_DOUBLED_AREA)
    )
    boxes = _bands(np.column_stack([seen, low[seen], span[seen]]))
    ends = np.cumsum(boxes[:, 3] * boxes[:, 4])
    if len(boxes):
        limits = np.arange(CANDIDATES_AT_ONCE, ends[-1], CANDIDATES_AT_ONCE)
        yield from np.split(boxes, np.unique(np.searchsorted(ends, limits)))


def _bands(boxes: Int[np.ndarray, "k 5"]) -> Int[np.ndarray, "b 5"]:
    """Split boxes with too many pixels into bands of rows; leave the other boxes as they are."""
    columns, rows = boxes[:, 3:].T
    rows_at_once = np.clip(CANDIDATES_AT_ONCE // columns, 1, rows)
    counts = -(-rows // rows_at_once)
    box = np.repeat(np.arange(len(boxes)), counts)
    band = np.arange(len(box)) - np.repeat(np.cumsum(counts) - counts, counts)
    above = band * rows_at_once[box]
    bands = boxes[box]
    bands[:, 2] += above
    bands[:, 4] = np.minimum(rows_at_once[box], rows[box] - above)
    return bands


def _find_covered_pixels(
    corners: Float[np.ndarray, "f 3 3"], boxes: Int[np.ndarray, "k 5"], width: int
) -> tuple[Int[np.ndarray, " c"], Int[np.ndarray, " c"], Float[np.ndarray, "c 3"]]:
    """Return face, pixel and barycentric coordinates wherever a pixel lies in the face of a box."""
    face, left, top, columns, rows = boxes.T
    counts = columns * rows
    place = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    across = np.repeat(columns, counts)
    down, right = np.divmod(place, across)
    first, by_column, by_row = (
        np.repeat(part, counts, axis=0) for part in _weight_planes(corners[face], left, top)
    )
    weights = first + by_column * right[:, None] + by_row * down[:, None]
    weights = np.column_stack([1 - weights.sum(axis=1), weights])
    inside = np.flatnonzero((weights >= -EDGE_SLACK).all(axis=1))
    pixel = np.repeat(top * width + left, counts)[inside] + down[inside] * width + right[inside]
    return np.repeat(face, counts)[inside], pixel, weights[inside]


def _weight_planes(
    corners: Float[np.ndarray, "k 3 3"], left: Int[np.ndarray, " k"], top: Int[np.ndarray, " k"]
) -> tuple[Float[np.ndarray, "k 2"], Float[np.ndarray, "k 2"], Float[np.ndarray, "k 2"]]:
    """Return the weights of corners 1 and 2 at the first pixel, and their change per pixel.

    The second result is the change per column, the third the change per row.
    """
    origin, one, two = corners[:, :, :2].transpose(1, 0, 2)
    to_one, to_two = one - origin, two - origin
    here = np.column_stack([left + 0.5, top + 0.5]) - origin
    scale = 1 / _doubled_area(corners)
    by_column = np.column_stack([to_two[:, 1] * scale, -to_one[:, 1] * scale])
    by_row = np.column_stack([-to_two[:, 0] * scale, to_one[:, 0] * scale])
    return by_column * here[:, :1] + by_row * here[:, 1:], by_column, by_row


def _doubled_area(corners: Float[np.ndarray, "k 3 3"]) -> Float[np.ndarray, " k"]:
    origin, one, two = corners[:, :, :2].transpose(1, 0, 2)
    to_one, to_two = one - origin, two - origin
    return to_one[:, 0] * to_two[:, 1] - to_one[:, 1] * to_two[:, 0]
