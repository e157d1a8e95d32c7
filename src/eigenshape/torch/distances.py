"""Geodesic distances by heat, differentiable in the vertices."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp
import torch
from torch import Tensor

from certeig.kit.arrays import positive_number
from eigenshape._arrays import require_sources
from eigenshape.calculus.heat_distance import require_heat
from eigenshape.calculus.linear_solver import factorize_definite, factorize_grounded
from eigenshape.torch.operators import (
    as_faces,
    as_tensor,
    cotangent_entries,
    face_products,
    to_numpy,
)

Solve = Callable[[np.ndarray], np.ndarray]


def heat_distances(vertices: Any, faces: Any, sources: Any, *, time_factor: float = 1.0) -> Tensor:
    """Compute geodesic distances from some points by the heat method, differentiable in the vertices.

    The method and the values are those of `es.calculus.heat_distances`. A backward pass takes two
    more solves for each source, by the same factors.

    Parameters
    ----------
    vertices : (n, 3) float tensor
        Or any array that DLPack or NumPy takes. Computed in double precision.
    faces : (f, 3) int tensor
    sources : (s,) int
        Points.
    time_factor : float
        The heat flows for the time t = time_factor × h², with the mean edge length h.

    Returns
    -------
    (s, n) tensor
        In length; infinite on other components.

    Raises
    ------
    InvalidShapeError, InvalidParameterError
        As in `es.calculus.heat_distances`.

    Examples
    --------
    >>> import eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(3)
    >>> distances = et.heat_distances(ball.vertices, ball.faces, [0])
    >>> round(distances.max().item(), 1)
    3.1
    """
    points, triangles = as_tensor(vertices), as_faces(faces)
    factor = positive_number(time_factor, "time_factor")
    start = require_sources(sources, len(points))
    places, values, mass = cotangent_entries(points, triangles)
    n = len(points)
    rows, columns = places
    ends = places[:, rows < columns]
    length = (points[ends[0]] - points[ends[1]]).norm(dim=1).mean()
    time = factor * length**2
    heat_values = time * values + torch.where(rows == columns, mass[rows], 0.0)

    W, A = (
        sp.csr_array((to_numpy(entries), tuple(to_numpy(places))), shape=(n, n))
        for entries in (values, heat_values)
    )
    heat_factor, poisson = factorize_definite(A), factorize_grounded(W)
    components = torch.tensor(poisson.components, device=points.device)
    reached = components[:, None] == components[start]
    impulses = torch.zeros(n, len(start), dtype=torch.float64, device=points.device)
    impulses[start, range(len(start))] = 1.0
    heat = _Solve.apply(heat_values, impulses, places, heat_factor.solve)
    require_heat(to_numpy(heat), to_numpy(reached))

    # Far away heat is as small as 1e-300, so each face gets a unit of its own.
    corners = heat[triangles] - heat[triangles[:, :1]]
    unit = corners.detach().abs().amax(dim=1, keepdim=True)
    corners = corners / torch.where(unit > 0, unit, 1.0)
    cotangents, areas = face_products(points, triangles)
    flow = _face_stiffness(cotangents, corners)
    squares = (corners * flow).sum(dim=1) / areas[:, None]
    # No heat flows in a face that the source's component does not hold.
    slopes = torch.where(squares > 0, squares, torch.inf).sqrt()
    flow = flow / slopes[:, None]
    loads = torch.zeros_like(heat).index_add(0, triangles.flatten(), -flow.flatten(0, 1))
    found = _Solve.apply(values, loads, places, poisson.solve)
    found = found - found[start, range(len(start))]
    return torch.where(reached, found, torch.inf).T


def _face_stiffness(cotangents: Tensor, values: Tensor) -> Tensor:
    """Multiply values at corners, (f, 3, s), by the stiffness matrix of each face."""
    sides = values.roll(-1, dims=1) - values.roll(1, dims=1)  # opposite to each corner
    flows = cotangents[:, :, None] / 2 * sides
    # The side opposite to corner c goes from c-1 to c+1.
    return flows.roll(1, dims=1) - flows.roll(-1, dims=1)


class _Solve(torch.autograd.Function):  # type: ignore[misc]
    """Solve A x = b for a symmetric A, given by its values at some places and by its factor."""

    @staticmethod
    def forward(ctx: Any, values: Tensor, right: Tensor, places: Tensor, solve: Solve) -> Tensor:
        found = torch.from_numpy(solve(to_numpy(right))).to(right.device)
        ctx.solve = solve
        ctx.save_for_backward(values, places, found)
        return found

    @staticmethod
    def backward(ctx: Any, by_solution: Tensor) -> tuple[Tensor | None, ...]:
        values, places, found = ctx.saved_tensors
        by_right = _Solve.apply(values, by_solution.contiguous(), places, ctx.solve)
        rows, columns = places
        return -(by_right[rows] * found[columns]).sum(dim=1), by_right, None, None
