import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.samples.quadrature import Quadrature, shape_quadrature
from eigenshape.shapes.surfaces import grid


def integral(measure, values):
    return float(measure.weights @ values)


def test_a_mesh_integrates_linear_functions_exactly():
    mesh = grid(3, 4, width=2.0)
    measure = shape_quadrature(mesh)
    assert integral(measure, mesh.vertices @ [1.0, 3.0, 0.0]) == pytest.approx(
        2 * (1.0 + 1.5), rel=1e-14
    )


def test_uniform_points_share_one():
    measure = Quadrature(np.eye(4), None, 2)
    assert measure.weights.tolist() == [0.25] * 4
    assert repr(measure) == "Quadrature(4 points in R^4, dim=2)"


@pytest.mark.parametrize(
    ("points", "weights", "dim", "error", "match"),
    [
        ([], [1.0], 1, InvalidShapeError, "A quadrature must have points; it has none"),
        (
            np.eye(2),
            [1.0],
            1,
            InvalidParameterError,
            "weights must hold one number per point; there are 1 for 2 points",
        ),
        (
            np.eye(2),
            [1.0, 0.0],
            1,
            InvalidParameterError,
            "weights must be positive and finite; entry 1 is 0.0",
        ),
        (np.eye(2), [1.0, 1.0], 3, InvalidParameterError, r"dim must lie in 1\.\.2; it is 3"),
    ],
)
def test_what_is_no_quadrature_is_refused(points, weights, dim, error, match):
    with pytest.raises(error, match=match):
        Quadrature(points, weights, dim)
