"""Gradient, divergence and curl: adjoint to each other, exact on linear functions."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape.calculus import (
    curl,
    divergence,
    gradient,
)

SHAPES = {
    "sphere": es.icosphere(2),
    "torus": es.shapes.torus(12, 8),
    "square": es.shapes.grid(5, 4),
    "interval": es.shapes.interval(9),
    "circle": es.shapes.circle(9),
    "solid": es.shapes.ball(3),
    "3-sphere": es.shapes.three_sphere(60),
}


@pytest.fixture(params=SHAPES, name="mesh")
def any_mesh(request):
    return SHAPES[request.param]


def test_divergence_of_gradient_is_the_cotangent_laplacian(mesh):
    W = es.cotangent_laplacian(mesh).stiffness
    product = divergence(mesh) @ gradient(mesh)
    assert abs(product + W).max() < 1e-13 * abs(W).max()
    values = np.random.default_rng(0).standard_normal((mesh.n_points, 3))
    through = divergence(mesh, gradient(mesh, values))
    np.testing.assert_allclose(through, -(W @ values), atol=1e-12 * abs(W).max())


def test_gradient_and_divergence_are_adjoint(mesh):
    rng = np.random.default_rng(1)
    field = rng.standard_normal((len(mesh.simplices), mesh.points.shape[1]))
    values = rng.standard_normal(mesh.n_points)
    volumes = es.geometry.simplex_volumes(mesh)
    inner = (volumes[:, None] * field * gradient(mesh, values)).sum()
    assert divergence(mesh, field) @ values == pytest.approx(-inner, abs=1e-11)


def test_matrices_do_what_functions_do(mesh):
    rng = np.random.default_rng(2)
    values = rng.standard_normal((mesh.n_points, 2))
    field = gradient(mesh, values)
    s, d, _ = field.shape
    np.testing.assert_allclose((gradient(mesh) @ values).reshape(s, d, 2), field, atol=1e-12)
    flat = field.reshape(s * d, 2)
    np.testing.assert_allclose(divergence(mesh) @ flat, divergence(mesh, field), atol=1e-11)


@pytest.mark.parametrize("name", ["square", "solid"])
def test_gradient_is_exact_on_linear_functions(name):
    mesh = SHAPES[name]
    slope = np.array([0.5, -2.0, 0.0])
    found = gradient(mesh, mesh.points @ slope)
    np.testing.assert_allclose(found, np.broadcast_to(slope, found.shape), atol=1e-12)


@pytest.mark.parametrize("name", ["sphere", "torus", "square", "solid"])
def test_curl_of_gradient_vanishes_inside(name):
    mesh = SHAPES[name]
    values = np.random.default_rng(3).standard_normal(mesh.n_points)
    found = curl(mesh, gradient(mesh, values))
    inside = np.setdiff1d(np.arange(mesh.n_points), es.geometry.boundary_vertices(mesh))
    assert len(inside)
    np.testing.assert_allclose(found[inside], 0.0, atol=1e-12)
    product = curl(mesh) @ (gradient(mesh) @ values)
    np.testing.assert_allclose(product, found.ravel(), atol=1e-12)


def test_curl_of_a_turning_solid_is_twice_its_rate():
    axis = np.array([0.3, -1.0, 2.0])
    box = es.shapes.box(4, 4, 4)
    field = np.cross(axis, box.points[box.simplices].mean(axis=1))
    inside = np.setdiff1d(np.arange(box.n_points), es.geometry.boundary_vertices(box))
    found = curl(box, field) / es.geometry.dual_volumes(box)[:, None]
    np.testing.assert_allclose(found[inside], np.broadcast_to(2 * axis, (len(inside), 3)))


def test_curl_in_the_plane_is_that_of_the_same_surface_in_space():
    square = SHAPES["square"]
    plane = es.SimplicialMesh(square.vertices[:, :2], square.faces)
    field = np.random.default_rng(4).standard_normal((square.n_faces, 2))
    raised = np.column_stack([field, np.zeros(len(field))])
    np.testing.assert_allclose(curl(plane, field), curl(square, raised), atol=1e-13)
    turned = es.TriangleMesh(square.vertices, square.faces[:, ::-1])
    np.testing.assert_allclose(curl(turned, raised), -curl(square, raised), atol=1e-13)


def test_derivatives_scale_exactly_with_the_unit():
    ball = SHAPES["sphere"]
    values = np.random.default_rng(5).standard_normal(ball.n_vertices)
    unit = 2.0**300
    large = es.TriangleMesh(ball.vertices * unit, ball.faces)
    np.testing.assert_array_equal(gradient(large, values) * unit, gradient(ball, values))
    field = gradient(ball, values)
    np.testing.assert_array_equal(divergence(large, field), divergence(ball, field) * unit)


def test_curl_needs_a_side_and_a_dimension():
    strip = es.shapes.grid(2, 1)
    faces = strip.faces.copy()
    faces[1] = faces[1, ::-1]
    with pytest.raises(es.InvalidShapeError, match="Neighboring faces must be turned the same way"):
        curl(es.TriangleMesh(strip.vertices, faces), np.zeros((4, 3)))
    with pytest.raises(es.InvalidShapeError, match="The curl needs triangles in R"):
        curl(SHAPES["interval"])


def test_wrong_arguments_are_named():
    ball = SHAPES["sphere"]
    with pytest.raises(es.InvalidParameterError, match="values must hold one number per point"):
        gradient(ball, np.zeros(3))
    with pytest.raises(es.InvalidParameterError, match="Transpose it"):
        gradient(ball, np.zeros((2, ball.n_vertices)))
    with pytest.raises(es.InvalidParameterError, match="entry 3 is nan"):
        gradient(ball, np.where(np.arange(ball.n_vertices) == 3, np.nan, 0.0))
    with pytest.raises(es.InvalidParameterError, match="vectors must hold one vector per simplex"):
        divergence(ball, np.zeros((ball.n_vertices, 3)))
    field = np.zeros((ball.n_faces, 3))
    field[5, 1] = np.inf
    with pytest.raises(es.InvalidParameterError, match=r"entry \(5, 1\) is inf"):
        curl(ball, field)
    with pytest.raises(es.InvalidShapeError, match="must have area"):
        gradient(([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]), np.zeros(3))
