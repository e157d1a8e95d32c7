"""Kernels of `fitting`: the bend of frames, and what they carry."""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from certeig.kit.blas import blas_routine
from certeig.kit.kernels import Out, kernel, math_functions
from eigenshape.matching.nearest import RowTree

Rows = Float64[np.ndarray, "_ 3"]
Carried = tuple[
    Rows,
    Rows,
    Int64[np.ndarray, " n_frames"],
    Int64[np.ndarray, "_ n_carriers"],
    Float64[np.ndarray, "_ n_carriers"],
]
Samples = tuple[
    Int64[np.ndarray, " n_samples"],
    Float64[np.ndarray, " n_samples"],
    Float64[np.ndarray, "n_samples n_carriers 3"],
]
Edges = tuple[
    Int64[np.ndarray, " n_edges"],
    Int64[np.ndarray, " n_edges"],
    Float64[np.ndarray, "n_edges 3"],
    Float64[np.ndarray, "n_frames n_frames"],
]
Drawing = tuple[
    Float64[np.ndarray, "n_rows 3"], Float64[np.ndarray, "n_rows 3"], Bool[np.ndarray, " n_rows"]
]
Tree = tuple[
    Int64[np.ndarray, " n_rows"],
    Float64[np.ndarray, "n_rows 6"],
    Float64[np.ndarray, "(2<<levels)-1 2 6"],
]
Scratch = tuple[
    Out[Float64[np.ndarray, "n_frames n_frames"]],
    Out[Float64[np.ndarray, "3 n_frames"]],
    Out[Float64[np.ndarray, "n_frames 3 3"]],
    Out[Float64[np.ndarray, " n_frames"]],
    Out[Float64[np.ndarray, " n_samples"]],
    Out[Float64[np.ndarray, "n_samples 3"]],
    Out[Float64[np.ndarray, "n_samples 6"]],
    Out[Int64[np.ndarray, " n_samples"]],
    Out[Float64[np.ndarray, " n_samples"]],
]


@kernel("n_vertices", "n_carriers")
def carry_vertices(
    turns: Float64[np.ndarray, "n_frames 3 3"],
    places: Float64[np.ndarray, "n_frames 3"],
    part: Carried,
    vertices: Int64[np.ndarray, " n_vertices"],
    points: Out[Float64[np.ndarray, "n_vertices 3"]],
    normals: Out[Float64[np.ndarray, "n_vertices 3"]],
) -> None:
    """Write where frames, each a turn times a size at a place, carry vertices, and the normals there.

    `part` holds all vertices and their normals, which of these are frames, and which frames carry each
    vertex how far.
    """


def bend_frames(
    part: Carried,
    samples: Samples,
    edges: Edges,
    whole: Drawing,
    tree: RowTree,
    normal_length: float,
    stiffnesses: Float64[np.ndarray, " n_steps"],
    along: float,
    targets: Float64[np.ndarray, "n_samples 3"],
    turns: Float64[np.ndarray, "n_frames 3 3"],
    places: Float64[np.ndarray, "n_frames 3"],
) -> None:
    """Move and turn frames, step by step of a stiffness, so that they carry samples to their targets.

    From the third step on, samples are drawn to the nearest points of the whole that face the same
    way, a share `along` of the way along the surface; `targets` are overwritten.

    Parameters
    ----------
    part : tuple
        As for `carry_vertices`.
    samples : tuple
        Vertices of the part, the pull on each, and the arms to it from the frames that carry it.
    edges : tuple
        Frames at both ends, the way between them before the bend, and the Laplacian of all edges.
    whole : tuple
        Vertices, their normals, and which of them draw samples.
    tree : RowTree
        Of the same vertices and normals.
    normal_length : float
        By which normals are multiplied in its rows.
    stiffnesses, along : (n_steps,) float, float
    targets : (n_samples, 3) float
    turns, places : (n_frames, 3, 3) float, (n_frames, 3) float
        Of the frames, to begin with; they are overwritten.
    """
    n, s = len(places), len(targets)
    of_frames = np.empty((n, n)), np.empty((3, n)), np.empty((n, 3, 3)), np.empty(n)
    of_samples = np.empty(s), np.empty((s, 3)), np.empty((s, 6)), np.empty(s, np.int64), np.empty(s)
    scratch = of_frames + of_samples
    routines = *math_functions("cos", "sin"), blas_routine("dpotrf"), blas_routine("dpotrs")
    shapes = part, samples, edges, whole, (tree.order, tree.ordered, tree.nodes), tree.levels
    numbers = normal_length, stiffnesses, along
    settle_frames(*shapes, *numbers, targets, turns, places, scratch, routines)


@kernel("n_samples", "n_carriers", "n_frames", "n_edges", "n_steps", "n_rows")
def settle_frames(
    part: Carried,
    samples: Samples,
    edges: Edges,
    whole: Drawing,
    tree: Tree,
    levels: int,
    normal_length: float,
    stiffnesses: Float64[np.ndarray, " n_steps"],
    along: float,
    targets: Out[Float64[np.ndarray, "n_samples 3"]],
    turns: Out[Float64[np.ndarray, "n_frames 3 3"]],
    places: Out[Float64[np.ndarray, "n_frames 3"]],
    now: Scratch,
    routines: tuple[int, int, int, int],
) -> None:
    """Bend as `bend_frames` does."""
