import numpy as np

from eigenshape.geometry.creases import corner_normals, smooth_pairs
from eigenshape.geometry.measure import face_normals, vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import icosphere


def prism(n, height=1.0):
    """Return a closed prism on a regular polygon of n corners."""
    angles = 2 * np.pi * np.arange(n) / n
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    low, high = (np.column_stack([ring, np.full(n, z)]) for z in (0.0, height))
    vertices = np.vstack([low, high, [[0, 0, 0], [0, 0, height]]])
    one = np.arange(n)
    two = (one + 1) % n
    walls = [np.column_stack([one, two, two + n]), np.column_stack([one, two + n, one + n])]
    center = np.full(n, 2 * n)
    caps = [np.column_stack([two, one, center]), np.column_stack([one + n, two + n, center + 1])]
    return TriangleMesh(vertices, np.vstack(walls + caps))


def test_the_corners_of_a_hexagonal_prism_have_the_normals_of_their_faces():
    mesh = prism(6)
    np.testing.assert_allclose(
        corner_normals(mesh), np.repeat(face_normals(mesh)[:, None], 3, axis=1), atol=1e-12
    )


def test_the_wall_of_a_cylinder_is_smooth_and_its_caps_are_flat():
    mesh = prism(24)
    normals = corner_normals(mesh)
    walls, caps = normals[:48], normals[48:]
    np.testing.assert_allclose(caps[..., :2], 0, atol=1e-12)
    np.testing.assert_allclose(walls[..., 2], 0, atol=1e-12)
    # Across the edges of the wall, by 15 degrees each, normals are averaged.
    outward = mesh.vertices[mesh.faces[:48]][..., :2]
    assert np.einsum("fki,fki->fk", walls[..., :2], outward).min() > np.cos(np.radians(4))


def test_without_creases_the_normals_are_those_of_the_vertices():
    mesh = icosphere(1)
    np.testing.assert_allclose(corner_normals(mesh), vertex_normals(mesh)[mesh.faces], atol=1e-12)


def test_a_coarse_creature_stays_smooth():
    mesh = make_creature("biped", n_vertices=1000)
    changed = np.linalg.norm(corner_normals(mesh) - vertex_normals(mesh)[mesh.faces], axis=2) > 0.01
    # With a limit of 40 degrees it would be 13 %.
    assert len(np.unique(mesh.faces[changed])) < 0.01 * mesh.n_vertices


def test_the_angle_does_not_depend_on_the_unit():
    mesh = prism(6)
    for scale in (1e-100, 1e100):
        other = TriangleMesh(mesh.vertices * scale, mesh.faces)
        assert (smooth_pairs(other) == smooth_pairs(mesh)).all()


def test_a_face_without_area_and_a_single_face_have_no_creases():
    line = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]]
    mesh = TriangleMesh(np.array(line, dtype=float), np.array([[0, 1, 2], [0, 2, 3]]))
    assert smooth_pairs(mesh).all()
    assert smooth_pairs(TriangleMesh(mesh.vertices, mesh.faces[1:])).shape == (0,)
