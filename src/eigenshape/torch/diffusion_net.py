"""DiffusionNet: learned diffusion and gradient features on a surface."""

from typing import Any, Literal

import torch
from torch import Tensor, nn

from certeig.kit.arguments import require_choice, require_type
from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape.spectral.tools.bundle import OperatorBundle
from eigenshape.torch.shapes import ShapeTensors, bundle_tensors

# Of a layer's diffusion at least, in the unit of the shape's area: DiffusionNet's own.
LEAST_TIME = 1e-8
At = Literal["points", "shapes"]


class DiffusionNetBlock(nn.Module):  # type: ignore[misc]
    """One block of DiffusionNet (Sharp, Attaiki, Crane and Ovsjanikov 2022, section 3).

    Each channel diffuses for a time that is learned, in the basis of the eigenvectors. Products of
    its gradient with learned turns of all gradients give features that see direction, and a
    perceptron of two layers joins them at each point to what came in.

    Parameters
    ----------
    width : int
        Number of channels.

    Examples
    --------
    >>> import torch, eigenshape as es, eigenshape.torch as et
    >>> bundle = es.spectral.operator_bundle(es.icosphere(2), 16)
    >>> et.DiffusionNetBlock(8)(torch.zeros(162, 8), bundle).shape
    torch.Size([162, 8])
    """

    def __init__(self, width: Integer) -> None:
        super().__init__()
        n = whole_number(width, "width", 1)
        self.times = nn.Parameter(torch.zeros(n))
        self.turn, self.stretch = nn.Linear(n, n, bias=False), nn.Linear(n, n, bias=False)
        self.perceptron = nn.Sequential(
            nn.Linear(3 * n, n), nn.ReLU(), nn.Linear(n, n), nn.ReLU(), nn.Linear(n, n)
        )

    def forward(self, values: Tensor, shape: ShapeTensors | OperatorBundle) -> Tensor:
        """Return the next values, (n, width), on a shape, a batch, or the bundle of a shape."""
        operators = _as_tensors(shape, values)
        diffused = self._diffuse(values, operators)
        x, y = operators.gradient_x @ diffused, operators.gradient_y @ diffused
        turned_x = self.stretch(x) - self.turn(y)
        turned_y = self.stretch(y) + self.turn(x)
        features = torch.tanh(x * turned_x + y * turned_y)
        return values + self.perceptron(torch.cat([values, diffused, features], dim=1))

    def _diffuse(self, values: Tensor, operators: ShapeTensors) -> Tensor:
        times = self.times.abs().clamp_min(LEAST_TIME)
        parts = [
            vectors @ (torch.exp(-torch.outer(levels, times)) * (vectors.T @ weighed))
            for vectors, levels, weighed in zip(
                operators.eigenvectors.split(operators.sizes),
                torch.atleast_2d(operators.eigenvalues),
                (operators.mass[:, None] * values).split(operators.sizes),
                strict=True,
            )
        ]
        return torch.cat(parts)


class DiffusionNet(nn.Module):  # type: ignore[misc]
    """A network on surfaces: a layer in, blocks of diffusion, and a layer out.

    Parameters
    ----------
    n_inputs, n_outputs : int
        Channels of the features and of the result.
    width : int
        Channels inside.
    n_blocks : int
    at : {"points", "shapes"}
        Whether the result is at each point, or the mean over each shape, weighted by mass.

    Raises
    ------
    InvalidParameterError
        If a number is less than 1, or `at` is none of the two.

    Examples
    --------
    >>> import torch, eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(2)
    >>> bundle = es.spectral.operator_bundle(ball, 16)
    >>> network = et.DiffusionNet(3, 5, width=8, n_blocks=2)
    >>> network(torch.tensor(ball.vertices, dtype=torch.float32), bundle).shape
    torch.Size([162, 5])
    """

    def __init__(
        self,
        n_inputs: Integer,
        n_outputs: Integer,
        *,
        width: Integer = 64,
        n_blocks: Integer = 4,
        at: At = "points",
    ) -> None:
        super().__init__()
        require_choice(at, At, "at")
        inner = whole_number(width, "width", 1)
        self.first = nn.Linear(whole_number(n_inputs, "n_inputs", 1), inner)
        self.blocks = nn.ModuleList(
            DiffusionNetBlock(inner) for _ in range(whole_number(n_blocks, "n_blocks", 1))
        )
        self.last = nn.Linear(inner, whole_number(n_outputs, "n_outputs", 1))
        self.at = at

    def forward(self, features: Tensor, shape: ShapeTensors | OperatorBundle) -> Tensor:
        """Return (n, n_outputs), or one row for each shape of a batch."""
        operators = _as_tensors(shape, features)
        values = self.first(features)
        for block in self.blocks:
            values = block(values, operators)
        values = self.last(values)
        if self.at == "points":
            return values
        return torch.stack(
            [
                (mass @ part) / mass.sum()
                for mass, part in zip(
                    operators.mass.split(operators.sizes),
                    values.split(operators.sizes),
                    strict=True,
                )
            ]
        )


def _as_tensors(shape: Any, values: Tensor) -> ShapeTensors:
    """Return the operators of a shape as tensors of the values' precision and device."""
    require_type(shape, ShapeTensors | OperatorBundle, "shape")
    size = len(shape.mass)
    if len(values) != size:
        raise InvalidParameterError(
            f"Values must have one row for each of the {size} points; there are {len(values)} rows."
        )
    if isinstance(shape, ShapeTensors):
        return shape
    operators = bundle_tensors(shape, values)
    return ShapeTensors(values.new_empty(size, 0), **operators, sizes=(size,))
