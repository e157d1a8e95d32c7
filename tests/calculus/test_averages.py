"""Values carried between points and simplices."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape.calculus import average_onto_points

SOLID = es.shapes.box(3, 2, 2)


@pytest.mark.parametrize("mesh", [es.shapes.torus(8, 6), SOLID, es.shapes.circle(7)])
@pytest.mark.parametrize("shape", [(), (3,), (2, 2)])
def test_averages_keep_integrals_and_constants(mesh, shape):
    rng = np.random.default_rng(0)
    on_simplices = rng.standard_normal((len(mesh.simplices), *shape))
    volumes, duals = es.geometry.simplex_volumes(mesh), es.geometry.dual_volumes(mesh)
    at_points = average_onto_points(mesh, on_simplices)
    np.testing.assert_allclose(
        np.tensordot(duals, at_points, 1), np.tensordot(volumes, on_simplices, 1), atol=1e-12
    )
    ones = np.ones((mesh.n_points, *shape))
    np.testing.assert_allclose(
        average_onto_points(mesh, ones[:1].repeat(len(mesh.simplices), 0)), 1.0
    )


def test_wrong_arguments_are_named():
    with pytest.raises(es.InvalidParameterError, match="values must have one row per simplex"):
        average_onto_points(SOLID, np.zeros(3))
    values = np.zeros((len(SOLID.simplices), 2))
    values[4, 1] = np.nan
    with pytest.raises(es.InvalidParameterError, match=r"that of simplex 4 is \[0.0, nan\]"):
        average_onto_points(SOLID, values)
