import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import boundary_edges, disjoint_union
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import grid, icosphere, torus
from eigenshape.spectral.signatures.heat import (
    default_times,
    heat_kernel_signature,
    reflection_free_signature,
    scale_invariant_signature,
)
from eigenshape.spectral.solve import solve_spectrum

TIMES = [0.01, 0.1, 1.0]


@pytest.mark.parametrize("k", [1, 20, 63])
def test_heat_sums_to_the_trace(k):
    laplacian = cotangent_laplacian(torus(9, 7))
    spectrum = solve_spectrum(laplacian, k)
    heat = heat_kernel_signature(spectrum, TIMES)
    assert heat.shape == (63, 3)
    trace = np.exp(-np.outer(TIMES, spectrum.eigenvalues)).sum(axis=1)
    np.testing.assert_allclose(laplacian.mass.diagonal() @ heat, trace, rtol=1e-12)


def test_at_first_all_heat_is_where_it_was_put():
    laplacian = cotangent_laplacian(torus(9, 7))
    heat = heat_kernel_signature(solve_spectrum(laplacian, 63), [1e-12])
    np.testing.assert_allclose(heat[:, 0], 1 / laplacian.mass.diagonal(), rtol=1e-8)


def test_in_the_end_heat_is_even():
    laplacian = cotangent_laplacian(torus(9, 7))
    heat = heat_kernel_signature(solve_spectrum(laplacian, 10), [1e3])
    np.testing.assert_allclose(heat, 1 / laplacian.mass.sum(), rtol=1e-10)


def test_heat_only_decays():
    heat = heat_kernel_signature(
        solve_spectrum(cotangent_laplacian(grid(6, 5)), 30), np.geomspace(1e-3, 1, 12)
    )
    assert (np.diff(heat, axis=1) < 0).all()
    assert (heat > 0).all()


def test_on_a_sphere_heat_is_that_of_legendre_series():
    # h_t = sum_l (2l + 1) exp(-l (l + 1) t) / 4π at every point.
    times = np.array([0.2, 0.5])
    heat = heat_kernel_signature(
        solve_spectrum(cotangent_laplacian(icosphere(3), "averaged"), 100), times
    )
    degrees = np.arange(10)[:, None]
    series = ((2 * degrees + 1) * np.exp(-degrees * (degrees + 1) * times)).sum(axis=0) / (
        4 * np.pi
    )
    np.testing.assert_allclose(heat, np.tile(series, (len(heat), 1)), rtol=0.02)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_times_must_be_positive(bad):
    spectrum = solve_spectrum(cotangent_laplacian(icosphere(0)), 3)
    with pytest.raises(
        InvalidParameterError, match=rf"times must be positive and finite; entry 1 is {bad}"
    ):
        heat_kernel_signature(spectrum, [1.0, bad])


@pytest.mark.parametrize(
    ("times", "shape"), [(np.ones((2, 2)), r"\(2, 2\)"), (np.empty(0), r"\(0,\)")]
)
def test_times_must_be_a_list(times, shape):
    spectrum = solve_spectrum(cotangent_laplacian(icosphere(0)), 3)
    with pytest.raises(
        InvalidParameterError, match=rf"times must be a list of numbers; the shape is {shape}"
    ):
        heat_kernel_signature(spectrum, times)


def test_a_straight_edge_leaves_no_trace_in_the_mean():
    # 1/(4πt) is the heat of the whole plane; at t = 0.01 the far sides, 0.5 away, add less than exp(-25) of it.
    mesh, t = grid(40, 40), 0.01
    laplacian = cotangent_laplacian(mesh, "averaged")
    neumann = solve_spectrum(laplacian, 110)
    dirichlet = solve_spectrum(laplacian, 110, fixed=np.unique(boundary_edges(mesh)))
    middle = mesh.vertices[:, 1] == 0.5
    free = reflection_free_signature(neumann, dirichlet, [t])[middle, 0] * 4 * np.pi * t
    reflected = heat_kernel_signature(neumann, [t])[middle, 0] * 4 * np.pi * t
    np.testing.assert_allclose(free, 1, atol=0.04)
    assert reflected[0] == pytest.approx(2, rel=0.04)
    np.testing.assert_allclose(
        reflected,
        1 + np.exp(-((np.arange(41) / 40) ** 2) / t) + np.exp(-((1 - np.arange(41) / 40) ** 2) / t),
        atol=0.06,
    )


