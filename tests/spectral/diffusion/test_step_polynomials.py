"""The polynomial of implicit steps is as near to the exponential as it says, at every eigenvalue."""

import numpy as np
import pytest
from numpy.polynomial.chebyshev import chebval

from eigenshape.spectral.diffusion.heat_flow import group_times, step_coefficients, step_time


@pytest.mark.parametrize("accuracy", [0.1, 1e-4, 1e-10, 1e-12])
@pytest.mark.parametrize("ratio", [6.0, 16.0, 48.0])
def test_the_error_is_bounded_for_all_eigenvalues(ratio, accuracy):
    coefficients = step_coefficients(ratio, accuracy)
    x = np.concatenate([[0.0], np.geomspace(1e-9, 1e9, 20_001)])  # tλ
    error = np.abs(chebval(2 / (1 + x / ratio) - 1, coefficients) - np.exp(-x))
    assert error.max() <= accuracy + 1e-14
    assert error[0] <= 1e-15
    assert len(coefficients) <= {0.1: 12, 1e-4: 20, 1e-10: 31, 1e-12: 38}[accuracy]


def test_times_share_a_factor_within_a_factor_of_eight():
    times = np.array([8.0, 1.0, 9.0, 100.0, 3.0])
    groups = group_times(times)
    assert [sorted(times[places]) for places in groups] == [[1, 3, 8], [9], [100]]
    for places in groups:
        ratios = times[places] / step_time(times[places])
        assert ratios.min() >= 6 - 1e-12
        assert ratios.max() <= 48 + 1e-12
