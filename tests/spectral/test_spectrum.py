"""Which eigenvalues of a spectrum are zero."""

from dataclasses import replace

import numpy as np

from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import count_zero_modes

TWO = disjoint_union(icosphere(1), icosphere(1))
SPECTRUM = solve_spectrum(cotangent_laplacian(TWO), 8)


def test_each_component_has_one_zero_mode():
    assert count_zero_modes(SPECTRUM) == 2
    assert count_zero_modes(solve_spectrum(cotangent_laplacian(TWO), 2)) == 2
    assert count_zero_modes(solve_spectrum(cotangent_laplacian(TWO), 8, fixed=[0])) == 1


def test_values_within_their_residuals_are_zero_and_those_of_approximations_are_not():
    values = np.array([0.0, 1e-8, 1e-3, 1, 1, 1, 1, 1])
    residuals = np.where(np.arange(8) < 3, 1e-3, 0)
    found = replace(SPECTRUM, eigenvalues=values, residuals=residuals)
    assert count_zero_modes(found) == 3
    uncounted = replace(SPECTRUM.certificate, count=None)
    assert count_zero_modes(replace(found, certificate=uncounted)) == 2