def test_spectra_of_two_surfaces_are_refused():
    one, two = (solve_spectrum(cotangent_laplacian(icosphere(level)), 3) for level in (0, 1))
    with pytest.raises(
        InvalidParameterError, match="must be of the same surface; they have 12 and 42 points"
    ):
        reflection_free_signature(one, two, [1.0])


@pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")
def test_default_times_span_what_the_spectrum_tells():
    spectrum = solve_spectrum(cotangent_laplacian(torus(12, 9)), 30)
    times = default_times(spectrum, 20)
    assert len(times) == 20
    np.testing.assert_allclose(np.exp(-times[0] * spectrum.eigenvalues[-1]), 1e-4)
    np.testing.assert_allclose(np.exp(-times[-1] * spectrum.eigenvalues[1]), 1e-4)
    assert np.ptp(np.diff(np.log(times))) < 1e-12
    pieces = solve_spectrum(cotangent_laplacian(disjoint_union(icosphere(1), torus(9, 7))), 10)
    assert default_times(pieces, 2)[-1] == pytest.approx(4 * np.log(10) / pieces.eigenvalues[2])
    with pytest.raises(
        InvalidParameterError, match="must have an eigenvalue above 0; its 2 are all 0"
    ):
        default_times(
            solve_spectrum(cotangent_laplacian(disjoint_union(icosphere(1), torus(9, 7))), 2)
        )


@pytest.mark.parametrize("scale", [1e-100, 1e100, 3.0])
def test_size_leaves_no_trace_in_the_scale_invariant_signature(scale):
    mesh = torus(24, 12)
    one, two = (
        solve_spectrum(cotangent_laplacian(TriangleMesh(mesh.vertices * size, mesh.faces)), 60)
        for size in (1.0, scale)
    )
    found = scale_invariant_signature(one)
    assert found.shape == (288, 6)
    np.testing.assert_allclose(scale_invariant_signature(two), found, rtol=1e-7)
    assert found.std(axis=0).max() > 0.01  # and points differ


def test_with_the_same_times_size_leaves_little_trace():
    # As Bronstein and Kokkinos do, with times at whose ends all heat is where it was put, or even.
    mesh = torus(24, 12)
    one, two = (
        solve_spectrum(cotangent_laplacian(TriangleMesh(mesh.vertices * size, mesh.faces)), 288)
        for size in (1.0, 2.0)
    )
    times = np.geomspace(default_times(one)[0] / 1e6, default_times(two)[-1] * 100, 400)
    found = [scale_invariant_signature(spectrum, times) for spectrum in (one, two)]
    plain = [heat_kernel_signature(spectrum, times) for spectrum in (one, two)]
    assert np.abs(found[1] / found[0] - 1).max() < 1e-3
    assert np.abs(plain[1] / plain[0] - 1).max() > 0.7


def test_the_first_frequency_is_the_whole_fall():
    spectrum = solve_spectrum(cotangent_laplacian(torus(12, 9)), 30)
    times = default_times(spectrum)
    heat = heat_kernel_signature(spectrum, times)
    found = scale_invariant_signature(spectrum, times, n_frequencies=1)
    np.testing.assert_allclose(found[:, 0], np.log(heat[:, 0] / heat[:, -1]), rtol=1e-12)


def test_times_of_the_scale_invariant_signature_are_a_geometric_sequence():
    spectrum = solve_spectrum(cotangent_laplacian(icosphere(1)), 9)
    with pytest.raises(
        InvalidParameterError, match="times must be a geometric sequence of at least 3; there are 3"
    ):
        scale_invariant_signature(spectrum, [1.0, 2.0, 3.0])
    with pytest.raises(
        InvalidParameterError, match="there are 1, with ratios of neighbors from 1 to 1"
    ):
        scale_invariant_signature(spectrum, [1.0])
    with pytest.raises(InvalidParameterError, match=r"n_frequencies must lie in 1\.\.2; it is 3"):
        scale_invariant_signature(spectrum, [1.0, 2.0, 4.0, 8.0], n_frequencies=3)
