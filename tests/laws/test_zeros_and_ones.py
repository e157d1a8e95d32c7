"""A mask of zeros and ones is refused where numbers of points are asked for: it would name points 0 and 1."""

import numpy as np
import pytest

import eigenshape as es

HAND = es.make_creature("hand", n_vertices=500)
LOW = HAND.vertices[:, 1] < 0
AS_NUMBERS = LOW.astype(int)
UP = es.Translation([0, 0.1, 0])
CALLS = {
    "deform, region": lambda mask: es.deform(es.rig_shape(HAND), mask, UP),
    "deform, fixed": lambda mask: es.deform(es.rig_shape(HAND), ~LOW, UP, fixed=mask),
    "solve_harmonic": lambda mask: es.calculus.solve_harmonic(
        es.cotangent_laplacian(HAND), mask, np.ones(len(mask))
    ),
    "heat_distances": lambda mask: es.calculus.heat_distances(HAND, mask),
    "geodesic_distances": lambda mask: es.geometry.geodesic_distances(HAND, mask),
    "solve_spectrum, fixed": lambda mask: es.solve_spectrum(
        es.cotangent_laplacian(HAND), 3, fixed=mask
    ),
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("kind", [np.asarray, np.ndarray.tolist], ids=["array", "list"])
def test_zeros_and_ones_are_no_numbers_of_points(call, kind):
    with pytest.raises(es.InvalidParameterError, match=r"Pass np\.flatnonzero\(mask\) for a mask"):
        CALLS[call](kind(AS_NUMBERS))
