import numpy as np
import pytest

from certeig.solver.chebyshev import largest_ritz_value
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import torus


def test_the_bounds_enclose_the_largest_eigenvalue_closely():
    matrix = cotangent_laplacian(torus(40, 20)).stiffness
    largest = float(np.linalg.eigvalsh(matrix.toarray())[-1])
    value, rest, share = largest_ritz_value(lambda column: matrix @ column, matrix.shape[0])
    assert value <= largest <= value + rest
    assert value + share * rest == pytest.approx(largest, rel=0.02)


def test_an_invariant_space_ends_the_iteration():
    def multiply(column):  # its eigenvalues are 2 and 3 alone
        return 3 * column - column.sum() / 100

    value, rest, _ = largest_ritz_value(multiply, 100)
    assert value == pytest.approx(3, rel=1e-12)
    assert rest < 1e-10
