import numpy as np
import pytest
from known_spectra import random_grid

from certeig.solver.chebyshev import largest_ritz_value


def test_the_bounds_enclose_the_largest_eigenvalue_closely():
    matrix, _ = random_grid(28)
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
