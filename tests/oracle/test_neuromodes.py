"""Nulls, waves and blood signals beside neuromodes, on a cortex of its wheel (used in place)."""

import lapy
import numpy as np
import pytest

import eigenshape as es

neuromodes = pytest.importorskip("neuromodes")
waves = pytest.importorskip("neuromodes.waves")
N_NULLS = 400
TIGHT = {"rtol": 1e-10, "atol": 1e-12}


@pytest.fixture(scope="module")
def cortex():
    """Return a cortex without its medial wall, 100 modes and a map of myelin, and neuromodes' solver with them."""
    whole, mask = neuromodes.io.fetch_example_surf(density="4k")
    data = neuromodes.io.fetch_example_map("myelinmap", density="4k")[mask]
    solver = neuromodes.EigenSolver(whole, mask=mask).solve(100)
    mesh = solver.geometry
    laplacian = es.cotangent_laplacian((mesh.v, mesh.t), "consistent")
    return es.solve_spectrum(laplacian, 100), solver, data, mesh


def variogram(nulls: np.ndarray, mesh: lapy.TriaMesh) -> np.ndarray:
    """Return the mean of half the squared differences at pairs of points by eight distances, for each null."""
    some = np.arange(0, len(mesh.v), 20)
    first, second = np.triu_indices(len(some), 1)
    distances = np.linalg.norm(mesh.v[some[first]] - mesh.v[some[second]], axis=1)
    rows = np.digitize(distances, np.quantile(distances, np.linspace(0, 0.7, 9)[1:-1]))
    halves = (nulls[some[first]] - nulls[some[second]]) ** 2 / 2
    return np.array([halves[rows == row].mean(axis=0) for row in range(8)])


@pytest.mark.parametrize(
    "options", [{}, {"residual": "permute", "resample": "exact"}, {"resample": "affine"}]
)
def test_nulls_have_the_statistics_of_theirs(cortex, options):
    """Means over 400 nulls of each agree within five standard errors of their difference."""
    spectrum, solver, data, mesh = cortex
    ours = es.modes.rotation_nulls(data, spectrum, N_NULLS, rng=np.random.default_rng(0), **options)
    theirs = solver.eigenstrap(data, n_nulls=N_NULLS, seed=0, **options)
    areas = spectrum.mass.sum(axis=1)

    def statistics(nulls):
        centered = nulls - areas @ nulls / areas.sum()
        power = es.spectral.project(nulls, spectrum) ** 2
        moments = [areas @ centered**order / areas.sum() for order in (2, 3, 4)]
        degrees = [power[l**2 : (l + 1) ** 2].sum(axis=0) for l in range(10)]  # noqa: E741
        return np.vstack([*moments, *degrees, variogram(nulls, mesh), abs(nulls).max(axis=0)])

    one, two = statistics(ours), statistics(theirs)
    error = np.sqrt((one.var(axis=1) + two.var(axis=1)) / N_NULLS)
    difference = abs(one.mean(axis=1) - two.mean(axis=1))
    # What a null keeps exactly, such as its power, is equal but for rounding.
    assert (difference < 5 * error + 1e-9 * abs(two.mean(axis=1))).all()


def test_waves_are_those_of_their_differential_equations(cortex):
    spectrum, solver, _, _ = cortex
    drive = np.random.default_rng(0).normal(size=(4, 60)).cumsum(axis=1)
    found = es.modes.wave_response(drive, spectrum, 1e-3)
    expected = waves._model_wave_ode(drive, 1e-3, 17.4, 116.0, solver.evals[:4])
    np.testing.assert_allclose(found, expected, atol=1e-3 * abs(expected).max())


def test_the_blood_signal_is_the_limit_of_theirs_for_small_activity(monkeypatch):
    # Their solver allows 1e-6 a step, which adds up to 4e-5, other digits on another CPU.
    solve_ivp = waves.solve_ivp
    monkeypatch.setattr(waves, "solve_ivp", lambda *given, **kw: solve_ivp(*given, **kw | TIGHT))
    activity = np.exp(-((np.arange(200) - 40) ** 2) / 100.0)[None]
    expected = waves._model_balloon_ode(1e-3 * activity, 0.1) / 1e-3
    found = es.modes.blood_response(activity, 0.1)
    np.testing.assert_allclose(found, expected, atol=1e-2 * abs(expected).max())
    theirs = waves._model_balloon_ode(activity, 0.1)
    nonlinear = es.modes.blood_response(activity, 0.1, linear=False)
    np.testing.assert_allclose(nonlinear, theirs, atol=1e-6 * abs(theirs).max())
