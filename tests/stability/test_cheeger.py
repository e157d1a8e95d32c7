"""The narrowest neck: shapes whose isoperimetric constant is known, and what must hold for all."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import eigenshape as es


def estimate(mesh, **options):
    return es.stability.cheeger_estimate(
        mesh, es.solve_spectrum(es.cotangent_laplacian(mesh), 8), **options
    )


def test_the_sphere_is_cut_at_its_equator():
    found = estimate(es.icosphere(4), least_curvature=1.0)
    assert found.upper == pytest.approx(1.0, rel=0.01)  # 2π over 2π
    assert found.spectral == pytest.approx(2 * np.sqrt(2), rel=0.01)
    assert found.lower == pytest.approx(np.sqrt(0.2), rel=0.01)  # λ₁ = 2 ≤ 10 μ²
    assert found.part.sum() == pytest.approx(len(found.part) / 2, rel=0.02)


def test_a_torus_is_cut_by_two_meridians():
    outer, inner = 1.0, 0.4
    found = estimate(es.shapes.torus(96, 48, outer=outer, inner=inner))
    cut = 2 * (2 * np.pi * inner) / (4 * np.pi**2 * outer * inner / 2)
    assert cut <= found.upper <= 1.03 * cut


def dumbbell(neck):
    """Two balls, a thin neck between them."""
    mesh = es.icosphere(5)
    x, y, z = (mesh.vertices * [3, 1, 1]).T
    waist = 1 - (1 - neck) * np.exp(-(x**2))
    return es.TriangleMesh(np.column_stack([x, y * waist, z * waist]), mesh.faces)


@pytest.mark.parametrize("neck", [0.6, 0.4, 0.3])
def test_a_neck_is_found(neck):
    mesh = dumbbell(neck)
    waist = 2 * np.pi * neck / (es.geometry.surface_area(mesh) / 2)
    assert estimate(mesh).upper == pytest.approx(waist, rel=0.05)


@pytest.mark.long
@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10**6), st.floats(-60, 60))
def test_the_bounds_are_in_order_at_every_size(seed, exponent):
    rng = np.random.default_rng(seed)
    mesh = es.icosphere(2)
    bumpy = es.TriangleMesh(
        mesh.vertices * (1 + 0.2 * rng.random((mesh.n_vertices, 1))), mesh.faces
    )
    scaled = es.TriangleMesh(bumpy.vertices * 10**exponent, mesh.faces)
    found, same = estimate(bumpy, least_curvature=-30.0), estimate(scaled)
    assert 0 < found.lower < found.upper
    assert same.upper * 10**exponent == pytest.approx(found.upper, rel=1e-6)
    assert same.lower == 0.0


def test_a_cut_is_as_long_as_told():
    """A square strip: the level lines of its first eigenfunction are straight across."""
    found = estimate(es.shapes.grid(60, 20, width=3.0, height=1.0))
    assert found.upper == pytest.approx(1 / 1.5, rel=0.02)


def test_bad_input_is_named():
    mesh = es.icosphere(2)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 5)
    with pytest.raises(es.InvalidParameterError, match="it has 162 points, the mesh 642"):
        es.stability.cheeger_estimate(es.icosphere(3), spectrum)
    alone = es.solve_spectrum(es.cotangent_laplacian(mesh), 1)
    with pytest.raises(es.InvalidParameterError, match="begins at number 0 and holds 1"):
        es.stability.cheeger_estimate(mesh, alone)
    above = es.solve_spectrum(es.cotangent_laplacian(mesh), above=1.0, below=10.0)
    with pytest.raises(es.InvalidParameterError, match="begins at number 1"):
        es.stability.cheeger_estimate(mesh, above)
    pair = es.geometry.disjoint_union(mesh, es.TriangleMesh(mesh.vertices + 5.0, mesh.faces))
    with pytest.raises(es.InvalidParameterError, match="must be connected; eigenvalue 1 is"):
        es.stability.cheeger_estimate(pair, es.solve_spectrum(es.cotangent_laplacian(pair), 5))
    with pytest.raises(es.InvalidParameterError, match="n_modes must be"):
        es.stability.cheeger_estimate(mesh, spectrum, n_modes=0)
