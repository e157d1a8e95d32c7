import numpy as np
import pytest
from scipy.stats import ttest_ind

import eigenshape as es

MESH = es.icosphere(2)
SPECTRUM = es.solve_spectrum(es.cotangent_laplacian(MESH), 16)


def subjects(n, seed, bump=0.0):
    rng = np.random.default_rng(seed)
    return 5.0 + rng.normal(size=(n, 162)) + bump * MESH.vertices[:, 2]


def compare(one, two, n_permutations=200):
    return es.modes.compare_modes(
        one, two, SPECTRUM, n_permutations=n_permutations, rng=np.random.default_rng(0)
    )


def test_the_statistic_of_maps_is_that_of_student():
    one, two = subjects(7, 0), subjects(9, 1)
    found = compare(one, two, 1)
    coefficients = [es.spectral.project(maps.T, SPECTRUM) for maps in (one, two)]
    t = ttest_ind(coefficients[1], coefficients[0], axis=1).statistic
    np.testing.assert_allclose(found.statistics, t**2, rtol=1e-9)
    np.testing.assert_allclose(
        found.differences, coefficients[1].mean(axis=1) - coefficients[0].mean(axis=1), atol=1e-12
    )


def test_permutation_p_values_are_near_those_of_student():
    """Within five standard errors of 2,000 permutations."""
    one, two = subjects(10, 0), subjects(12, 1)
    found = compare(one, two, 2000)
    coefficients = [es.spectral.project(maps.T, SPECTRUM) for maps in (one, two)]
    expected = ttest_ind(*coefficients, axis=1).pvalue
    assert abs(found.p_values - expected).max() < 5 * 0.5 / np.sqrt(2000)


def test_a_bump_is_found_in_its_modes():
    found = compare(subjects(12, 0), subjects(12, 1, bump=0.6))
    assert found.family_p_values[1:4].min() < 0.01
    bump = es.spectral.reconstruct(found.differences * (found.family_p_values < 0.05), SPECTRUM)
    assert np.corrcoef(bump, MESH.vertices[:, 2])[0, 1] > 0.9


def test_surfaces_are_compared_by_three_coordinates():
    rng = np.random.default_rng(0)
    bodies = MESH.vertices + 0.05 * rng.normal(size=(16, 162, 3))
    bodies[8:] *= [1.0, 1.0, 1.05]
    found = compare(bodies[:8], bodies[8:])
    assert found.differences.shape == (16, 3)
    assert found.family_p_values[1:4].min() < 0.01
    # Turned coordinates of all have the same statistics.
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    again = compare(bodies[:8] @ turn, bodies[8:] @ turn)
    np.testing.assert_allclose(again.statistics, found.statistics, rtol=1e-9)
    np.testing.assert_array_equal(again.p_values, found.p_values)


def test_false_alarms_are_as_rare_as_promised():
    """Of 60 comparisons of equal groups at most 9 have any mode below 0.05: 3 are expected."""
    alarms = 0
    for seed in range(60):
        maps = subjects(10, seed)
        alarms += compare(maps[:5], maps[5:], 99).family_p_values.min() <= 0.05
    assert alarms <= 9


def test_groups_that_do_not_differ_at_all():
    same = np.ones((3, 162))
    found = compare(same, same, 5)
    assert (found.p_values == 1).all()


def test_bad_input_is_named():
    with pytest.raises(
        es.InvalidParameterError, match=r"one must hold a map on 162 points .* is \(4, 161\)"
    ):
        compare(np.ones((4, 161)), np.ones((4, 162)))
    with pytest.raises(
        es.InvalidParameterError, match=r"two must hold a map .* shape is \(1, 162\)"
    ):
        compare(np.ones((4, 162)), np.ones((1, 162)))
    with pytest.raises(es.InvalidParameterError, match="equally many numbers per point"):
        compare(np.ones((4, 162)), np.ones((4, 162, 3)))
    with pytest.raises(es.InvalidParameterError, match="must be finite"):
        compare(np.ones((4, 162)), np.full((4, 162), np.nan))
