"""Intrinsic triangulations: edge lengths made fit to live with, the tufted cover, Delaunay flips."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import record
from certeig.kit.errors import ConvergenceError
from eigenshape._corners import edge_keys, side_ends
from eigenshape._vectors import row_dots, unit_vectors
from eigenshape.operators import flip_loops

# a pair of cotangents that sums to less below zero is cocircular, relative to the terms in it
TOLERANCE = 1e-12
# Smallest margin of the triangle inequalities, in mean edge lengths (Sharp and Crane 2020).
MOLLIFY = 1e-5
MOST_FLIPS = 1000  # a side: far more than any shape takes, which is about one


@record
class Triangulation:
    """Triangles that know lengths only, glued along whole sides into a surface without boundary.

    Triangle f has the sides 3f, 3f + 1, 3f + 2 in turn. Two corners of a triangle may be one
    vertex, and two of its sides one edge.

    Attributes
    ----------
    tails : (h,) int
        Vertex at which each side starts.
    twins : (h,) int
        Side that each lies on, run the other way.
    lengths : (h,) float
        Length of each side.
    """

    tails: Int[np.ndarray, " h"]
    twins: Int[np.ndarray, " h"]
    lengths: Float[np.ndarray, " h"]


def mollify_lengths(
    lengths: Float[np.ndarray, " h"], edges: Int[np.ndarray, " h"], factor: float
) -> Float[np.ndarray, " h"]:
    """Lengthen all sides by one amount, the least that leaves every triangle inequality a margin.

    The margin is `factor` times the mean edge length (Sharp and Crane 2020); sides are left as they
    are where every triangle has it. `edges` numbers the edge of each side.
    """
    _, firsts = np.unique(edges, return_index=True)
    margin = factor * lengths[firsts].mean()
    a, b, c = lengths.reshape(-1, 3).T
    slack = np.minimum(np.minimum(a + b - c, b + c - a), c + a - b)
    return lengths + max(0.0, float((margin - slack).max()))


def tufted_cover(
    points: Float[np.ndarray, "n 3"],
    faces: Int[np.ndarray, "f 3"],
    lengths: Float[np.ndarray, " h"],
) -> Triangulation:
    """Give each face a front and a back and glue these around each edge (Sharp and Crane 2020).

    Around an edge the front of one face meets what it faces: the back or front of the next face by
    angle. So any number of faces at an edge, turned any way, make a surface that is a manifold but
    for its vertices.
    """
    n_sides = 3 * len(faces)
    of_front, heads = side_ends(faces)
    fronts = np.arange(n_sides)
    # The back of (a, b, c) is (b, a, c): its sides are those of the front in the order 0, 2, 1.
    backs = n_sides + (fronts.reshape(-1, 3)[:, [0, 2, 1]]).ravel()
    tails = np.concatenate([of_front, faces[:, [1, 0, 2]].ravel()])
    of_back = lengths.reshape(-1, 3)[:, [0, 2, 1]].ravel()

    forward = of_front < heads
    up, down = np.where(forward, fronts, backs), np.where(forward, backs, fronts)
    # Sort the sides by edge and angle around it. The order around an edge of two faces does not
    # matter.
    keys = edge_keys(faces, len(points))
    order = np.argsort(keys, kind="stable")
    starts = np.flatnonzero(np.diff(keys[order], prepend=-1))
    counts = np.diff(np.append(starts, len(order)))
    crowded = np.repeat(counts > 2, counts)
    if crowded.any():
        sides = order[crowded]
        crowd = np.repeat(starts, counts)[crowded]
        # The angle at which the face of each side stands around its edge.
        face, corner = np.divmod(sides, 3)
        tail, head, apex = (faces[face, (corner + step) % 3] for step in range(3))
        low, high = np.minimum(tail, head), np.maximum(tail, head)
        along = unit_vectors(points[high] - points[low])
        out = points[apex] - points[low]
        out -= row_dots(out, along)[:, None] * along
        # Angles start from the face whose apex is farthest from the edge, which rounding has blurred
        # least.
        best = np.lexsort((sides, -np.linalg.norm(out, axis=1), crowd))
        groups, inverse = np.unique(crowd, return_inverse=True)
        zero = out[best[np.searchsorted(crowd[best], groups)]][inverse]
        quarter = np.cross(along, zero)
        angles = np.arctan2(row_dots(out, quarter), row_dots(out, zero))
        # Faces with the same corners lie in one order seen from any of their sides: seen against it,
        # from the last.
        between = (low < apex) & (apex < high)
        ties = np.where(between, -face, face)
        order[crowded] = sides[np.lexsort((ties, angles, keys[sides]))]
    place = np.arange(len(order)) + 1
    place[starts + counts - 1] = starts
    following = order[place]
    twins = np.empty(2 * n_sides, dtype=np.int64)
    twins[up[order]] = down[following]
    twins[down[following]] = up[order]
    return Triangulation(tails, twins, np.concatenate([lengths, of_back]))


def flip_to_delaunay(cover: Triangulation, tolerance: float = TOLERANCE) -> Triangulation:
    """Flip edges until the two angles opposite to each sum to 180° at most (Sharp and Crane 2020).

    Raise ConvergenceError if flips do not end, which for lengths of triangles they do.
    """
    tails, twins, lengths = cover.tails.copy(), cover.twins.copy(), cover.lengths.copy()
    most = MOST_FLIPS * len(tails)
    queue, waiting = np.empty(len(tails), np.int64), np.zeros(len(tails), bool)
    if flip_loops.flip_edges(tails, twins, lengths, tolerance, most, queue, waiting) < 0:
        raise ConvergenceError(
            f"Flips to Delaunay must end; {most} flips of {len(tails) // 2} edges did not."
        )
    return Triangulation(tails, twins, lengths)
