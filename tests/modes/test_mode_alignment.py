import dataclasses

import numpy as np
import pytest

import eigenshape as es

BALL = es.icosphere(3)
SPECTRUM = es.solve_spectrum(es.cotangent_laplacian(BALL), 16)


def turned(spectrum, turn):
    return dataclasses.replace(spectrum, eigenvectors=spectrum.eigenvectors @ turn)


def random_turns(seed):
    rng, turn = np.random.default_rng(seed), np.zeros((16, 16))
    for degree in range(4):
        group = slice(degree**2, (degree + 1) ** 2)
        turn[group, group] = np.linalg.qr(rng.normal(size=(2 * degree + 1,) * 2))[0]
    return turn


def test_turns_within_groups_are_taken_back():
    found = es.modes.align_modes(turned(SPECTRUM, random_turns(0)), SPECTRUM)
    np.testing.assert_allclose(found.modes, SPECTRUM.eigenvectors, atol=1e-9)
    np.testing.assert_allclose(found.turns, random_turns(0).T, atol=1e-9)
    assert found.angles.max() < 1e-9
    assert not found.lost.size


def test_the_angle_of_two_modes_that_mix_is_found():
    """Modes of two groups turn into each other by 60 degrees."""
    turn = np.eye(16)
    c, s = np.cos(np.pi / 3), np.sin(np.pi / 3)
    turn[np.ix_([0, 1], [0, 1])] = [[c, -s], [s, c]]
    found = es.modes.align_modes(turned(SPECTRUM, turn), SPECTRUM)
    assert found.stops.tolist() == [1, 4, 9, 16]
    np.testing.assert_allclose(found.angles[[0, 1, 3]], [np.pi / 3, 0.0, np.pi / 3], atol=1e-9)
    assert found.lost.tolist() == [0, 1]
    assert "by at most 60°" in found.explain()
    assert "15 modes lie in groups whose eigenvalues are too close" in found.explain()
    assert "2 groups are not those of the reference; the first is mode 0." in found.explain()


def test_groups_are_those_that_both_spectra_separate():
    squashed = es.TriangleMesh(BALL.vertices * [1.0, 1.0, 1.02], BALL.faces)
    other = es.solve_spectrum(es.cotangent_laplacian(squashed), 12)
    found = es.modes.align_modes(other, SPECTRUM)
    assert found.modes.shape == (642, 12)
    assert found.stops.tolist()[:3] == [1, 4, 9]
    assert found.angles[:9].max() < 0.02
    gram = found.modes.T @ other.mass @ found.modes
    np.testing.assert_allclose(gram, np.eye(12), atol=1e-9)


def test_points_of_another_order():
    order = np.random.default_rng(0).permutation(642)
    shuffled = es.TriangleMesh(BALL.vertices[order], np.argsort(order)[BALL.faces])
    other = es.solve_spectrum(es.cotangent_laplacian(shuffled), 9)
    found = es.modes.align_modes(other, SPECTRUM, points=order)
    np.testing.assert_allclose(found.modes, SPECTRUM.eigenvectors[order, :9], atol=1e-8)


def test_points_that_do_not_fit_are_named():
    small = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 9)
    with pytest.raises(
        es.InvalidParameterError, match="spectrum has 162 points and reference has 642"
    ):
        es.modes.align_modes(small, SPECTRUM)
    with pytest.raises(
        es.InvalidParameterError, match="for each of 162 points of spectrum; there are 3"
    ):
        es.modes.align_modes(small, SPECTRUM, points=[0, 1, 2])
    with pytest.raises(
        es.InvalidParameterError, match=r"a point of reference must lie in 0\.\.641"
    ):
        es.modes.align_modes(small, SPECTRUM, points=np.full(162, 700))
    above = es.solve_spectrum(es.cotangent_laplacian(BALL), above=1.0, below=3.0)
    with pytest.raises(es.InvalidParameterError, match="reference must begin with the lowest"):
        es.modes.align_modes(SPECTRUM, above)
