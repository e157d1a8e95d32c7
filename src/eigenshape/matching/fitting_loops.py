"""Kernels of `fitting`: the pull on frames, their turns, and what they carry."""

from typing import Any

import numpy as np
from jaxtyping import Float64, Int64

from certeig.kit.kernels import Out, kernel, math_functions

CIRCLE: Any = math_functions("cos", "sin")


@kernel("n_samples", "n_carriers", "n_frames")
def fill_stiffness(
    carriers: Int64[np.ndarray, "n_samples n_carriers"],
    portions: Float64[np.ndarray, "n_samples n_carriers"],
    pull: Float64[np.ndarray, " n_samples"],
    graph: Float64[np.ndarray, "n_frames n_frames"],
    stiffness: float,
    least: float,
    matrix: Out[Float64[np.ndarray, "n_frames n_frames"]],
) -> None:
    """Fill the lower triangle of the matrix by which places of frames depend on the pulls on samples.

    It is the sum of the products of portions, times the pull on each sample, plus `stiffness` times
    the graph, plus `least` on the diagonal.
    """


@kernel("n_vertices", "n_carriers")
def carry_vertices(
    turns: Float64[np.ndarray, "n_frames 3 3"],
    places: Float64[np.ndarray, "n_frames 3"],
    part: tuple[
        Float64[np.ndarray, "n 3"],
        Float64[np.ndarray, "n 3"],
        Int64[np.ndarray, " n_frames"],
        Int64[np.ndarray, "n n_carriers"],
        Float64[np.ndarray, "n n_carriers"],
    ],
    vertices: Int64[np.ndarray, " n_vertices"],
    points: Out[Float64[np.ndarray, "n_vertices 3"]],
    normals: Out[Float64[np.ndarray, "n_vertices 3"]],
) -> None:
    """Write where frames, each a turn times a size at a place, carry vertices, and the normals there.

    `part` holds all vertices and their normals, which of these are frames, and which frames carry each
    vertex how far.
    """


@kernel("n_samples", "n_carriers", "n_edges")
def add_forces(
    turns: Float64[np.ndarray, "n_frames 3 3"],
    carriers: Int64[np.ndarray, "n_samples n_carriers"],
    portions: Float64[np.ndarray, "n_samples n_carriers"],
    arms: Float64[np.ndarray, "n_samples n_carriers 3"],
    pull: Float64[np.ndarray, " n_samples"],
    targets: Float64[np.ndarray, "n_samples 3"],
    one: Int64[np.ndarray, " n_edges"],
    two: Int64[np.ndarray, " n_edges"],
    links: Float64[np.ndarray, "n_edges 3"],
    weight: float,
    right: Out[Float64[np.ndarray, "n_frames 3"]],
) -> None:
    """Add what pulls on frames, in their current turns: the samples that they carry, and edges.

    Sample s lies at `arms[s, c]` from frame `carriers[s, c]`, which carries the share
    `portions[s, c]` of it. An edge demands minus `weight` times its link in the mean turn of its
    frames.
    """


def turn_frames(
    places: Float64[np.ndarray, "n_frames 3"],
    one: Int64[np.ndarray, " n_edges"],
    two: Int64[np.ndarray, " n_edges"],
    arms: Float64[np.ndarray, "n_edges 3"],
    least: float,
    most: float,
    turns: Float64[np.ndarray, "n_frames 3 3"],
) -> None:
    """Turn each frame to follow its edges, and give it the size that fits them best.

    Sizes are kept between `least` and `most`.
    """
    products, squares = np.zeros((len(places), 3, 3)), np.zeros(len(places))
    follow_edges(places, one, two, arms, least, most, CIRCLE, turns, products, squares)


@kernel("n_frames", "n_edges")
def follow_edges(
    places: Float64[np.ndarray, "n_frames 3"],
    one: Int64[np.ndarray, " n_edges"],
    two: Int64[np.ndarray, " n_edges"],
    arms: Float64[np.ndarray, "n_edges 3"],
    least: float,
    most: float,
    circle: tuple[int, int],
    turns: Out[Float64[np.ndarray, "n_frames 3 3"]],
    products: Out[Float64[np.ndarray, "n_frames 3 3"]],
    squares: Out[Float64[np.ndarray, " n_frames"]],
) -> None:
    """Turn frames as `turn_frames` does; `products` and `squares` come as 0."""
