"""What must hold for the spectrum of any shape."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from certeig.solver import strategy as roads
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.solve import solve_spectrum

seeds = st.integers(0, 2**32 - 1)
masses = st.sampled_from(["lumped", "consistent", "averaged"])
few = settings(deadline=None, max_examples=12)


def shape(seed: int) -> TriangleMesh:
    """A bumpy torus or sphere without symmetry."""
    rng = np.random.default_rng(seed)
    mesh = torus(14, 9) if seed % 2 else icosphere(2)
    return TriangleMesh(mesh.vertices + 0.03 * rng.standard_normal(mesh.vertices.shape), mesh.faces)


@pytest.fixture(scope="module", autouse=True)
def lanczos_for_all():
    """Take the road of large operators, which is the one with something to lose."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(roads, "DENSE_POINTS", 0)
        yield


@few
@given(seeds, masses, st.integers(1, 30))
def test_eigenvectors_are_orthonormal_and_diagonalize(seed, mass, k):
    laplacian = cotangent_laplacian(shape(seed), mass)
    spectrum = solve_spectrum(laplacian, k)
    phi = spectrum.eigenvectors
    np.testing.assert_allclose(phi.T @ (laplacian.mass @ phi), np.eye(k), atol=1e-11)
    np.testing.assert_allclose(
        phi.T @ (laplacian.stiffness @ phi),
        np.diag(spectrum.eigenvalues),
        atol=1e-10 * (spectrum.eigenvalues[-1] + 1),
    )
    assert (np.diff(spectrum.eigenvalues) >= 0).all()
    assert (spectrum.eigenvalues >= 0).all()
    assert spectrum.certificate.complete


@few
@given(seeds, masses, st.floats(-100, 100))
def test_eigenvalues_scale_as_inverse_area(seed, mass, power):
    mesh, scale = shape(seed), 10.0**power
    one = solve_spectrum(cotangent_laplacian(mesh, mass), 12)
    far = solve_spectrum(
        cotangent_laplacian(TriangleMesh(scale * mesh.vertices, mesh.faces), mass), 12
    )
    expected = one.eigenvalues / scale / scale
    np.testing.assert_allclose(far.eigenvalues, expected, rtol=1e-9, atol=1e-12 * expected[-1])
    np.testing.assert_allclose(
        np.abs(far.eigenvectors * scale), np.abs(one.eigenvectors), atol=1e-6
    )
    assert far.certificate.count == one.certificate.count
    np.testing.assert_allclose(
        far.certificate.shift * scale * scale, one.certificate.shift, rtol=1e-9
    )


@few
@given(seeds, masses)
def test_relabeling_permutes_the_rows(seed, mass):
    mesh, rng = shape(seed), np.random.default_rng(seed)
    new_of_old = rng.permutation(mesh.n_vertices)
    vertices = np.empty_like(mesh.vertices)
    vertices[new_of_old] = mesh.vertices
    renamed = TriangleMesh(vertices, new_of_old[mesh.faces])
    one, two = (solve_spectrum(cotangent_laplacian(m, mass), 10) for m in (mesh, renamed))
    np.testing.assert_allclose(
        two.eigenvalues, one.eigenvalues, rtol=1e-10, atol=1e-12 * one.eigenvalues[-1]
    )
    _require_same_space(one, two.eigenvectors[new_of_old])


@few
@given(seeds, masses)
def test_rigid_motion_changes_nothing(seed, mass):
    mesh, rng = shape(seed), np.random.default_rng(seed)
    turned = mesh.vertices @ Rotation.random(rng=rng).as_matrix().T + rng.standard_normal(3)
    one, two = (
        solve_spectrum(cotangent_laplacian(m, mass), 10)
        for m in (mesh, TriangleMesh(turned, mesh.faces))
    )
    np.testing.assert_allclose(
        two.eigenvalues, one.eigenvalues, rtol=1e-9, atol=1e-11 * one.eigenvalues[-1]
    )


@pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")
@few
@given(seeds, masses, st.integers(1, 25))
def test_a_disjoint_union_merges_spectra(seed, mass, k):
    one, two = shape(seed), shape(seed + 1)
    parts = [
        solve_spectrum(cotangent_laplacian(part, mass), k).eigenvalues for part in (one, two, two)
    ]
    merged = np.sort(np.concatenate(parts))[:k]
    union = solve_spectrum(cotangent_laplacian(disjoint_union(one, two, two), mass), k)
    np.testing.assert_allclose(union.eigenvalues, merged, rtol=1e-9, atol=1e-11)


@few
@given(seeds, st.integers(1, 20), masses)
def test_zeros_count_the_components(seed, copies, mass):
    union = disjoint_union(
        *[TriangleMesh((1 + i) * icosphere(1).vertices, icosphere(1).faces) for i in range(copies)]
    )
    values = solve_spectrum(cotangent_laplacian(union, mass), copies + 2).eigenvalues
    assert np.count_nonzero(values < 1e-9 * values[-1]) == copies


def _require_same_space(spectrum, vectors):
    overlaps = spectrum.eigenvectors.T @ (spectrum.mass @ vectors)
    jumps = np.diff(spectrum.eigenvalues) > 1e-3 * spectrum.eigenvalues[-1]
    ends = np.flatnonzero(np.append(jumps, False)) + 1
    for start, stop in zip(
        np.append(0, ends[:-1]), ends, strict=True
    ):  # the last cluster may be cut
        np.testing.assert_allclose(np.linalg.svd(overlaps[start:stop, start:stop])[1], 1, atol=1e-7)
