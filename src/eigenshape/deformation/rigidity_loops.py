"""Kernels of `rigidity`: the best rotation at each vertex, and the rotated edges."""

from typing import Any

import numpy as np
from jaxtyping import Float64, Int64

from certeig.kit.kernels import Out, kernel, math_functions

CIRCLE: Any = math_functions("atan2", "tan")

Vertices = Int64[np.ndarray, " n_vertices"]
# Edges starts[i] to starts[i + 1] - 1 are those of vertex i.
Starts = Int64[np.ndarray, " n_starts"]
Others = Int64[np.ndarray, " e"]
Weights = Float64[np.ndarray, " e"]
Points = Float64[np.ndarray, "n_starts-1 3"]
Turns = Float64[np.ndarray, "n_starts-1 4"]


def fit_rotations(
    vertices: Vertices,
    starts: Starts,
    others: Others,
    weights: Weights,
    rest: Float64[np.ndarray, "n 3"],
    posed: Float64[np.ndarray, "n 3"],
    turns: Float64[np.ndarray, "n 4"],
) -> float:
    """Update the rotations of some vertices so that they fit the posed edges best.

    The rotation of vertex i maximizes Σ_j w_ij e'_ij · R e_ij. It is a unit quaternion, real part
    first, in `turns`, which also holds the start of the iteration. If the edges do not determine a
    rotation, it keeps its value. Returns the remaining energy, Σ_ij w_ij |R_i e_ij - e'_ij|² / 2.
    """
    return settle_rotations(vertices, starts, others, weights, rest, posed, turns, CIRCLE)


@kernel("n_vertices")
def settle_rotations(
    vertices: Vertices,
    starts: Starts,
    others: Others,
    weights: Weights,
    rest: Points,
    posed: Points,
    turns: Out[Turns],
    circle: tuple[int, int],
) -> float:
    """Update rotations as `fit_rotations` does."""


@kernel("n_vertices")
def turn_edges(
    vertices: Vertices,
    starts: Starts,
    others: Others,
    weights: Weights,
    rest: Points,
    turns: Turns,
    sums: Out[Float64[np.ndarray, "n_vertices 3"]],
) -> None:
    """Write Σ_j w_ij ((R_i + R_j)/2 - 1) (x_i - x_j) to `sums` for some vertices."""
