"""Kernels of `geodesic`: waves that start at some vertices and cross unfolded triangles.

`fans` holds `starts`, `corners` and `lengths`. Entries starts[v] to starts[v + 1] are the neighbors of
vertex v, one after the other around it: each by its number, its distance, and its distance from the
next, which is -1 where no triangle is in between.

`scratch` holds, for each vertex: its distance (infinite on entry and on return), whether it is settled
(False on entry and on return), its source, and its place in the heap; then the keys and vertices of
the heap. `reached` and `distances` are scratch, too, where a kernel fills rows.
"""

import numpy as np
from jaxtyping import Bool, Float64, Int32, Int64

from certeig.kit.kernels import Out, kernel

Values = Float64[np.ndarray, " n_starts-1"]
Numbers = Int64[np.ndarray, " n_starts-1"]

Fans = tuple[Int64[np.ndarray, " n_starts"], Int32[np.ndarray, " k"], Float64[np.ndarray, "k 2"]]
Scratch = tuple[
    Out[Values],
    Out[Bool[np.ndarray, " n_starts-1"]],
    Out[Numbers],
    Out[Numbers],
    Out[Values],
    Out[Numbers],
]


@kernel("n_faces", "n")
def list_fans(
    faces: Int64[np.ndarray, "n_faces 3"],
    sides: Float64[np.ndarray, "n_faces 3"],
    listing: tuple[
        Out[Int64[np.ndarray, " n_faces*3"]],
        Out[Int64[np.ndarray, " n+1"]],
        Out[Int64[np.ndarray, " n_faces*3"]],
        Out[Int64[np.ndarray, " n"]],
        Out[Int64[np.ndarray, " n"]],
    ],
    fans: tuple[
        Out[Int64[np.ndarray, " n+1"]],
        Out[Int32[np.ndarray, " n_faces*6"]],
        Out[Float64[np.ndarray, "n_faces*6 2"]],
    ],
) -> None:
    """List the fans of triangles, of which `sides` has the lengths: from corner 0 to 1, 1 to 2 and 2 to 0.

    `listing` is scratch. Its last two arrays have -1 and 0 for each vertex on entry.
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

    Wave i fills the next counts[i] entries of `reached` with the vertices within `radius`, and of
    `distances`. It begins only if a wave over all vertices would fit there.
    """


@kernel("n_starts", "n_rows")
def fill_rows(
    fans: Fans,
    radius: float,
    sources: Int64[np.ndarray, " _"],
    ends: Int64[np.ndarray, " n_rows"],
    scratch: Scratch,
    reached: Out[Numbers],
    distances: Out[Values],
    rows: Out[Float64[np.ndarray, "n_rows n_starts-1"]],
) -> None:
    """Write the distances of all vertices from each set of sources, infinite beyond `radius`.

    Set i begins where the one before it ends, and ends before `ends[i]`.
    """


@kernel("n_starts", "n_chosen", "n_rows")
def choose_farthest(
    fans: Fans,
    radius: float,
    scratch: Scratch,
    reached: Out[Numbers],
    distances: Out[Values],
    chosen: Out[Int64[np.ndarray, " n_chosen"]],
    least: Out[Values],
    nearest: Out[Numbers],
    rows: Out[Float64[np.ndarray, "n_rows n_starts-1"]],
) -> None:
    """Choose vertices, each as far as possible from those before, and the first from vertex 0.

    Write also the distance of each vertex from the nearest of them, by number, and as many rows of
    distances from each as `rows` has. Waves end at `radius`, but no earlier than they come nearest.
    """
