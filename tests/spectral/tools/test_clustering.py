"""Clusters: known divisions, the bound of the relaxation, and data sets of scikit-learn."""

import subprocess
import sys
from importlib import import_module
from inspect import unwrap  # past the check of types, which only tests have

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn import datasets
from sklearn.cluster import SpectralClustering
from sklearn.metrics import adjusted_rand_score
from sklearn.preprocessing import StandardScaler

import eigenshape as es

METHODS = ("k-means", "normalized-cut")


def planted(sizes, seed, noise=0.02):
    """Return a graph of dense groups with a few weak edges between them, and the groups."""
    rng = np.random.default_rng(seed)
    groups = np.repeat(np.arange(len(sizes)), sizes)
    same = groups[:, None] == groups
    weights = np.triu(np.where(same, rng.uniform(0.5, 1.0, same.shape), noise), 1)
    return sp.csr_array(weights + weights.T), groups


def spectrum_of(graph, k):
    return es.solve_spectrum(es.operators.graph_laplacian(graph, "normalized"), k)


@pytest.mark.parametrize("method", METHODS)
@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 2**32 - 1))
def test_planted_groups_are_found_whatever_the_order_of_points(method, seed):
    graph, groups = planted((8, 12, 20), seed)
    order = np.random.default_rng(seed).permutation(len(groups))
    spectrum = spectrum_of(graph[order][:, order], 8)
    assert es.spectral.count_clusters(spectrum) == 3
    found = es.spectral.spectral_clusters(spectrum, method=method)
    assert adjusted_rand_score(groups[order], found) == 1
    first = [found.tolist().index(number) for number in range(3)]
    assert first == sorted(first)


def test_the_cut_is_at_least_the_sum_of_the_lowest_eigenvalues():
    graph, groups = planted((8, 12, 20), 0)
    laplacian = es.operators.graph_laplacian(graph, "normalized")
    values = es.solve_spectrum(laplacian, 3).eigenvalues
    rng = np.random.default_rng(0)
    best = es.spectral.normalized_cut(laplacian, groups)
    assert values.sum() <= best < 1.2 * values.sum()
    for _ in range(20):
        assert es.spectral.normalized_cut(laplacian, rng.permutation(groups)) > best


def test_parts_of_a_surface_are_clusters():
    ball = es.icosphere(2)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(ball), 4)
    labels = es.spectral.spectral_clusters(spectrum, 4)
    assert set(labels.tolist()) == {0, 1, 2, 3}


def test_one_cluster_is_everything():
    graph, _ = planted((8, 12), 0)
    assert not es.spectral.spectral_clusters(spectrum_of(graph, 4), 1).any()


@pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")
def test_bad_input_is_named():
    graph, groups = planted((8, 12, 20), 0, noise=0.0)
    spectrum = spectrum_of(graph, 8)
    for few in (1, 2):
        with pytest.raises(es.InvalidParameterError, match="at least the number of components, 3"):
            es.spectral.spectral_clusters(spectrum, few)
    with pytest.raises(es.InvalidParameterError, match=r"n_clusters must lie in 1\.\.8; it is 9"):
        es.spectral.spectral_clusters(spectrum, 9)
    with pytest.raises(es.InvalidParameterError, match="'k-means' or 'normalized-cut'"):
        unwrap(es.spectral.spectral_clusters)(spectrum, 3, method="ward")
    with pytest.raises(
        es.InvalidParameterError, match="at least 3 eigenvalues; the spectrum has 2"
    ):
        es.spectral.count_clusters(spectrum_of(graph, 2))
    with pytest.raises(es.InvalidParameterError, match=r"most must lie in 2\.\.7"):
        es.spectral.count_clusters(spectrum, 8)
    laplacian = es.operators.graph_laplacian(graph, "normalized")
    with pytest.raises(es.InvalidParameterError, match="labels must hold one whole number per"):
        es.spectral.normalized_cut(laplacian, groups[:5])


def toy_sets(n=500):
    """Return the five data sets of scikit-learn's comparison of clusterings that have clusters."""
    yield datasets.make_circles(n, factor=0.5, noise=0.05, random_state=30), 2
    yield datasets.make_moons(n, noise=0.05, random_state=30), 2
    yield datasets.make_blobs(n, random_state=30), 3
    points, groups = datasets.make_blobs(n, random_state=170)
    yield (points @ [[0.6, -0.6], [-0.4, 0.8]], groups), 3
    yield datasets.make_blobs(n, cluster_std=[1.0, 2.5, 0.5], random_state=170), 3


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::UserWarning")  # theirs, of graphs in several components
def test_toy_sets_are_clustered_as_well_as_by_scikit_learn():
    for (points, groups), n_clusters in toy_sets():
        scaled = StandardScaler().fit_transform(points)
        theirs = SpectralClustering(
            n_clusters, affinity="nearest_neighbors", eigen_solver="arpack", random_state=0
        ).fit_predict(scaled)
        for method in METHODS:
            ours = es.spectral.SpectralClusterer(n_clusters, method=method).fit_predict(scaled)
            least = adjusted_rand_score(groups, theirs) - 1e-9
            assert adjusted_rand_score(groups, ours) >= least


