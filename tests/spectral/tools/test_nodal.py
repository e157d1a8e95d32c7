"""Nodal domains, counted by hand and against Courant's bound."""

import numpy as np
import pytest

import eigenshape as es

PATH = es.geometry.from_arrays(np.arange(6.0)[:, None], [[i, i + 1] for i in range(5)])


def test_domains_of_a_path_are_counted_by_hand():
    domains = es.spectral.nodal_domains(PATH, [-1, -2, 0, -1, 3, -4])
    assert domains.labels.tolist() == [0, 0, -1, 1, 2, 3]
    assert domains.signs.tolist() == [-1, -1, 1, -1]
    assert domains.sizes.tolist() == [2, 1, 1, 1]
    assert domains.n_domains == 4


def test_rounding_errors_around_zero_are_in_no_domain():
    noisy = [1, 1, 1e-15, -1e-15, 1, 1]
    assert es.spectral.nodal_domains(PATH, noisy).n_domains == 2
    assert es.spectral.nodal_domains(PATH, noisy, zero=0).n_domains == 3


def test_the_zero_function_has_no_domain():
    assert es.spectral.nodal_domains(PATH, np.zeros(6)).n_domains == 0


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_units_do_not_matter(scale):
    ball = es.icosphere(2)
    values = ball.vertices[:, 0] * ball.vertices[:, 1]
    plain = es.spectral.nodal_domains(ball, values)
    scaled = es.spectral.nodal_domains((ball.vertices * scale, ball.faces), values * scale)
    np.testing.assert_array_equal(plain.labels, scaled.labels)
    assert plain.n_domains == 4


def test_an_interval_has_one_domain_more_for_each_mode():
    interval = es.geometry.from_arrays(
        np.linspace(0, 1, 40)[:, None], [[i, i + 1] for i in range(39)]
    )
    spectrum = es.solve_spectrum(es.cotangent_laplacian(interval), 12)
    counts = [
        es.spectral.nodal_domains(interval, column).n_domains for column in spectrum.eigenvectors.T
    ]
    assert counts == list(range(1, 13))
    assert es.spectral.courant_bounds(spectrum).tolist() == counts


@pytest.mark.parametrize(
    "mesh",
    [
        es.icosphere(2),
        es.shapes.grid(9, 9),
        (es.icosphere(2).vertices * [1, 2, 3], es.icosphere(2).faces),
        es.geometry.disjoint_union(es.icosphere(1), es.shapes.grid(4, 7)),
    ],
    ids=["sphere", "square", "ellipsoid", "two pieces"],
)
def test_courant_s_bound_holds_on_graphs(mesh):
    spectrum = es.solve_spectrum(es.operators.graph_laplacian(mesh, "combinatorial"), 40)
    bounds = es.spectral.courant_bounds(spectrum)
    counts = [
        es.spectral.nodal_domains(mesh, column).n_domains for column in spectrum.eigenvectors.T
    ]
    assert (np.array(counts) <= bounds).all()
    assert bounds[-1] >= 40


def test_the_bound_counts_eigenvalues_below_an_interval():
    laplacian = es.cotangent_laplacian(es.icosphere(2))
    spectrum = es.solve_spectrum(laplacian, above=1.0, below=7.0)
    assert es.spectral.courant_bounds(spectrum).tolist() == [4, 4, 4, 9, 9, 9, 9, 9]


def test_a_cluster_that_is_cut_counts_whole():
    spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 6)
    assert es.spectral.courant_bounds(spectrum).tolist() == [1, 4, 4, 4, 9, 9]


def test_nodal_lines_of_a_square_are_measured_by_hand():
    square = es.shapes.grid(8, 8)
    x, y, _ = square.vertices.T
    cross = es.spectral.nodal_set(square, (x - 0.45) * (y - 0.3))
    assert cross.size == pytest.approx(2, rel=0.02)
    line = es.spectral.nodal_set(square, x - 0.3)
    (points,) = line.polylines()
    np.testing.assert_allclose(points[:, 0], 0.3, atol=1e-15)
    assert sorted(points[[0, -1], 1].tolist()) == [0, 1]
    assert line.size == pytest.approx(1, rel=1e-12)


def test_noise_around_a_nodal_line_does_not_move_it():
    ball = es.icosphere(3)
    height = ball.vertices[:, 2]
    noise = 1e-13 * np.random.default_rng(0).normal(size=len(height))
    plain, noisy = (es.spectral.nodal_set(ball, values) for values in (height, height + noise))
    np.testing.assert_array_equal(plain.edges, noisy.edges)
    assert len(noisy.polylines()) == 1


def test_bad_arguments_are_named():
    with pytest.raises(es.InvalidParameterError, match="values must hold one number per vertex"):
        es.spectral.nodal_domains(PATH, np.ones(5))
    with pytest.raises(es.InvalidParameterError, match="values must be finite; entry 1 is nan"):
        es.spectral.nodal_domains(PATH, [1, np.nan, 1, 1, 1, 1])
    with pytest.raises(es.InvalidParameterError, match="zero must be at least 0 and less than 1"):
        es.spectral.nodal_domains(PATH, np.ones(6), zero=1.0)
