"""Thickness of a solid below points of its surface, by inscribed balls."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

# Cosine of the widest angle between the normal and the chord of an inscribed ball. Beyond it, the
# ball touches the same side of the surface, where noise decides its radius.
LEAST_COSINE = 0.3
# A ball that shrinks by less than this share holds no further point; radii are not needed to more
# digits.
SHRINKAGE = 1e-6
# Nearly all balls stop shrinking in five rounds.
N_ROUNDS = 12


def inscribed_radii(
    tree: KDTree,
    normals: Float[np.ndarray, "n 3"],
    chosen: Int[np.ndarray, " m"],
    largest: float,
) -> Float[np.ndarray, " m"]:
    """Return the radii of the largest balls that touch the surface at points from inside.

    A ball shrinks until it holds no other point (Ma, Bae and Choi 2012): through the touching point
    p and a point q inside, the ball with its center at p - R n has the radius
    R = |p - q|² / (2 (p - q) · n).

    Parameters
    ----------
    tree : KDTree
        Of points of the surface.
    normals : (n, 3) float
        Outward unit normals of the points.
    chosen : (m,) int
        The points at which balls touch.
    largest : float
        Radius from which the balls shrink, as long as the points' coordinates.
    """
    points = tree.data
    radii = np.full(len(chosen), largest)
    live = np.arange(len(chosen))
    for _ in range(N_ROUNDS):
        here, inward = points[chosen[live]], -normals[chosen[live]]
        gaps, nearest = tree.query(here + radii[live, None] * inward)
        inside = gaps < radii[live] * (1 - SHRINKAGE)
        live = live[inside]
        chords = points[nearest[inside]] - here[inside]
        heights = np.einsum("mi,mi->m", chords, inward[inside])
        squares = np.einsum("mi,mi->m", chords, chords)
        facing = heights > LEAST_COSINE * np.sqrt(squares)
        live = live[facing]
        if not len(live):
            break
        radii[live] = squares[facing] / (2 * heights[facing])
    return radii
