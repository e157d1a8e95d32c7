"""Kernels of `geodesic`: a wave that starts at some vertices and crosses unfolded triangles."""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from certeig.kit.kernels import Out, kernel

Fans = tuple[
    Int64[np.ndarray, " n_starts"],
    Int64[np.ndarray, " k"],
    Int64[np.ndarray, " k"],
    Float64[np.ndarray, "k 7"],
]
Scratch = tuple[
    Out[Float64[np.ndarray, " n_starts-1"]],
    Out[Bool[np.ndarray, " n_starts-1"]],
    Out[Int64[np.ndarray, " n_starts-1"]],
    Out[Int64[np.ndarray, " n_starts-1"]],
    Out[Float64[np.ndarray, " n_waves"]],
    Out[Int64[np.ndarray, " n_waves"]],
]


@kernel("n_sources")
def spread_wave(
    fans: Fans,
    radius: float,
    sources: Int64[np.ndarray, " n_sources"],
    scratch: Scratch,
    reached: Out[Int64[np.ndarray, " n_starts-1"]],
    distances: Out[Float64[np.ndarray, " n_starts-1"]],
) -> int:
    """Fill the vertices within `radius` of some sources and their distances; return their number.

    `fans` holds `starts`, `first_corner`, `second_corner` and `sides`. Entries starts[v] to
    starts[v + 1] are the triangles at vertex v: their other two corners, and seven lengths: from v
    to each of these, between them, and the place of either in coordinates along the edge from v to
    the other one and away from it.

    `scratch` holds, for each vertex: its distance (infinite on entry and on return), whether it is
    settled (False on entry and on return), its source, and a list of the vertices that were
    touched. It also holds the keys and vertices of the heap, which has one entry for each corner of
    a triangle and each source, since a triangle sends at most three waves.
    """


@kernel("n_starts", "n_sources", "room")
def spread_waves(
    fans: Fans,
    radius: float,
    sources: Int64[np.ndarray, " n_sources"],
    scratch: Scratch,
    counts: Out[Int64[np.ndarray, " _"]],
    reached: Out[Int64[np.ndarray, " room"]],
    distances: Out[Float64[np.ndarray, " room"]],
) -> int:
    """Spread one wave from each source, and return for how many sources there was room.

    Wave i fills the next counts[i] entries of `reached` and `distances`. It begins only if a wave
    over all vertices would fit there. The other arguments are those of `spread_wave`.
    """
