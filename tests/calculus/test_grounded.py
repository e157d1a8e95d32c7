import numpy as np
import pytest
import scipy.sparse as sp

from eigenshape._errors import InvalidShapeError
from eigenshape.calculus.linear_solver import factorize_definite, factorize_grounded
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.domains import interval

# Two bars and a point by itself.
STIFFNESS = sp.block_diag(
    [cotangent_laplacian(interval(3)).stiffness] * 2 + [sp.csr_array((1, 1))], format="csr"
)


def test_the_first_point_of_each_component_is_zero():
    loads = np.array([1.0, -2.0, 0.5, 0.5, 0.0, 1.0, -1.0, 0.0, 0.0])[:, None]
    factor = factorize_grounded(sp.csr_array(STIFFNESS))
    solution = factor.solve(loads)
    np.testing.assert_allclose(STIFFNESS @ solution, loads, atol=1e-14)
    assert factor.components.tolist() == [0] * 4 + [1] * 4 + [2]
    assert solution[[0, 4, 8], 0].tolist() == [0, 0, 0]


def test_fixed_points_are_zero_and_take_the_place_of_the_first():
    fixed = np.zeros(9, dtype=bool)
    fixed[[2, 3]] = True
    loads = np.zeros((9, 2))
    loads[0, 1] = 1.0
    solution = factorize_grounded(sp.csr_array(STIFFNESS), fixed).solve(loads)
    np.testing.assert_allclose(solution[:4, 1], [2 / 3, 1 / 3, 0, 0], atol=1e-14)
    assert not solution[:, 0].any()


def test_points_by_themselves_need_no_factor():
    factor = factorize_grounded(sp.csr_array((3, 3)))
    assert factor.factor is None
    assert not factor.solve(np.ones((3, 1))).any()


def test_a_singular_matrix_is_named_by_its_cause():
    with pytest.raises(InvalidShapeError, match="angles well above 0 for the equations"):
        factorize_definite(sp.csr_array(np.zeros((2, 2))))
