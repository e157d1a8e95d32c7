import numpy as np
import pytest

from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape.geometry.samples.quadrature import (
    Quadrature,
    mesh_quadrature,
    sphere_quadrature,
    torus_quadrature,
    uniform_quadrature,
)
from eigenshape.shapes.surfaces import grid


def integral(measure, values):
    return float(measure.weights @ values)


def test_polynomials_on_the_sphere_are_integrated_exactly():
    measure = sphere_quadrature(6)
    x, y, z = measure.points.T
    assert integral(measure, np.ones_like(x)) == pytest.approx(4 * np.pi, rel=1e-14)
    assert integral(measure, x**2 * y**2 * z**4) == pytest.approx(
        4 * np.pi * 3 / (3 * 5 * 7 * 9), rel=1e-13
    )
    assert integral(measure, x**4 * y**6) == pytest.approx(
        4 * np.pi * 3 * 15 / (3 * 5 * 7 * 9 * 11), rel=1e-13
    )


def test_the_torus_has_its_area():
    measure = torus_quadrature(8, 5, outer=3.0, inner=0.5)
    assert integral(measure, np.ones(40)) == pytest.approx(4 * np.pi**2 * 1.5, rel=1e-14)


def test_a_mesh_integrates_linear_functions_exactly():
    mesh = grid(3, 4, width=2.0)
    measure = mesh_quadrature(mesh)
    assert integral(measure, mesh.vertices @ [1.0, 3.0, 0.0]) == pytest.approx(
        2 * (1.0 + 1.5), rel=1e-14
    )


def test_uniform_points_share_one():
    measure = uniform_quadrature(np.eye(4), 2)
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
