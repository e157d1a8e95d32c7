"""Watermarks: found by their key after attacks, and by no other key."""

import numpy as np
import pytest
from scipy.stats import kstest

import eigenshape as es
from eigenshape.spectral.tools.watermark import _across, _exceedance, _low_modes, _pattern

BALL = es.icosphere(2)  # every eigenvalue is multiple
KEY = "a secret"
MARKED = es.spectral.embed_watermark(BALL, KEY, k=40)
DIAGONAL = np.linalg.norm(np.ptp(BALL.vertices, axis=0))


def detect(vertices, key=KEY, original=BALL, k=40):
    return es.spectral.detect_watermark(original, (vertices, BALL.faces), key, k=k)


def test_the_mark_is_as_strong_as_requested():
    mass = es.robust_laplacian(BALL).mass.diagonal()
    for strength in (1e-4, 5e-4):
        marked = es.spectral.embed_watermark(BALL, KEY, k=40, strength=strength)
        squares = ((marked.vertices - BALL.vertices) ** 2).sum(axis=1)
        moved = np.sqrt(mass @ squares / mass.sum()) / DIAGONAL
        assert moved == pytest.approx(strength, rel=1e-9)
        np.testing.assert_array_equal(marked.faces, BALL.faces)


def test_the_mark_is_found_after_noise_motion_and_change_of_units():
    rng = np.random.default_rng(0)
    noisy = MARKED.vertices + 5e-4 * DIAGONAL * rng.normal(size=MARKED.vertices.shape)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    plain, moved = detect(noisy), detect(1e-3 * noisy @ rotation.T + [5, 6, 7])
    assert plain.false_alarm < 1e-8
    assert moved.score == pytest.approx(plain.score, abs=1e-6)
    assert detect(MARKED.vertices).score > 0.95


def test_smoothing_leaves_the_mark_alone():
    original = es.shapes.torus(24, 12)
    marked = es.spectral.embed_watermark(original, KEY, k=40)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(original), 200)
    shares = np.exp(-3 * spectrum.eigenvalues / spectrum.eigenvalues[-1])
    coefficients = spectrum.eigenvectors.T @ (spectrum.mass @ marked.vertices)
    smooth = spectrum.eigenvectors @ (shares[:, None] * coefficients)
    moved = np.linalg.norm(smooth - marked.vertices, axis=1).max()
    assert moved > 10 * np.linalg.norm(marked.vertices - original.vertices, axis=1).max()
    test = es.spectral.detect_watermark(original, (smooth, original.faces), KEY, k=40)
    assert test.false_alarm < 1e-12


def test_other_keys_and_unmarked_shapes_are_not_found():
    keys = [f"key {number}" for number in range(300)]
    tests = es.spectral.detect_watermark(BALL, MARKED, keys, k=40)
    chances = [test.false_alarm for test in tests]
    assert min(chances) > 1e-5
    assert kstest(chances, "uniform").pvalue > 0.01
    rng = np.random.default_rng(1)
    assert detect(BALL.vertices + 1e-3 * rng.normal(size=BALL.vertices.shape)).false_alarm > 1e-3
    assert detect(BALL.vertices).false_alarm > 1e-3  # rounding errors of the alignment at most


def test_the_probability_is_that_of_a_random_direction():
    rng = np.random.default_rng(2)
    directions = rng.normal(size=(40_000, 5))
    cosines = directions[:, 0] / np.linalg.norm(directions, axis=1)
    for score in (-0.5, 0.0, 0.3, 0.8):
        assert _exceedance(score, 5) == pytest.approx((cosines >= score).mean(), abs=0.01)
    assert _exceedance(1.0, 5) == 0
    assert _exceedance(-1.0, 5) == 1


def test_the_pattern_of_a_symmetric_shape_does_not_depend_on_its_eigenvectors():
    basis, mass, groups = _low_modes((BALL.vertices, BALL.faces), 8, None)
    assert groups.tolist() == [0, 0, 0, 1, 1, 1, 1, 1]
    rng, other = np.random.default_rng(3), basis.copy()
    for group in (slice(0, 3), slice(3, 8)):
        size = group.stop - group.start
        other[:, group] = basis[:, group] @ np.linalg.qr(rng.normal(size=(size, size)))[0]
    marks = []
    for vectors in (basis, other):
        own = vectors.T @ (mass[:, None] * BALL.vertices)
        marks.append(vectors @ _across(_pattern(b"x", vectors, mass), own, groups)[0])
    np.testing.assert_allclose(*marks, atol=1e-9)


def test_an_eigenspace_that_would_be_cut_is_left_out():
    # one direction is left out: that of the sphere itself, which lies in the first eigenspace
    assert detect(MARKED.vertices, k=10).n_numbers == 3 * 8 - 1


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_units_do_not_matter(scale):
    scaled = es.TriangleMesh(BALL.vertices * scale, BALL.faces)
    marked = es.spectral.embed_watermark(scaled, KEY, k=40)
    np.testing.assert_allclose(marked.vertices / scale, MARKED.vertices, atol=1e-9)
    assert detect(marked.vertices, original=scaled).score > 0.95


def test_a_kept_spectrum_gives_the_same_test(tmp_path):
    first, again = (
        es.spectral.detect_watermark(BALL, MARKED, KEY, k=40, cache=tmp_path) for _ in range(2)
    )
    assert first == again == detect(MARKED.vertices)
    assert len(list(tmp_path.glob("*.npz"))) == 1


def test_text_and_its_bytes_are_one_key():
    other = es.spectral.embed_watermark(BALL, KEY.encode(), k=40)
    np.testing.assert_array_equal(other.vertices, MARKED.vertices)


def test_bad_arguments_are_named():
    with pytest.raises(es.InvalidParameterError, match="A key must be text or bytes, and not em"):
        es.spectral.embed_watermark(BALL, "")
    with pytest.raises(es.InvalidParameterError, match=r"strength must be at most 0.1 of the diag"):
        es.spectral.embed_watermark(BALL, KEY, strength=0.2)
    with pytest.raises(es.InvalidParameterError, match="strength must be positive and finite"):
        es.spectral.embed_watermark(BALL, KEY, strength=0.0)
    with pytest.raises(es.InvalidParameterError, match=r"k must lie in 1\.\.161; it is 200"):
        es.spectral.embed_watermark(BALL, KEY, k=200)
    with pytest.raises(es.InvalidParameterError, match="The suspect must have the vertices of"):
        es.spectral.detect_watermark(BALL, es.icosphere(1), KEY)
    with pytest.raises(es.InvalidShapeError, match="The suspect must have an extent; all of its"):
        detect(np.ones((162, 3)))
