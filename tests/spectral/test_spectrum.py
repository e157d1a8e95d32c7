"""Which eigenvalues of a spectrum are zero."""

from dataclasses import replace

import numpy as np
import pytest

from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.solve import solve_spectrum

TWO = disjoint_union(icosphere(1), icosphere(1))
SPECTRUM = solve_spectrum(cotangent_laplacian(TWO), 8)


@pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")
def test_each_component_has_one_zero_mode():
    assert SPECTRUM.n_zero_modes == 2
    assert solve_spectrum(cotangent_laplacian(TWO), 2).n_zero_modes == 2
    assert solve_spectrum(cotangent_laplacian(TWO), 8, fixed=[0]).n_zero_modes == 1


def test_values_within_their_residuals_are_zero_and_those_of_approximations_are_not():
    values = np.array([0.0, 1e-8, 1e-3, 1, 1, 1, 1, 1])
    residuals = np.where(np.arange(8) < 3, 1e-3, 0)
    found = replace(SPECTRUM, eigenvalues=values, residuals=residuals)
    assert found.n_zero_modes == 3
    uncounted = replace(SPECTRUM.certificate, count=None)
    assert replace(found, certificate=uncounted).n_zero_modes == 2