@pytest.mark.long
def test_estimators_pass_the_checks_of_scikit_learn():
    # In a process of its own: the type checks of these tests would refuse the wrong parameters
    # that scikit-learn passes to constructors, which must accept them until `fit`.
    code = (
        "import eigenshape as es\n"
        "from sklearn.utils.estimator_checks import check_estimator\n"
        "check_estimator(es.spectral.SpectralClusterer(2))\n"
        "check_estimator(es.spectral.SpectralEmbedder())\n"
    )
    command = [sys.executable, "-W", "ignore", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]


def test_embeddings_of_data_points():
    angles = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    for method in ("spectral", "commute-time", "biharmonic", "diffusion"):
        embedder = es.spectral.SpectralEmbedder(2, method=method, n_neighbors=5)
        radii = np.linalg.norm(embedder.fit_transform(3 * ring + 7), axis=1)
        np.testing.assert_allclose(radii, radii.mean(), rtol=1e-6)
        assert embedder.n_neighbors_ == 5
        assert embedder.n_features_in_ == 2


def test_separate_points_are_joined_by_more_neighbors():
    far = np.concatenate([np.arange(8.0), 100 + np.arange(8.0)])[:, None]
    clusterer = es.spectral.SpectralClusterer(2, n_neighbors=3).fit(far)
    assert clusterer.n_neighbors_ == 3
    assert clusterer.labels_.tolist() == 8 * [0] + 8 * [1]
    assert es.spectral.SpectralClusterer(n_neighbors=3).fit(far).n_clusters_ == 2
    embedder = es.spectral.SpectralEmbedder(1, n_neighbors=3).fit(far)
    assert embedder.n_neighbors_ == 12


def test_bad_parameters_of_estimators_are_named():
    points = np.random.default_rng(0).standard_normal((20, 2))
    with pytest.raises(es.InvalidParameterError, match=r"n_clusters must lie in 1\.\.20"):
        es.spectral.SpectralClusterer(21).fit(points)
    with pytest.raises(es.InvalidParameterError, match=r"n_components must lie in 1\.\.19"):
        es.spectral.SpectralEmbedder(20).fit(points)
    with pytest.raises(es.InvalidParameterError, match="method must be 'spectral', 'commute"):
        es.spectral.SpectralEmbedder(2).set_params(method="tsne").fit(points)
    with pytest.raises(es.InvalidParameterError, match="n_neighbors must be at least 2"):
        es.spectral.SpectralEmbedder(2, n_neighbors=1).fit(points)


def test_without_scikit_learn_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "sklearn.base", None)
    monkeypatch.delitem(sys.modules, "eigenshape.spectral.tools.estimators")
    with pytest.raises(es.MissingExtraError, match=r"pip install 'eigenshape\[sklearn\]'"):
        import_module("eigenshape.spectral.tools.estimators")


def test_fewer_clusters_than_components_cannot_be_requested():
    edge = sp.csr_array([[0.0, 1.0], [1.0, 0.0]])
    graph = sp.csr_array(sp.block_diag(5 * [edge]))
    spectrum = es.solve_spectrum(es.operators.graph_laplacian(graph, "normalized"), 8)
    assert es.spectral.count_clusters(spectrum, most=5) == 5
    with pytest.raises(
        es.InvalidParameterError, match="most must be at least the number of components, 5; it is 3"
    ):
        es.spectral.count_clusters(spectrum, most=3)


def test_the_cut_of_an_operator_with_corrected_eigenvalues_is_refused():
    ball = es.icosphere(2)
    laplacian = es.mesh_laplacian(ball, correct="log")
    with pytest.raises(es.InvalidParameterError, match="must be given by its matrices alone"):
        es.spectral.normalized_cut(laplacian, np.zeros(ball.n_vertices, dtype=int))


def test_estimators_name_a_shape_that_is_given_for_points():
    ball = es.icosphere(1)
    for estimator in (es.spectral.SpectralEmbedder, es.spectral.SpectralClusterer):
        with pytest.raises(
            es.InvalidParameterError, match=r"takes \(n, d\) data points; X is a Tri"
        ):
            estimator().fit(ball)
