"""What must not change functions on shapes: folding without stretching, moving, naming; and scaling by law."""

import numpy as np
import pytest

import eigenshape as es


def spectral(signature):
    def found(mesh):
        return signature(es.solve_spectrum(es.cotangent_laplacian(mesh), 40))

    return found


FUNCTIONS = {  # and the power of length that each is in
    "heat": (spectral(lambda s: es.heat_kernel_signature(s, es.spectral.default_times(s, 8))), -2),
    "scale-invariant heat": (spectral(es.spectral.scale_invariant_signature), 0),
    "waves": (spectral(es.wave_kernel_signature), -2),
    "average geodesic distance": (
        lambda mesh: es.geometry.average_geodesic_distance(mesh, n_bases=mesh.n_vertices),
        1,
    ),
    "Gaussian curvature": (es.geometry.gaussian_curvature, -2),
    "mean curvature": (es.operators.mean_curvature, -1),
}
INTRINSIC = [name for name in FUNCTIONS if name != "mean curvature"]


def sheet():
    """A grid of unequal sides with one corner cut, so that nothing is symmetric and no eigenvalue double."""
    mesh = es.shapes.grid(14, 11)
    return es.TriangleMesh(mesh.vertices * [1.0, 0.77, 1.0], mesh.faces[3:])


def assert_same(one, two, scale=1.0):
    np.testing.assert_allclose(two, one * scale, rtol=1e-6, atol=1e-8 * scale * np.abs(one).max())


@pytest.mark.parametrize("name", INTRINSIC)
def test_a_fold_leaves_what_is_within_the_surface(name):
    function, _ = FUNCTIONS[name]
    flat = sheet()
    x, y, _ = flat.vertices.T
    bent = es.TriangleMesh(
        np.column_stack([np.minimum(x, 0.5), y, np.maximum(x - 0.5, 0)]), flat.faces
    )
    assert_same(function(flat), function(bent))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_moving_and_naming_leave_all(name):
    function, _ = FUNCTIONS[name]
    rng = np.random.default_rng(0)
    mesh = es.shapes.torus(16, 11)
    mesh = es.TriangleMesh(mesh.vertices * [1.0, 1.3, 0.8], mesh.faces)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    new_of_old = rng.permutation(mesh.n_vertices)
    vertices = np.empty_like(mesh.vertices)
    vertices[new_of_old] = mesh.vertices @ (turn * np.sign(np.linalg.det(turn))) + [3.0, -2.0, 1.0]
    moved = es.TriangleMesh(vertices, new_of_old[rng.permutation(mesh.faces)])
    assert_same(function(mesh), function(moved)[new_of_old])


@pytest.mark.parametrize("scale", [1e-100, 1e100, 7.0])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_unit_is_as_said(name, scale):
    function, power = FUNCTIONS[name]
    mesh = sheet()
    scaled = es.TriangleMesh(mesh.vertices * scale, mesh.faces)
    assert_same(function(mesh), function(scaled), scale**power)
