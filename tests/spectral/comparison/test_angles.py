from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import subspace_angles
from scipy.stats import ortho_group

from certeig.kit.errors import ConvergenceError, InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.comparison.angles import eigenspace_angles
from eigenshape.spectral.solve import solve_spectrum

SPHERE = icosphere(2)
OPERATOR = cotangent_laplacian(SPHERE)
SPECTRUM = solve_spectrum(OPERATOR, 20)


def moved(mesh, seed, size):
    rng = np.random.default_rng(seed)
    return TriangleMesh(mesh.vertices + size * rng.standard_normal(mesh.vertices.shape), mesh.faces)


def test_by_hand():
    # Of diag(0, 1, 3) the first two eigenvectors are turned into one another: each by θ, neither out of the third.
    turn = 0.3
    cos, sin = np.cos(turn), np.sin(turn)
    vectors = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    operator = Laplacian(sp.csr_array(np.diag([0.0, 1.0, 3.0])), sp.eye_array(3, format="csr"))
    one = solve_spectrum(operator, 3)
    two = replace(one, eigenvectors=vectors)
    found = eigenspace_angles(one, two, laplacian=operator)
    assert (found.starts.tolist(), found.stops.tolist()) == ([0, 1], [1, 2])
    np.testing.assert_allclose(found.angles, turn, rtol=1e-12)
    np.testing.assert_allclose(found.gaps, [1, 1])
    # R of the first has length sin θ cos θ, its quotient is sin² θ, and the next eigenvalue is 1.
    np.testing.assert_allclose(found.bounds[0], np.arcsin(sin * cos / (1 - sin**2)), rtol=1e-9)
    assert "turn by 17.2° in the median and by at most 17.2° (number " in found.explain()


def test_small_and_right_angles_keep_their_digits():
    operator = Laplacian(sp.csr_array(np.diag([0.0, 1.0, 3.0])), sp.eye_array(3, format="csr"))
    one = solve_spectrum(operator, 3)
    for turn in (1e-13, np.pi / 2 - 1e-13, np.pi / 2):
        cos, sin = np.cos(turn), np.sin(turn)
        two = replace(one, eigenvectors=np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]))
        assert eigenspace_angles(one, two).angles[0] == pytest.approx(turn, rel=1e-3, abs=1e-15)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_a_rotation_inside_eigenspaces_is_no_angle(seed):
    vectors = SPECTRUM.eigenvectors.copy()
    for degree in (1, 2, 3):
        group = slice(degree**2, (degree + 1) ** 2)
        vectors[:, group] = vectors[:, group] @ ortho_group(2 * degree + 1, seed=seed).rvs()
    found = eigenspace_angles(SPECTRUM, replace(SPECTRUM, eigenvectors=vectors), laplacian=OPERATOR)
    assert found.stops[2] == 9
    assert found.angles.max() < 1e-10
    assert (found.bounds < 1e-6).all()


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), size=st.sampled_from([1e-9, 1e-4, 1e-2, 0.05]))
def test_no_angle_is_above_its_bound(mass, seed, size):
    mesh = torus(14, 9) if seed % 2 else SPHERE
    operator = cotangent_laplacian(moved(mesh, 1, 0.02), mass)
    one = solve_spectrum(operator, 20)
    two = solve_spectrum(cotangent_laplacian(moved(mesh, seed, size), mass), 20)
    found = eigenspace_angles(one, two, laplacian=operator)
    assert (found.angles <= found.bounds + 1e-12).all()
    rest = [other for other in range(20) if not found.starts[0] <= other < found.stops[0]]
    assert (
        found.gaps[0] == np.abs(one.eigenvalues[rest] - one.eigenvalues[found.stops[0] - 1]).min()
    )


def test_angles_are_those_of_scipy():
    two = solve_spectrum(cotangent_laplacian(moved(SPHERE, 3, 0.05)), 20)
    found = eigenspace_angles(SPECTRUM, two)
    assert found.bounds is None
    root = np.sqrt(SPECTRUM.mass.diagonal())[:, None]
    for start, stop, angle in zip(found.starts, found.stops, found.angles, strict=True):
        spaces = (root * each.eigenvectors[:, start:stop] for each in (SPECTRUM, two))
        assert angle == pytest.approx(subspace_angles(*spaces)[0], rel=1e-7, abs=1e-9)


def test_a_small_change_is_bounded_below_a_right_angle():
    operator = cotangent_laplacian(fibonacci_sphere(400))
    one = solve_spectrum(operator, 30)
    two = solve_spectrum(cotangent_laplacian(moved(fibonacci_sphere(400), 0, 1e-3)), 30)
    found = eigenspace_angles(one, two, laplacian=operator)
    assert found.angles.max() < 0.01
    assert (found.bounds < 0.5).all()


