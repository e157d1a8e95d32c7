import dataclasses
from inspect import unwrap

import numpy as np
import pytest

import eigenshape as es

MESH = es.make_creature("quadruped", n_vertices=500)
N = MESH.n_vertices
SPECTRUM = es.solve_spectrum(es.cotangent_laplacian(MESH), 52)
MAP = np.sin(4 * MESH.vertices[:, 0]) + MESH.vertices[:, 1]


RNG = np.random.default_rng(0)


def draw(values=MAP, n_nulls=20, seed=0, **options):
    return es.modes.rotation_nulls(
        values, SPECTRUM, n_nulls, rng=np.random.default_rng(seed), **options
    )


def test_each_group_keeps_its_energy_and_the_mean_stays():
    nulls = es.spectral.project(draw(), SPECTRUM)
    expected = es.spectral.project(MAP, SPECTRUM)
    np.testing.assert_allclose(nulls[0], expected[0], rtol=1e-9)
    for degree in range(1, 7):
        group = slice(degree**2, (degree + 1) ** 2)
        energies = SPECTRUM.eigenvalues[group] @ nulls[group] ** 2
        np.testing.assert_allclose(
            energies, SPECTRUM.eigenvalues[group] @ expected[group] ** 2, rtol=1e-9
        )
    # 52 modes hold 7 groups of 1, 3, ..., 13; the last 3 modes are in none.
    assert abs(nulls[49:]).max() < 1e-9


def test_rotated_coefficients_are_uniform_on_a_sphere():
    """Their second moments are those of a uniform direction, I/d, within five standard errors."""
    coefficients = es.spectral.project(draw(n_nulls=4000), SPECTRUM)[1:4]
    directions = np.sqrt(SPECTRUM.eigenvalues[1:4, None]) * coefficients
    directions /= np.linalg.norm(directions, axis=0)
    error = 5 * np.sqrt((1 / 5 - 1 / 9) / 4000)
    np.testing.assert_allclose(np.diag(directions @ directions.T) / 4000, 1 / 3, atol=error)
    assert abs(directions.mean(axis=1)).max() < 5 * np.sqrt(1 / 3 / 4000)


@pytest.mark.parametrize("n_maps", [2, 5])
def test_maps_turn_together(n_maps):
    """One rotation for all maps: products of weighted coefficients stay, and orientation does."""
    rng = np.random.default_rng(3)
    maps = np.column_stack([MAP, rng.normal(size=(N, n_maps - 1))])
    nulls = draw(maps, n_nulls=6)
    assert nulls.shape == (N, 6, n_maps)
    own = es.spectral.project(maps, SPECTRUM)
    for index in range(6):
        drawn = es.spectral.project(nulls[:, index], SPECTRUM)
        for degree in range(1, 7):
            group = slice(degree**2, (degree + 1) ** 2)
            roots = np.sqrt(SPECTRUM.eigenvalues[group, None])
            before, after = roots * own[group], roots * drawn[group]
            np.testing.assert_allclose(after.T @ after, before.T @ before, atol=1e-9)
            if n_maps >= 2 * degree + 1:
                size = 2 * degree + 1
                turn = np.linalg.det(after[:, :size]) / np.linalg.det(before[:, :size])
                assert turn == pytest.approx(1.0)


def test_residuals():
    rest = MAP - es.spectral.reconstruct(es.spectral.project(MAP, SPECTRUM)[:49], SPECTRUM)
    bare, added, permuted = (draw(residual=kind) for kind in ("none", "add", "permute"))
    np.testing.assert_allclose(added - bare, np.repeat(rest[:, None], 20, axis=1), atol=1e-12)
    np.testing.assert_allclose(
        np.sort(permuted - bare, axis=0), np.repeat(np.sort(rest)[:, None], 20, axis=1), atol=1e-12
    )
    assert abs((permuted - bare) - rest[:, None]).max() > 0.01


def test_values_of_the_map_in_the_order_of_the_null():
    bare, exact, affine = (draw(resample=kind) for kind in ("none", "exact", "affine"))
    for one, two in zip(exact.T, bare.T, strict=True):
        np.testing.assert_array_equal(np.sort(one), np.sort(MAP))
        np.testing.assert_array_equal(np.argsort(one), np.argsort(two))
    weights = SPECTRUM.mass.diagonal() / SPECTRUM.mass.diagonal().sum()
    np.testing.assert_allclose(weights @ affine, weights @ MAP)
    spread = weights @ (affine - weights @ affine) ** 2
    np.testing.assert_allclose(spread, weights @ (MAP - weights @ MAP) ** 2)


def test_the_generator_decides():
    assert np.array_equal(draw(seed=1), draw(seed=1))
    assert not np.array_equal(draw(seed=1), draw(seed=2))


def test_bad_input_is_named():
    with pytest.raises(
        es.InvalidParameterError, match="residual must be 'none', 'add' or 'permute'; it is 'all'"
    ):
        unwrap(es.modes.rotation_nulls)(MAP, SPECTRUM, 5, rng=RNG, residual="all")
    with pytest.raises(
        es.InvalidParameterError, match="resample must be 'none', 'exact' or 'affine'; it is 1"
    ):
        unwrap(es.modes.rotation_nulls)(MAP, SPECTRUM, 5, rng=RNG, resample=1)
    with pytest.raises(es.InvalidParameterError, match=r"values must be finite; entry 3 is nan"):
        draw(np.where(np.arange(N) == 3, np.nan, MAP))
    few = es.solve_spectrum(es.cotangent_laplacian(MESH), 3)
    with pytest.raises(es.InvalidParameterError, match="need at least 4 modes; there are 3"):
        es.modes.rotation_nulls(MAP, few, rng=np.random.default_rng(0))
    with pytest.raises(
        es.InvalidParameterError, match=r"Nulls must fit into .* Draw fewer at a time"
    ):
        draw(n_nulls=10**9)
    ball = es.icosphere(1)
    two = es.TriangleMesh(
        np.concatenate([ball.vertices, ball.vertices + 3]),
        np.concatenate([ball.faces, ball.faces + 42]),
    )
    apart = es.solve_spectrum(es.cotangent_laplacian(two), 9)
    with pytest.raises(es.InvalidParameterError, match="that of a connected shape; there are 2"):
        es.modes.rotation_nulls(two.vertices[:, 0], apart, rng=np.random.default_rng(0))


def test_the_spectrum_is_from_the_lowest_mode_on():
    certificate = dataclasses.replace(SPECTRUM.certificate, first=2)
    above = dataclasses.replace(SPECTRUM, certificate=certificate)
    with pytest.raises(es.InvalidParameterError, match="must begin with the lowest"):
        es.modes.rotation_nulls(MAP, above, rng=np.random.default_rng(0))
