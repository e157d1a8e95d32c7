"""Kernels of `crossings`: a tree of boxes, and whether two faces cross.

The corners of face i are `points[3 i : 3 i + 3]`. Faces are in the order of the tree's leaves.
"""

import numpy as np
from jaxtyping import Float64, Int64

from certeig.kit.kernels import Out, kernel

Boxes = Float64[np.ndarray, "n_faces 6"]
Numbers = Int64[np.ndarray, " n_faces"]

LEAF = 4  # most faces of a leaf; more means fewer nodes but more pairs of faces to compare
FIRST_ROOM = 64  # pairs for which there is memory at first; most surfaces have none


def face_boxes(points: Float64[np.ndarray, "_ 3"]) -> Boxes:
    """Return the least and the largest coordinates of each face."""
    boxes = np.empty((len(points) // 3, 6))
    fill_face_boxes(points.reshape(-1, 3, 3), boxes)
    return boxes


@kernel("n_faces")
def fill_face_boxes(corners: Float64[np.ndarray, "n_faces 3 3"], boxes: Out[Boxes]) -> None:
    """Fill what `face_boxes` returns."""


def curve_places(boxes: Boxes) -> Numbers:
    """Return the place of each box center on Morton's curve through 2^20 cells per side."""
    places = np.empty(len(boxes), dtype=np.int64)
    fill_curve_places(boxes, places)
    return places


@kernel("n_faces")
def fill_curve_places(boxes: Boxes, places: Out[Numbers]) -> None:
    """Fill what `curve_places` returns."""


def box_tree(boxes: Boxes) -> tuple[int, Float64[np.ndarray, "k 6"]]:
    """Return the levels and the boxes of a complete binary tree of 2^levels leaves.

    The children of node k are 2 k + 1 and 2 k + 2.
    """
    levels = ((len(boxes) - 1) // LEAF).bit_length()
    nodes = np.empty(((2 << levels) - 1, 6))
    fill_box_tree(boxes, levels, nodes)
    return levels, nodes


@kernel("n_faces")
def fill_box_tree(
    boxes: Boxes,
    levels: int,
    nodes: Out[Float64[np.ndarray, "(2<<levels)-1 6"]],
) -> None:
    """Fill the boxes that `box_tree` returns."""


def crossing_pairs(points: Float64[np.ndarray, "_ 3"], boxes: Boxes) -> Int64[np.ndarray, "p 2"]:
    """Return the pairs of faces that cross, in no particular order."""
    corners, (levels, nodes) = points.reshape(-1, 3, 3), box_tree(boxes)
    axes = np.empty(len(boxes), dtype=np.int64)
    count, pairs = FIRST_ROOM, np.empty((0, 2), dtype=np.int64)
    while count > len(pairs):
        pairs = np.empty((count, 2), dtype=np.int64)
        count = find_crossings(corners, boxes, levels, nodes, axes, pairs)
    return pairs[:count]


@kernel("n_faces", "room")
def find_crossings(
    corners: Float64[np.ndarray, "n_faces 3 3"],
    boxes: Boxes,
    levels: int,
    nodes: Float64[np.ndarray, "(2<<levels)-1 6"],
    axes: Out[Numbers],
    pairs: Out[Int64[np.ndarray, "room 2"]],
) -> int:
    """Fill the pairs for which there is room, and return how many there are; `axes` is scratch."""
