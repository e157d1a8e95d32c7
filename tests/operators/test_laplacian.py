import numpy as np
import pytest
import scipy.sparse as sp

from certeig.kit.errors import InvalidParameterError
from eigenshape.operators.laplacian import Laplacian

EYE = sp.csr_array(sp.eye_array(2))


def matrix(*rows):
    return sp.csr_array(np.array(rows, dtype=float))


def test_whole_numbers_become_floats():
    laplacian = Laplacian(sp.csr_array(np.array([[1, -1], [-1, 1]])), EYE)
    assert laplacian.stiffness.dtype == np.float64
    assert laplacian.n_points == 2


@pytest.mark.parametrize("shape", [(2, 3), (0, 0)])
def test_a_matrix_that_is_not_square_is_refused(shape):
    with pytest.raises(
        InvalidParameterError, match=rf"stiffness must be a square sparse matrix; .* \({shape[0]}, "
    ):
        Laplacian(sp.csr_array(shape), EYE)


def test_sizes_that_differ_are_refused():
    with pytest.raises(
        InvalidParameterError, match=r"the same shape; the shapes are \(2, 2\) and \(3, 3\)"
    ):
        Laplacian(matrix([1, -1], [-1, 1]), sp.csr_array(sp.eye_array(3)))


def test_entries_that_are_not_finite_are_refused():
    with pytest.raises(
        InvalidParameterError, match=r"stiffness must be finite; entry \(0, 1\) is nan \(2 such\)"
    ):
        Laplacian(matrix([1, np.nan], [np.nan, 1]), EYE)


def test_asymmetry_is_refused_with_both_entries():
    with pytest.raises(
        InvalidParameterError, match=r"entry \(0, 1\) is -1\.0 and entry \(1, 0\) is -2\.0"
    ):
        Laplacian(matrix([1, -1], [-2, 1]), EYE)


def test_the_largest_asymmetry_is_named():
    rows = [[2, -1, -1, 0], [-1, 2, 0, -1], [-1.5, 0, 3, -1], [0, -1, 0, 2]]
    with pytest.raises(
        InvalidParameterError, match=r"entry \(2, 3\) is -1\.0 and entry \(3, 2\) is 0\.0"
    ):
        Laplacian(matrix(*rows), sp.csr_array(sp.eye_array(4)))


def test_asymmetry_of_rounding_passes():
    assert Laplacian(matrix([1, -1], [-1 - 1e-15, 1]), EYE).n_points == 2


@pytest.mark.parametrize("mass", [0.0, -2.0])
def test_a_mass_that_is_not_positive_is_refused(mass):
    with pytest.raises(InvalidParameterError, match=rf"the mass of point 1 is {mass} \(1 such\)"):
        Laplacian(matrix([1, -1], [-1, 1]), matrix([1, 0], [0, mass]))


def test_matrices_are_copied_and_read_only():
    weights = np.array([[3.0, -3.0], [-3.0, 3.0]])
    stiffness, mass = sp.csr_array(weights), sp.csr_array(np.eye(2))
    laplacian = Laplacian(stiffness, mass)
    stiffness.data[:] = 7.0
    np.testing.assert_array_equal(laplacian.stiffness.toarray(), weights)
    for matrix in (laplacian.stiffness, laplacian.mass):
        for part in (matrix.data, matrix.indices, matrix.indptr):
            with pytest.raises(ValueError, match="read-only"):
                part[0] = 0


@pytest.mark.parametrize("size", [2.0**-80, 1.0, 2.0**80])
def test_asymmetry_is_a_share_of_the_largest_entry(size):
    rounding, fault = 1 + 2.0**-44, 1 + 2.0**-36
    Laplacian(size * matrix([1, -1], [-rounding, 1]), EYE)
    with pytest.raises(
        InvalidParameterError, match=r"stiffness must be symmetric; entry \(0, 1\) is -"
    ):
        Laplacian(size * matrix([1, -1], [-fault, 1]), EYE)
