import numpy as np
import pytest

import eigenshape as es

SPECTRUM = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 9)
RATE = 116.0


def test_the_answer_to_a_step_is_that_of_a_damped_oscillator():
    dt, n_times = 2e-4, 400
    found = es.modes.wave_response(np.ones((9, n_times)), SPECTRUM, dt, length_scale=2.0)
    for j in (0, 3, 8):
        frequency = RATE * 2.0 * np.sqrt(SPECTRUM.eigenvalues[j])
        t = dt * np.arange(n_times)
        # sin(ωt)/ω at ω = 0 is t.
        sine = t * np.sinc(frequency * t / np.pi)
        decay = np.exp(-RATE * t) * (np.cos(frequency * t) + RATE * sine)
        expected = (1 - decay) / (1 + 4 * SPECTRUM.eigenvalues[j])
        np.testing.assert_allclose(found[j], expected, atol=1e-12)


def test_steps_of_half_the_length_change_nothing_for_a_linear_drive():
    drive = np.outer(np.arange(1.0, 5.0), np.linspace(0, 1, 50))
    fine = np.outer(np.arange(1.0, 5.0), np.linspace(0, 1, 99))
    coarse = es.modes.wave_response(drive, SPECTRUM, 2e-3)
    np.testing.assert_allclose(
        es.modes.wave_response(fine, SPECTRUM, 1e-3)[:, ::2], coarse, atol=1e-12
    )
    blood = es.modes.blood_response(drive, 0.2)
    np.testing.assert_allclose(es.modes.blood_response(fine, 0.1)[:, ::2], blood, atol=1e-12)


def test_blood_commutes_with_modes():
    activity = np.random.default_rng(0).normal(size=(9, 60))
    of_maps = es.modes.blood_response(SPECTRUM.eigenvectors @ activity, 0.1)
    np.testing.assert_allclose(
        of_maps, SPECTRUM.eigenvectors @ es.modes.blood_response(activity, 0.1), atol=1e-12
    )


def test_steady_activity_ends_at_the_gain_of_the_model():
    """At rest f = x/γ, v = α f, q = (e - (1 - α)) f."""
    signal = es.modes.blood_response(np.ones((1, 600)), 0.1)[0, -1]
    e = 1 + 0.66 * np.log(0.66) / 0.34
    flow = 1 / 0.41
    expected = 0.02 * ((0.527 - 0.48) * 0.32 * flow - (3.72 + 0.527) * (e - 0.68) * flow)
    assert signal == pytest.approx(expected, rel=1e-6)


def test_little_activity_is_as_linear_and_much_of_it_saturates():
    activity = np.zeros((2, 150))
    activity[:, :20] = [[1e-4], [1.0]]
    linear = es.modes.blood_response(activity, 0.1)
    found = es.modes.blood_response(activity, 0.1, linear=False)
    np.testing.assert_allclose(found[0], linear[0], atol=1e-3 * linear[0].max())
    assert found[1].max() < 0.8 * linear[1].max()
    fine = np.zeros((1, 299))
    fine[:, :39] = 1.0
    fine[:, 39] = 0.5
    twice = es.modes.blood_response(fine, 0.05, linear=False)[:, ::2]
    np.testing.assert_allclose(twice[0], found[1], atol=1e-5 * found[1].max())


def test_bad_input_is_named():
    with pytest.raises(
        es.InvalidParameterError, match=r"one row per mode, 1 to 9, .* shape is \(10, 4\)"
    ):
        es.modes.wave_response(np.ones((10, 4)), SPECTRUM, 0.1)
    with pytest.raises(
        es.InvalidParameterError, match=r"activity must have .* the shape is \(4,\)"
    ):
        es.modes.blood_response(np.ones(4), 0.1)
    with pytest.raises(es.InvalidParameterError, match=r"length_scale and damping"):
        es.modes.wave_response(np.ones((2, 4)), SPECTRUM, 0.1, damping=0.0)
    with pytest.raises(es.InvalidParameterError, match=r"dt must be positive"):
        es.modes.blood_response(np.ones((2, 4)), -0.1)
    strong = np.zeros((3, 50))
    strong[1] = -5.0
    with pytest.raises(
        es.InvalidParameterError, match=r"row 1 do not, at time \d+, with an activity of -5"
    ):
        es.modes.blood_response(strong, 0.1, linear=False)
    with pytest.raises(es.InvalidParameterError, match=r"drive must be finite"):
        es.modes.wave_response(np.full((2, 4), np.nan), SPECTRUM, 0.1)
