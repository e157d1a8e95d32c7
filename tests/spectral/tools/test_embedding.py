"""Embeddings and distances: what is known in closed form, and what no choice of basis changes."""

from dataclasses import replace
from functools import partial
from inspect import unwrap  # past the check of types, which only tests have

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import eigenshape as es
from certeig.kit import memory
from eigenshape.geometry.topology import disjoint_union
from eigenshape.spectral.tools.embedding import component_labels

BALL = es.icosphere(2)
SPECTRUM = es.solve_spectrum(es.cotangent_laplacian(BALL), 36)
TWO = disjoint_union(BALL, es.TriangleMesh(BALL.vertices * 0.5 + 5, BALL.faces))
DISTANCES = {
    "commute-time": partial(es.spectral.spectral_distances, method="commute-time"),
    "biharmonic": es.spectral.spectral_distances,
    "diffusion": partial(es.spectral.spectral_distances, method="diffusion", t=0.1),
}


def graph_of(seed, n=12):
    """Return a connected graph with random weights."""
    rng = np.random.default_rng(seed)
    weights = np.triu(rng.uniform(0.1, 2.0, (n, n)) * (rng.random((n, n)) < 0.3), 1)
    weights[np.arange(n - 1), np.arange(1, n)] = 1.0
    return sp.csr_array(weights + weights.T)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["weighted", "normalized"]))
def test_commute_time_distances_are_effective_resistances(seed, kind):
    laplacian = es.operators.graph_laplacian(graph_of(seed), kind)
    found = DISTANCES["commute-time"](es.solve_spectrum(laplacian, 12)) ** 2
    inverse = np.linalg.pinv(laplacian.stiffness.toarray())
    diagonal = np.diag(inverse)
    np.testing.assert_allclose(found, diagonal[:, None] + diagonal - 2 * inverse, atol=1e-9)


@pytest.mark.parametrize("name", DISTANCES)
@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 2**32 - 1))
def test_distances_do_not_depend_on_the_basis_of_an_eigenspace(name, seed):
    """The eigenvalues of a sphere are multiple: 1, 3, 5, ... eigenvectors can be rotated."""
    rng = np.random.default_rng(seed)
    values, modes = SPECTRUM.eigenvalues.copy(), SPECTRUM.eigenvectors.copy()
    for start, stop in ((1, 4), (4, 9), (9, 16)):
        values[start:stop] = values[start:stop].mean()
        rotation = np.linalg.qr(rng.standard_normal((stop - start, stop - start)))[0]
        modes[:, start:stop] = modes[:, start:stop] @ rotation
    signs = rng.choice([-1.0, 1.0], len(values))
    one = replace(SPECTRUM, eigenvalues=values)
    other = replace(one, eigenvectors=modes * signs)
    points = [0, 5, 100]
    np.testing.assert_allclose(
        DISTANCES[name](other, points), DISTANCES[name](one, points), atol=1e-12
    )


@pytest.mark.parametrize("name", DISTANCES)
def test_distances_are_a_metric(name):
    found = DISTANCES[name](SPECTRUM)
    np.testing.assert_array_equal(found, found.T)
    assert not found.diagonal().any()
    assert (found + np.eye(len(found)) > 0).all()
    through = found[:, :, None] + found[None, :, :]
    assert (found[:, None, :] <= through + 1e-12).all()
    np.testing.assert_array_equal(DISTANCES[name](SPECTRUM, [3, 8]), found[:, [3, 8]])


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("commute-time", lambda last: 1 / last),
        ("biharmonic", lambda last: 1 / last**2),
        ("diffusion", lambda last: np.exp(-0.2 * last)),
    ],
)
def test_what_is_cut_off_stays_within_the_stated_bound(name, factor):
    n = BALL.n_vertices
    laplacian = es.cotangent_laplacian(BALL)
    whole = es.solve_spectrum(laplacian, n)
    exact = DISTANCES[name](whole) ** 2
    for k in (9, 40, 120):
        part = es.solve_spectrum(laplacian, k)
        cut_off = exact - DISTANCES[name](part) ** 2
        masses = 1 / laplacian.mass.diagonal()
        kept = es.spectral.spectral_embedding(part)
        squares = ((kept[:, None] - kept[None]) ** 2).sum(axis=2)
        bound = (masses[:, None] + masses - squares) * factor(part.eigenvalues[-1])
        assert (cut_off > -1e-10).all()
        assert (cut_off <= bound + 1e-10).all()


def test_scalings_are_powers_of_the_eigenvalues():
    plain = es.spectral.spectral_embedding(SPECTRUM, 8)
    np.testing.assert_array_equal(plain, SPECTRUM.eigenvectors[:, 1:9])
    values = SPECTRUM.eigenvalues[1:9]
    for power in (-0.5, -1.0, 2.0):
        scaled = es.spectral.spectral_embedding(SPECTRUM, 8, power=power)
        np.testing.assert_allclose(scaled, plain * values**power)
    heat = es.spectral.spectral_embedding(SPECTRUM, 8, t=0.1)
    np.testing.assert_allclose(heat, plain * np.exp(-0.1 * values))


