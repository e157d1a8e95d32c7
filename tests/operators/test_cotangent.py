import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.anisotropic import anisotropic_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import grid, torus

RIGHT = TriangleMesh([[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]])


def test_one_right_triangle_by_hand():
    # Area 2; the angles are 90°, 45°, 45°, so the edge opposite to the right angle has weight 0, the others 1/2.
    laplacian = cotangent_laplacian(RIGHT)
    np.testing.assert_allclose(
        laplacian.stiffness.toarray(), [[1, -0.5, -0.5], [-0.5, 0.5, 0], [-0.5, 0, 0.5]], atol=1e-15
    )
    np.testing.assert_allclose(laplacian.mass.toarray(), np.eye(3) * 2 / 3, atol=1e-15)


def test_masses_of_one_triangle_by_hand():
    full = (
        np.array([[2, 1, 1], [1, 2, 1], [1, 1, 2]]) / 6
    )  # area 2: 2/6 on the diagonal, 2/12 off it
    np.testing.assert_allclose(
        cotangent_laplacian(RIGHT, "consistent").mass.toarray(), full, atol=1e-15
    )
    mean = (full + np.eye(3) * 2 / 3) / 2
    np.testing.assert_allclose(
        cotangent_laplacian(RIGHT, "averaged").mass.toarray(), mean, atol=1e-15
    )


def test_a_regular_grid_has_the_five_point_stencil():
    row = cotangent_laplacian(grid(4, 4)).stiffness.toarray()[12].reshape(5, 5)
    expected = np.zeros((5, 5))
    expected[2, 1:4], expected[1:4, 2] = -1, -1
    expected[2, 2] = 4
    np.testing.assert_allclose(row, expected, atol=1e-14)


def test_linear_functions_are_harmonic_inside():
    mesh = grid(5, 4, width=2.0)
    residual = cotangent_laplacian(mesh).stiffness @ mesh.vertices
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    inside = (x > 0) & (x < 2) & (y > 0) & (y < 1)
    np.testing.assert_allclose(residual[inside], 0, atol=1e-14)
    assert np.abs(residual[~inside]).max() > 0.1


def test_the_energy_of_a_linear_function_is_its_slope_times_area():
    mesh = grid(3, 7, width=2.0, height=5.0)
    f = mesh.vertices @ [3.0, 4.0, 0.0]
    assert f @ (cotangent_laplacian(mesh).stiffness @ f) == pytest.approx(25 * 10, rel=1e-13)


def test_an_edge_with_three_faces_sums_over_all():
    # Three equal right triangles on the edge 0-1, whose opposite angles are 45°.
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]
    stiffness = cotangent_laplacian(
        TriangleMesh(points, [[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    ).stiffness
    assert stiffness[0, 1] == pytest.approx(-1.5, rel=1e-14)


@pytest.mark.parametrize("mass", ["lumped", "consistent", "averaged"])
@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_any_unit_will_do(mass, scale):
    mesh = torus(7, 5)
    near, far = (
        cotangent_laplacian(TriangleMesh(mesh.vertices * s, mesh.faces), mass) for s in (1.0, scale)
    )
    np.testing.assert_allclose(far.stiffness.toarray(), near.stiffness.toarray(), atol=1e-13)
    np.testing.assert_allclose(far.mass.toarray() / scale / scale, near.mass.toarray(), rtol=1e-13)


def test_a_face_without_area_is_refused():
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], [[0, 1, 2], [0, 1, 3]])
    with pytest.raises(InvalidShapeError, match=r"Faces must have area; face 1 is \[0, 1, 3\]"):
        cotangent_laplacian(mesh)


def test_a_vertex_without_face_is_refused():
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [7, 8, 9], [0, 1, 0], [5, 5, 5]], [[0, 1, 3]])
    with pytest.raises(
        InvalidShapeError,
        match=r"must belong to a face; vertex 2 at \[7\.0, 8\.0, 9\.0\] has none \(2 such\)\. Try repair\(mesh,",
    ):
        cotangent_laplacian(mesh)


def test_an_unknown_mass_is_refused():
    with pytest.raises(
        InvalidParameterError,
        match=r"mass must be 'lumped', 'consistent' or 'averaged'; it is 'full'",
    ):
        cotangent_laplacian.__wrapped__(
            RIGHT, "full"
        )  # past the check of types, which only tests have


@pytest.mark.parametrize("scale", [1e300, 1e160, 1e-160, 1e-300])
def test_areas_that_floats_cannot_hold_are_refused(scale):
    with pytest.raises(
        InvalidShapeError, match=r"To measure areas .* within 1e-150\.\.1e150; .* normalize_mesh"
    ):
        cotangent_laplacian(TriangleMesh(RIGHT.vertices * scale, RIGHT.faces))


def test_a_far_vertex_without_face_is_named_as_such():
    with pytest.raises(InvalidShapeError, match=r"vertex 3 at \[1e\+300, 0\.0, 0\.0\] has none"):
        cotangent_laplacian(TriangleMesh([*RIGHT.vertices, [1e300, 0, 0]], RIGHT.faces))


def test_conductivity_is_linear_on_each_triangle():
    mesh = torus(12, 8)
    plain = cotangent_laplacian(mesh, "consistent")
    tripled = cotangent_laplacian(mesh, "consistent", conductivity=np.full(mesh.n_vertices, 3.0))
    assert abs(tripled.stiffness - 3 * plain.stiffness).max() < 1e-12
    assert abs(tripled.mass - plain.mass).max() == 0
    # Over a triangle with the values 1, 2 and 6, a gradient of length 1 has 3 times its area.
    found = cotangent_laplacian(RIGHT, conductivity=[1.0, 2.0, 6.0])
    np.testing.assert_allclose(
        found.stiffness.toarray(), 3 * cotangent_laplacian(RIGHT).stiffness.toarray(), atol=1e-15
    )
    # The same as a multiple of the identity for each triangle.
    values = np.random.default_rng(0).uniform(0.5, 2, mesh.n_vertices)
    tensors = values[mesh.faces].mean(axis=1)[:, None, None] * np.eye(3)
    other = anisotropic_laplacian(mesh, tensors)
    found = cotangent_laplacian(mesh, conductivity=values)
    assert abs(found.stiffness - other.stiffness).max() < 1e-12


def test_bad_conductivity_is_named():
    with pytest.raises(InvalidParameterError, match="conductivity must hold one number per point"):
        cotangent_laplacian(RIGHT, conductivity=[1.0])
    with pytest.raises(InvalidParameterError, match=r"positive and finite; entry 2 is 0\.0"):
        cotangent_laplacian(RIGHT, conductivity=[1.0, 1.0, 0.0])
