"""Kernels of `matching`: agreement of pairs, points placed by distances, and nearest points of faces."""

import numpy as np
from jaxtyping import Complex64, Float, Float32, Float64, Int64

from certeig.kit.kernels import Out, kernel


@kernel("n_pairs", "n_ours", "n_theirs")
def couple_pairs(
    points: Int64[np.ndarray, " n_pairs"],
    images: Int64[np.ndarray, " n_pairs"],
    part: tuple[
        Float32[np.ndarray, "n_ours n_ours"],
        Float32[np.ndarray, "n_ours n_ours"],
        Complex64[np.ndarray, "n_ours n_ours"],
    ],
    whole: tuple[
        Float32[np.ndarray, "n_theirs n_theirs"],
        Float32[np.ndarray, "n_theirs n_theirs"],
        Complex64[np.ndarray, "n_theirs n_theirs"],
    ],
    slack: float,
    least: float,
    longer: float,
    couplings: Out[Complex64[np.ndarray, "n_pairs n_pairs"]],
) -> None:
    """Write how two pairs support each other: a complex number for each pair of pairs.

    `part` and `whole` hold distances, the same transposed, and directions (unit complex numbers in
    the frame of the first point). The modulus is 1 if the two distances agree, and 0 from a share
    `slack` on; the argument is the turn from the direction on the part to that on the whole, in the
    frames of the first pair. A longer distance on the part counts `longer` times. The distance of
    two pairs is that from the later one.
    """


@kernel("n_rows", "n_chosen", "n_candidates", "count")
def support_extensions(
    chosen: Int64[np.ndarray, "n_rows n_chosen"],
    sums: Complex64[np.ndarray, "n_rows n_chosen"],
    forth: Complex64[np.ndarray, "n_candidates n_candidates"],
    back: Complex64[np.ndarray, "n_candidates n_candidates"],
    first: int,
    support: Out[Float32[np.ndarray, "n_rows count"]],
) -> None:
    """Write how well sets of pairs support each other, each with one further pair.

    Row b of `chosen` numbers the pairs of a set, of which `sums` holds the support by the others.
    The further pairs are `count` ones from `first` on. `forth` holds the couplings of all pairs, and
    `back` the same transposed.
    """


def nearest_rows(rows: Float[np.ndarray, "m n"], count: int) -> Int64[np.ndarray, "n count"]:
    """Return, for each column of a table, the rows of the least entries, the least first.

    Where there are fewer rows than `count`, the rest is -1.
    """
    n = rows.shape[1]
    found = np.full((n, count), -1)
    table = np.ascontiguousarray(rows, dtype=np.float64)
    fill_nearest_rows(table, np.empty((n, count)), found)
    return found


@kernel("n_rows", "n", "count")
def fill_nearest_rows(
    rows: Float64[np.ndarray, "n_rows n"],
    least: Out[Float64[np.ndarray, "n count"]],
    found: Out[Int64[np.ndarray, "n count"]],
) -> None:
    """Fill what `nearest_rows` returns, which comes as -1; `least` is scratch."""


def place_by_distances(
    rows: Float32[np.ndarray, "m v"],
    partners: Int64[np.ndarray, " m"],
    theirs: Float32[np.ndarray, "k n"],
    near: Int64[np.ndarray, "v c"],
    starts: Int64[np.ndarray, " v"],
    softness: float,
    cap: float,
    longer: float,
    misfits: Float64[np.ndarray, " v"],
) -> Int64[np.ndarray, " v"]:
    """Return, for each point of a part, the vertex of the whole that keeps its distances best.

    Row i of `rows` holds distances from the point of pair i to the points that are placed, and row
    p of `theirs` those from the point of the whole that `partners` number to its vertices. Squared
    errors to the pairs `near` are capped, weigh 1 / (distance + softness)², and count `longer`
    times where the distance on the part is the longer one. `starts` are first guesses: with a good
    one few vertices are left to try. Mean squared errors go to `misfits`.
    """
    found, (lengths, weights) = np.empty_like(starts), np.empty((2, near.shape[1]))
    ends, tried = np.empty(near.shape[1], np.int64), np.empty(theirs.shape[1], np.int64)
    scratch = lengths, weights, ends, tried
    given = rows, partners, theirs, near, starts
    fill_places(*given, softness, cap, longer, found, misfits, scratch)
    return found


@kernel("n_points", "count", "n_vertices")
def fill_places(
    rows: Float32[np.ndarray, "n_rows n_points"],
    partners: Int64[np.ndarray, " n_rows"],
    theirs: Float32[np.ndarray, "_ n_vertices"],
    near: Int64[np.ndarray, "n_points count"],
    starts: Int64[np.ndarray, " n_points"],
    softness: float,
    cap: float,
    longer: float,
    found: Out[Int64[np.ndarray, " n_points"]],
    misfits: Out[Float64[np.ndarray, " n_points"]],
    scratch: tuple[
        Out[Float64[np.ndarray, " count"]],
        Out[Float64[np.ndarray, " count"]],
        Out[Int64[np.ndarray, " count"]],
        Out[Int64[np.ndarray, " n_vertices"]],
    ],
) -> None:
    """Fill what `place_by_distances` returns."""


def nearest_face_points(
    points: Float64[np.ndarray, "n k"],
    corners: Float64[np.ndarray, "m k"],
    faces: Int64[np.ndarray, "f 3"],
    starts: Int64[np.ndarray, " m1"],
    around: Int64[np.ndarray, " e"],
    places: Int64[np.ndarray, " n"],
) -> tuple[Int64[np.ndarray, " n"], Float64[np.ndarray, "n 3"]]:
    """Return the face at a given vertex that comes nearest to each point, and the weights there.

    `points` and `corners` are in k dimensions; `around[starts[v]:starts[v + 1]]` are the faces at
    vertex v, and `places` holds the vertex of each point.
    """
    found, weights = np.empty(len(points), dtype=np.int64), np.empty((len(points), 3))
    fill_face_points(points, corners, faces, starts, around, places, found, weights)
    return found, weights


@kernel("n_points", "k")
def fill_face_points(
    points: Float64[np.ndarray, "n_points k"],
    corners: Float64[np.ndarray, "_ k"],
    faces: Int64[np.ndarray, "_ 3"],
    starts: Int64[np.ndarray, " _"],
    around: Int64[np.ndarray, " _"],
    places: Int64[np.ndarray, " n_points"],
    found: Out[Int64[np.ndarray, " n_points"]],
    weights: Out[Float64[np.ndarray, "n_points 3"]],
) -> None:
    """Fill what `nearest_face_points` returns."""
