import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.anisotropic import anisotropic_laplacian, curvature_tensors
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.domains import box
from eigenshape.shapes.surfaces import grid, icosphere, torus
from eigenshape.spectral.solve import solve_spectrum


@pytest.mark.parametrize("mesh", [torus(8, 6), box(2, 2, 1)])
def test_with_the_identity_it_is_the_cotangent_laplacian(mesh):
    tensors = np.tile(np.eye(3), (len(mesh.simplices), 1, 1))
    one, two = (
        anisotropic_laplacian(mesh, tensors, "averaged"),
        cotangent_laplacian(mesh, "averaged"),
    )
    np.testing.assert_allclose(one.stiffness.toarray(), two.stiffness.toarray(), atol=1e-13)
    np.testing.assert_allclose(one.mass.toarray(), two.mass.toarray(), rtol=1e-14)


def test_a_square_that_conducts_four_times_better_along_x():
    mesh = grid(24, 24)
    tensors = np.tile(np.diag([4.0, 1.0, 1.0]), (mesh.n_faces, 1, 1))
    found = solve_spectrum(anisotropic_laplacian(mesh, tensors, "averaged"), 5).eigenvalues
    np.testing.assert_allclose(found, np.pi**2 * np.array([0, 1, 4, 4, 5]), rtol=0.01, atol=1e-9)


def tube(n_around=60, n_along=40, radius=0.5):
    angle, height = np.meshgrid(
        2 * np.pi * np.arange(n_around) / n_around, np.linspace(0, 3, n_along), indexing="ij"
    )
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1).reshape(
        -1, 3
    )
    i, j = (index.ravel() for index in np.indices((n_around, n_along - 1)))
    here, across = i * n_along + j, (i + 1) % n_around * n_along + j
    low, high = [here, across, across + 1], [here, across + 1, here + 1]
    return TriangleMesh(points, np.concatenate([np.column_stack(low), np.column_stack(high)]))


def test_on_a_tube_heat_is_slowed_around_and_not_along():
    mesh, alpha = tube(), 2.0
    size = (2 * np.pi * 0.5 * 3) ** 0.5
    tensors = curvature_tensors(mesh, alpha)
    middle = np.abs(mesh.vertices[mesh.faces].mean(axis=1)[:, 2] - 1.5) < 1
    conductivity = np.linalg.eigvalsh(tensors[middle])
    np.testing.assert_allclose(conductivity[:, 0], 0, atol=1e-12)  # along the normal
    np.testing.assert_allclose(conductivity[:, 1], 1 / (1 + alpha * size / 0.5), rtol=0.02)
    np.testing.assert_allclose(conductivity[:, 2], 1, rtol=0.02)
    np.testing.assert_allclose(tensors[middle][:, 2, 2], 1, rtol=0.02)


def test_without_alpha_nothing_is_slowed():
    mesh = icosphere(1)
    one = anisotropic_laplacian(mesh, curvature_tensors(mesh, 0.0))
    np.testing.assert_allclose(
        one.stiffness.toarray(), cotangent_laplacian(mesh).stiffness.toarray(), atol=1e-13
    )


def test_curvature_has_no_unit():
    mesh = icosphere(2)
    far = TriangleMesh(1e50 * mesh.vertices, mesh.faces)
    np.testing.assert_allclose(
        curvature_tensors(far, 1.0), curvature_tensors(mesh, 1.0), atol=1e-12
    )


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ((slice(None, 5),), r"tensors must have shape \(20, 3, 3\); the shape is \(5, 3, 3\)"),
        ((3, 0, 0, np.nan), r"tensors must be finite; that of face 3 is \[\[nan"),
        ((4, 0, 1, 0.5), r"tensors must be symmetric; that of face 4 is \[\[1\.0, 0\.5"),
        (
            (5, 2, 2, -1.0),
            r"tensors must be positive semidefinite; that of face 5 has the eigenvalue -1 \(1 such\)",
        ),
    ],
)
def test_bad_tensors_are_refused(change, match):
    tensors = np.tile(np.eye(3), (20, 1, 1))
    if len(change) == 1:
        tensors = tensors[change[0]]
    else:
        tensors[change[:3]] = change[3]
    with pytest.raises(InvalidParameterError, match=match):
        anisotropic_laplacian(icosphere(0), tensors)


def test_a_negative_alpha_is_refused():
    with pytest.raises(
        InvalidParameterError, match=r"alpha must be finite and not negative; it is -1\.0"
    ):
        curvature_tensors(icosphere(1), -1.0)


def test_concave_bends_alone_slow_diffusion_down_where_only_they_count():
    ball = icosphere(2)
    inside_out = TriangleMesh(ball.vertices, ball.faces[:, ::-1])
    free, slow = (
        curvature_tensors(ball, 5.0, concave=True),
        curvature_tensors(inside_out, 5.0, concave=True),
    )
    np.testing.assert_allclose(free, curvature_tensors(ball, 0.0), atol=1e-12)
    np.testing.assert_allclose(slow, curvature_tensors(ball, 5.0), atol=1e-12)
