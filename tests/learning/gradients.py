"""Gradients against central differences of order 8, in a direction that is partly the gradient's."""

import numpy as np
import torch

# Coefficients of the central difference of order 8.
WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}


def central_slope(function, step):
    return (
        sum(weight * (function(i * step) - function(-i * step)) for i, weight in WEIGHTS.items())
        / step
    )


def relative_error(function, *inputs, step=1e-3):
    """Return the error of the derivative of a number along a direction, relative to itself.

    All inputs move at once, each by its own size.
    """
    generator = torch.Generator().manual_seed(1)
    given = [torch.tensor(np.asarray(each)).double().requires_grad_() for each in inputs]
    gradients = torch.autograd.grad(function(*given), given)
    directions = []
    for each, gradient in zip(given, gradients, strict=True):
        noise = torch.randn(each.shape, generator=generator, dtype=torch.float64)
        direction = gradient / gradient.norm() + noise / noise.norm()
        directions.append(direction / direction.norm())
    slope = sum(
        (gradient * direction).sum().item()
        for gradient, direction in zip(gradients, directions, strict=True)
    )

    def moved(distance):
        with torch.no_grad():
            places = zip(given, directions, strict=True)
            return function(*(each + distance * direction for each, direction in places)).item()

    return abs(central_slope(moved, step) - slope) / abs(slope)