@pytest.mark.parametrize("rotate", [False, True])
def test_components_are_infinitely_far_and_keep_their_own_distances(rotate):
    spectrum = es.solve_spectrum(es.cotangent_laplacian(TWO), 50)
    if rotate:  # any basis of the two constant modes will do
        modes = spectrum.eigenvectors.copy()
        modes[:, :2] = modes[:, :2] @ [[0.6, 0.8], [-0.8, 0.6]]
        spectrum = replace(spectrum, eigenvectors=modes)
    n = BALL.n_vertices
    assert es.spectral.spectral_embedding(spectrum).shape == (2 * n, 48)
    labels = component_labels(spectrum)
    assert len(set(labels[:n].tolist())) == len(set(labels[n:].tolist())) == 1
    assert labels[0] != labels[-1]
    for name in ("commute-time", "biharmonic"):
        found = DISTANCES[name](spectrum, [0, n])
        assert np.isinf(found[n:, 0]).all()
        assert np.isinf(found[:n, 1]).all()
        assert np.isfinite(found[:n, 0]).all()
    # Heat stays in each component: the distance is at least that of the two constants.
    areas = [es.geometry.surface_area(mesh) for mesh in (BALL, TWO)]
    least = np.sqrt(1 / areas[0] + 1 / (areas[1] - areas[0]))
    late = es.spectral.spectral_distances(spectrum, [0], method="diffusion", t=20.0)[n:, 0]
    np.testing.assert_allclose(late, least, rtol=1e-6)


def test_clouds_and_graphs_have_distances_too():
    cloud = es.PointCloud(es.icosphere(3).vertices, dim=2)
    spectrum = es.solve_spectrum(es.point_cloud_laplacian(cloud), 20)
    found = es.spectral.spectral_distances(spectrum, [0])[:, 0]
    across = np.linalg.norm(cloud.points + cloud.points[0], axis=1)
    assert across[found.argmax()] < 0.1


def test_distances_scale_with_the_unit():
    large = es.solve_spectrum(
        es.cotangent_laplacian(es.TriangleMesh(BALL.vertices * 2.0**40, BALL.faces)), 36
    )
    one, other = (es.spectral.spectral_distances(each, [0]) for each in (SPECTRUM, large))
    np.testing.assert_allclose(other, one * 2.0**40, rtol=1e-9)


def test_pairs_that_do_not_fit_into_memory_are_refused(monkeypatch):
    monkeypatch.setattr(memory, "machine_memory", lambda: 1e5)
    with pytest.raises(es.InvalidParameterError, match="162 × 162 pairs of points"):
        es.spectral.spectral_distances(SPECTRUM)


@pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")
def test_bad_input_is_named():
    with pytest.raises(es.InvalidParameterError, match=r"n_dims must lie in 1\.\.35"):
        es.spectral.spectral_embedding(SPECTRUM, 36)
    with pytest.raises(
        es.InvalidParameterError, match=r"n_dims must be a whole number; it is array\(2\.5\)"
    ):
        unwrap(es.spectral.spectral_embedding)(SPECTRUM, np.array(2.5))
    with pytest.raises(es.InvalidParameterError, match="power must be one finite number"):
        es.spectral.spectral_embedding(SPECTRUM, power=np.inf)
    for t in (0.0, -1.0, np.nan):
        with pytest.raises(es.InvalidParameterError, match="t must be positive and finite"):
            es.spectral.spectral_distances(SPECTRUM, method="diffusion", t=t)
    with pytest.raises(es.InvalidParameterError, match="t must be one number; there are"):
        unwrap(es.spectral.spectral_embedding)(SPECTRUM, t=[0.1, 0.2])
    for options in ({"method": "diffusion"}, {"t": 0.1}):
        with pytest.raises(es.InvalidParameterError, match="and no others, take a time t"):
            es.spectral.spectral_distances(SPECTRUM, **options)
    with pytest.raises(es.InvalidParameterError, match="method must be one of biharmonic"):
        unwrap(es.spectral.spectral_distances)(SPECTRUM, method="geodesic")
    with pytest.raises(es.InvalidParameterError, match=r"A point must lie in 0\.\.161; it is 162"):
        es.spectral.spectral_distances(SPECTRUM, [162])
    constants = es.solve_spectrum(es.cotangent_laplacian(TWO), 2)
    with pytest.raises(es.InvalidParameterError, match="must have a mode that is not constant"):
        es.spectral.spectral_distances(constants)
    interval = es.solve_spectrum(es.cotangent_laplacian(BALL), above=1.0, below=7.0)
    with pytest.raises(es.InvalidParameterError, match="must begin with the lowest eigenvalue"):
        es.spectral.spectral_embedding(interval)