def test_points_may_be_renamed():
    order = np.random.default_rng(0).permutation(SPHERE.n_points)
    renamed = TriangleMesh(SPHERE.vertices[order], np.argsort(order)[SPHERE.faces])
    two = solve_spectrum(cotangent_laplacian(renamed), 20)
    assert eigenspace_angles(SPECTRUM, two, points=np.argsort(order)).angles.max() < 1e-9
    assert eigenspace_angles(SPECTRUM, two).angles.max() > 1


def test_a_coarse_sphere_against_a_fine_one():
    fine = icosphere(3)  # whose first points are those of the coarse one
    assert np.allclose(fine.vertices[: SPHERE.n_points], SPHERE.vertices)
    two = solve_spectrum(cotangent_laplacian(fine), 30)
    found = eigenspace_angles(SPECTRUM, two, points=np.arange(SPHERE.n_points), laplacian=OPERATOR)
    assert found.angles.max() < 0.1
    assert (found.angles <= found.bounds).all()


def test_a_corrected_kernel_is_bounded_by_its_pencil():
    mesh = fibonacci_sphere(500)
    operator = mesh_laplacian(mesh, correct="log")
    one = solve_spectrum(operator, 30)
    two = solve_spectrum(cotangent_laplacian(mesh), 30)
    found = eigenspace_angles(one, two, laplacian=operator)
    assert (found.angles <= found.bounds).all()
    assert found.bounds.max() < 0.5
    assert found.gaps[0] == pytest.approx(2, rel=0.03)  # gaps are those of reported eigenvalues


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_results_scale_with_the_shape(scale):
    mesh = moved(SPHERE, 3, 0.02)
    here = eigenspace_angles(
        SPECTRUM, solve_spectrum(cotangent_laplacian(mesh), 20), laplacian=OPERATOR
    )
    far = cotangent_laplacian(TriangleMesh(scale * SPHERE.vertices, SPHERE.faces))
    other = solve_spectrum(cotangent_laplacian(TriangleMesh(scale * mesh.vertices, mesh.faces)), 20)
    there = eigenspace_angles(solve_spectrum(far, 20), other, laplacian=far)
    np.testing.assert_allclose(there.angles, here.angles, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(there.bounds, here.bounds, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(there.gaps * scale * scale, here.gaps, rtol=1e-8)


def test_cut_groups_are_left_out():
    found = eigenspace_angles(solve_spectrum(OPERATOR, 12), SPECTRUM)
    assert found.stops.tolist() == [1, 4, 9]
    found = eigenspace_angles(SPECTRUM, solve_spectrum(OPERATOR, 6))
    assert found.stops.tolist() == [1, 4]
    none = eigenspace_angles(solve_spectrum(OPERATOR, 1), SPECTRUM)
    assert len(none.angles) == 0
    assert none.explain() == "No group of eigenvalues is known completely."


def test_bad_input():
    interval = solve_spectrum(OPERATOR, above=1.0, below=3.0)
    with pytest.raises(InvalidParameterError, match="two must begin with the lowest eigenvalue"):
        eigenspace_angles(SPECTRUM, interval)
    fine = solve_spectrum(cotangent_laplacian(icosphere(3)), 10)
    with pytest.raises(InvalidParameterError, match="one has 162 points and two has 642"):
        eigenspace_angles(SPECTRUM, fine)
    with pytest.raises(
        InvalidParameterError, match=r"a point of two must lie in 0..641; it is 642"
    ):
        eigenspace_angles(SPECTRUM, fine, points=np.arange(162) + 481)
    with pytest.raises(
        InvalidParameterError,
        match="points must hold one point of two for each of 162 points of one; there are 3",
    ):
        eigenspace_angles(SPECTRUM, fine, points=[0, 1, 2])
    with pytest.raises(
        InvalidParameterError, match="Eigenvectors 1 to 3 of two must be independent at the points"
    ):
        eigenspace_angles(SPECTRUM, fine, points=np.zeros(162, dtype=int))
    with pytest.raises(
        InvalidParameterError, match="laplacian must be the operator that one is of; they have 642"
    ):
        eigenspace_angles(SPECTRUM, SPECTRUM, laplacian=cotangent_laplacian(icosphere(3)))
    with pytest.raises(ConvergenceError, match="Eigenvectors must be B-orthonormal"):
        eigenspace_angles(SPECTRUM, SPECTRUM, laplacian=cotangent_laplacian(moved(SPHERE, 0, 0.1)))
    rough = replace(SPECTRUM, certificate=replace(SPECTRUM.certificate, count=None))
    with pytest.raises(
        InvalidParameterError,
        match="need a certified spectrum; the eigenvalues of one were not counted",
    ):
        eigenspace_angles(rough, SPECTRUM, laplacian=OPERATOR)
