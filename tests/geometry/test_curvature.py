import numpy as np
import pytest

import eigenshape as es
from eigenshape._corners import face_angles
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.curvature import angle_defects
from eigenshape.geometry.topology import submesh


def torus_curvature(mesh, outer=1.0, inner=0.4):
    rim = np.hypot(*mesh.vertices[:, :2].T)
    return (rim - outer) / inner / (inner * rim)


def test_angles_by_hand():
    mesh = es.TriangleMesh([[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, -2, 0]], [[0, 1, 2], [3, 1, 0]])
    np.testing.assert_allclose(face_angles(mesh)[0], [np.pi / 2, np.pi / 4, np.pi / 4])
    np.testing.assert_allclose(face_angles(mesh).sum(axis=1), np.pi)


def test_a_cube_bends_at_its_corners_alone():
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
    cube = es.TriangleMesh(corners, faces)
    np.testing.assert_allclose(angle_defects(cube), np.pi / 2)
    np.testing.assert_allclose(angle_defects(es.geometry.subdivide(cube))[8:], 0, atol=1e-14)


@pytest.mark.parametrize(
    ("mesh", "euler"),
    [
        (es.icosphere(2), 2),
        (es.shapes.torus(20, 11), 0),
        (es.shapes.grid(5, 3), 1),
        (es.geometry.disjoint_union(es.icosphere(1), es.shapes.grid(2, 2)), 3),
        (submesh(es.shapes.torus(20, 11), np.arange(440) % 5 > 0)[0], None),
        (es.TriangleMesh(np.eye(5, 3), [[0, 1, 2], [0, 1, 3], [0, 1, 4]]), 1),
    ],
)
def test_the_sum_is_a_number_of_the_topology(mesh, euler):
    total = angle_defects(mesh).sum() / (2 * np.pi)
    assert total == pytest.approx(es.geometry.euler_characteristic(mesh), abs=1e-10)
    assert euler in (None, es.geometry.euler_characteristic(mesh))


def test_a_boundary_turns_at_its_corners():
    sheet = es.shapes.grid(4, 4)
    defects = angle_defects(sheet)
    at_corner = (np.abs(sheet.vertices[:, :2] - 0.5) > 0.49).all(axis=1)
    np.testing.assert_allclose(defects[at_corner], np.pi / 2)
    np.testing.assert_allclose(defects[~at_corner], 0, atol=1e-14)


def test_a_torus_is_approached_with_the_square_of_the_edges():
    errors = []
    for n in (16, 32, 64):
        mesh = es.shapes.torus(2 * n, n)
        errors.append(np.abs(es.geometry.gaussian_curvature(mesh) - torus_curvature(mesh)).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > 1.9).all()
    assert errors[-1] < 0.005


def test_a_sphere_has_its_curvature_but_where_five_faces_meet():
    mesh = es.icosphere(4)
    valence = np.bincount(mesh.faces.ravel())
    found = es.geometry.gaussian_curvature(mesh)
    assert np.abs(found[valence == 6] - 1).max() < 0.05
    assert np.abs(found[valence == 5] - 1).max() < 0.15
    assert np.median(np.abs(found - 1)) < 0.001


@pytest.mark.parametrize("exponent", [-100, 100])
def test_it_scales_exactly(exponent):
    mesh = es.shapes.torus(12, 8)
    scaled = es.TriangleMesh(mesh.vertices * 2.0**exponent, mesh.faces)
    assert np.array_equal(
        es.geometry.gaussian_curvature(scaled),
        es.geometry.gaussian_curvature(mesh) * 4.0**-exponent,
    )


def test_bending_without_stretching_leaves_it():
    flat = es.shapes.grid(12, 12)
    x, y, _ = flat.vertices.T
    # Folded along grid lines, no length changes.
    bent = es.TriangleMesh(
        np.column_stack([np.minimum(x, 0.5), y, np.maximum(x - 0.5, 0)]), flat.faces
    )
    inside = ~np.isin(np.arange(flat.n_vertices), es.geometry.boundary_vertices(flat))
    np.testing.assert_allclose(es.geometry.gaussian_curvature(bent)[inside], 0, atol=1e-10)


def test_bad_meshes_are_named():
    with pytest.raises(InvalidShapeError, match="must have area"):
        es.geometry.gaussian_curvature(es.TriangleMesh(np.eye(3), [[0, 1, 2], [0, 0, 1]]))
    with pytest.raises(InvalidShapeError, match="vertex 3 at"):
        es.geometry.gaussian_curvature(es.TriangleMesh(np.eye(4, 3), [[0, 1, 2]]))


def test_principal_curvatures_of_a_cylinder_at_its_boundary_too():
    sheet = es.shapes.grid(24, 12, width=3.0, height=1.0)
    x, y, _ = sheet.vertices.T
    pipe = es.TriangleMesh(np.column_stack([2 * np.sin(x / 2), y, 2 * np.cos(x / 2)]), sheet.faces)
    found = es.geometry.principal_curvatures(pipe)
    np.testing.assert_allclose(found.values[:, 0], 0.5, atol=0.01)
    np.testing.assert_allclose(found.values[:, 1], 0.0, atol=0.01)
    np.testing.assert_allclose(np.abs(found.directions[:, 1, 1]), 1.0, atol=1e-3)
    np.testing.assert_allclose(found.mean, 0.25, atol=0.01)
    np.testing.assert_allclose(found.gaussian, found.values[:, 0] * found.values[:, 1])


def test_principal_directions_are_orthonormal_and_tangent():
    mesh = es.make_creature("biped", n_vertices=600)
    one, two = es.geometry.principal_curvatures(mesh).directions.transpose(1, 0, 2)
    np.testing.assert_allclose(np.linalg.norm(one, axis=1), 1.0)
    np.testing.assert_allclose(np.linalg.norm(two, axis=1), 1.0)
    np.testing.assert_allclose(np.einsum("ni,ni->n", one, two), 0.0, atol=1e-9)


def test_principal_curvatures_scale_exactly_and_change_sign_with_the_side():
    ball = es.icosphere(1)
    found = es.geometry.principal_curvatures(ball).values
    large = es.TriangleMesh(ball.vertices * 2.0**40, ball.faces)
    np.testing.assert_array_equal(es.geometry.principal_curvatures(large).values * 2.0**40, found)
    inside = es.TriangleMesh(ball.vertices, ball.faces[:, ::-1])
    np.testing.assert_allclose(
        es.geometry.principal_curvatures(inside).values, -found[:, ::-1], atol=1e-12
    )


def test_few_neighbors_are_enough_for_principal_curvatures():
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    tetrahedron = es.TriangleMesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    assert np.isfinite(es.geometry.principal_curvatures(tetrahedron).values).all()
    plane = es.geometry.principal_curvatures(es.shapes.grid(1, 1)).values
    np.testing.assert_allclose(plane, 0.0, atol=1e-12)


@pytest.mark.filterwarnings("ignore:Both sides of a seam")
def test_a_vertex_without_normal_is_named():
    # Two triangles that lie on each other, turned over, so that their normals cancel.
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0]]
    folded = es.TriangleMesh(points, [[0, 1, 2], [0, 3, 4]])
    with pytest.raises(es.InvalidShapeError, match="A vertex must have a normal"):
        es.geometry.principal_curvatures(folded)
