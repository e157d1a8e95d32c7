import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import surface_area, vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import boundary_vertices, disjoint_union
from eigenshape.io.mesh_files import read_mesh
from eigenshape.operators.connection import connection_laplacian, flatten_turns, tangent_frames
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.directions import vertex_directions
from eigenshape.shapes.surfaces import grid, icosphere, torus
from eigenshape.spectral.solve import solve_spectrum

few = settings(deadline=None, max_examples=15)
seeds = st.integers(0, 2**32 - 1)
masses = st.sampled_from(["lumped", "consistent", "averaged"])
TETRAHEDRON = TriangleMesh(
    [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
)


def noisy(seed: int, size: float = 0.05) -> TriangleMesh:
    mesh = (torus(9, 6), icosphere(1), grid(5, 4))[seed % 3]
    bumps = size * np.random.default_rng(seed).standard_normal(mesh.vertices.shape)
    return TriangleMesh(mesh.vertices + bumps, mesh.faces)


def spectrum(mesh: TriangleMesh, mass: str = "lumped") -> np.ndarray:
    return solve_spectrum(connection_laplacian(mesh, mass), 2 * mesh.n_vertices).eigenvalues


def shuffled(mesh: TriangleMesh, seed: int) -> TriangleMesh:
    """Other numbers and other first corners: other first edges, and so other frames."""
    rng = np.random.default_rng(seed)
    old_of_new = rng.permutation(mesh.n_vertices)
    faces = np.argsort(old_of_new)[mesh.faces][rng.permutation(mesh.n_faces)]
    return TriangleMesh(mesh.vertices[old_of_new], np.roll(faces, 1, axis=1))


@few
@given(seeds, masses, st.sampled_from([0.05, 0.3]))
def test_matrices_are_symmetric_and_definite_on_any_mesh(seed, mass, size):
    # At the larger size faces are far from Delaunay, and obtuse at the boundary.
    laplacian = connection_laplacian(noisy(seed, size), mass)
    stiffness, weights = laplacian.stiffness.toarray(), laplacian.mass.toarray()
    largest = np.abs(stiffness).max()
    np.testing.assert_allclose(stiffness, stiffness.T, rtol=0, atol=1e-15 * largest)
    np.testing.assert_allclose(weights, weights.T, rtol=0, atol=1e-15 * np.abs(weights).max())
    assert np.linalg.eigvalsh(stiffness)[0] > -1e-13 * len(stiffness) * largest
    assert np.linalg.eigvalsh(weights)[0] > 0


@pytest.mark.parametrize(("mass", "order"), [("lumped", 2), ("consistent", 2), ("averaged", 2)])
def test_the_sphere_has_vector_harmonics(mass, order):
    # Gradients and turned gradients of the harmonics of degree l: l(l+1) - 1, each 2(2l+1) times.
    assert sphere_order([icosphere(level) for level in (2, 3, 4)], mass) == pytest.approx(
        order, abs=0.15
    )


def test_a_sphere_that_is_not_delaunay_has_them_too():
    meshes = [jittered_sphere(level) for level in (2, 3, 4)]
    assert (cotangent_laplacian(meshes[-1]).stiffness.tocoo().data > 1e-3).sum() > 10
    assert sphere_order(meshes, "lumped") > 1.85


def sphere_order(meshes, mass):
    exact = np.repeat([1.0, 5.0, 11.0], [6, 10, 14])
    found = [solve_spectrum(connection_laplacian(mesh, mass), 30).eigenvalues for mesh in meshes]
    errors = [np.abs(values / exact - 1).max() for values in found]
    assert errors[-1] < 0.006
    return np.log2(errors[-2] / errors[-1])


def jittered_sphere(level: int) -> TriangleMesh:
    mesh = icosphere(level)
    moved = mesh.vertices + 0.15 * 2.0**-level * np.random.default_rng(0).standard_normal(
        mesh.vertices.shape
    )
    return TriangleMesh(moved / np.linalg.norm(moved, axis=1, keepdims=True), mesh.faces)


def test_a_weight_below_zero_is_outweighed_where_the_published_form_fails():
    # Folds leave angles far from 360° at single vertices: there w_ij r_ij alone gives fields an energy below zero.
    mesh = noisy(15, 0.3)
    published, ours = by_the_book(mesh), connection_laplacian(mesh).stiffness.toarray()
    lowest, *_, highest = np.linalg.eigvalsh(published)
    assert lowest < -0.03 * highest
    assert np.linalg.eigvalsh(ours)[0] > 1e-3 * highest
    np.testing.assert_allclose(np.diag(ours), np.diag(published), rtol=1e-10)


def test_around_a_flattened_face_a_vector_comes_back():
    angles = np.random.default_rng(0).uniform(-1, 1, 12)
    turns = flatten_turns(np.exp(1j * angles))
    np.testing.assert_allclose(turns.reshape(-1, 3).prod(axis=1), 1, rtol=1e-14)
    share = angles.reshape(-1, 3).sum(axis=1) / 3
    np.testing.assert_allclose(np.angle(turns) + np.repeat(share, 3), angles, atol=1e-14)


@pytest.mark.parametrize("mesh", [icosphere(2), TETRAHEDRON, torus(30, 10)])
def test_on_a_delaunay_mesh_it_is_the_published_form(mesh):
    np.testing.assert_allclose(
        connection_laplacian(mesh).stiffness.toarray(), by_the_book(mesh), atol=1e-12
    )


def by_the_book(mesh: TriangleMesh) -> np.ndarray:
    """Cotangent weights times rotations, edge by edge."""
    scalar = cotangent_laplacian(mesh).stiffness.toarray()
    found = vertex_directions(mesh)
    matrix = np.kron(np.diag(np.diag(scalar)), np.eye(2))
    tails, heads = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    for i, j, at_i, at_j in zip(tails, heads, found.at_tail, found.at_head, strict=True):
        turn = Rotation.from_euler("z", at_j + np.pi - at_i).as_matrix()[:2, :2]
        matrix[2 * j : 2 * j + 2, 2 * i : 2 * i + 2] = scalar[i, j] * turn
        matrix[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] = scalar[i, j] * turn.T
    return matrix


@pytest.mark.parametrize("mass", ["lumped", "consistent", "averaged"])
def test_on_flat_ground_there_are_two_scalar_laplacians(mass):
    mesh = grid(7, 5, width=2.0)
    scalar = solve_spectrum(cotangent_laplacian(mesh, mass), mesh.n_vertices).eigenvalues
    found = spectrum(mesh, mass)
    np.testing.assert_allclose(found, np.repeat(scalar, 2), atol=1e-10 * found[-1])


def test_on_flat_ground_a_constant_field_has_no_energy():
    mesh = noisy(2, 0.0)
    field = np.einsum("nij,j->ni", tangent_frames(mesh), [0.6, 0.8, 0.0]).ravel()
    np.testing.assert_allclose(connection_laplacian(mesh).stiffness @ field, 0, atol=1e-13)


def test_a_rolled_sheet_is_flat():
    mesh = grid(12, 5)
    x, y, _ = mesh.vertices.T
    cylinder = TriangleMesh(np.column_stack([np.cos(x), np.sin(x), y]), mesh.faces)
    found = spectrum(cylinder)
    scalar = solve_spectrum(cotangent_laplacian(cylinder), mesh.n_vertices).eigenvalues
    np.testing.assert_allclose(found, np.repeat(scalar, 2), atol=1e-9 * found[-1])


def test_the_axis_of_a_sphere_turns_into_a_field_of_energy_one():
    # Rotation about z is an eigenfield of l = 1: in coordinates it is z × x, with Rayleigh quotient 1.
    mesh = icosphere(4)
    field = np.einsum(
        "nij,nj->ni", tangent_frames(mesh), np.cross([0, 0, 1.0], mesh.vertices)
    ).ravel()
    laplacian = connection_laplacian(mesh)
    quotient = field @ (laplacian.stiffness @ field) / (field @ (laplacian.mass @ field))
    assert quotient == pytest.approx(1, abs=5e-3)


def test_the_regular_tetrahedron_by_hand():
    # Around a vertex 180°, scaled to 360°: neighbors at 0°, 120°, 240°. All weights are 1/√3, and the diagonal is √3.
    stiffness = connection_laplacian(TETRAHEDRON).stiffness.toarray()
    blocks = stiffness.reshape(4, 2, 4, 2).transpose(0, 2, 1, 3)
    for i in range(4):
        np.testing.assert_allclose(blocks[i, i], 3**0.5 * np.eye(2), atol=1e-15)
        for j in range(i):
            turn = -(3**0.5) * blocks[i, j]
            np.testing.assert_allclose(turn @ turn.T, np.eye(2), atol=1e-14)
            angle = np.degrees(np.arctan2(turn[1, 0], turn[0, 0]))
            assert abs(angle / 60 - round(angle / 60)) < 1e-12


def test_directions_around_a_vertex_by_hand():
    # Six triangles around the middle of an L: 270° at the inner corner, a boundary vertex, unscaled.
    points = [
        [0, 0, 0],
        [1, 0, 0],
        [1, 1, 0],
        [0, 1, 0],
        [-1, 1, 0],
        [-1, 0, 0],
        [-1, -1, 0],
        [0, -1, 0],
    ]
    faces = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [0, 5, 6], [0, 6, 7]]
    found = vertex_directions(TriangleMesh(points, faces))
    np.testing.assert_allclose(np.degrees(found.at_tail[::3]), np.arange(0, 270, 45))
    np.testing.assert_allclose(np.degrees(found.at_head[2::3]), np.arange(45, 271, 45))
    assert found.first[0] == 0
    assert found.first[7] == 3 * 5 + 2  # the side back to the middle, with nothing on its right


def test_around_an_inner_vertex_angles_are_scaled_to_a_full_turn():
    found = vertex_directions(TETRAHEDRON)
    at_zero = TETRAHEDRON.faces.ravel() == 0
    np.testing.assert_allclose(np.degrees(found.at_tail[at_zero]), [0, 120, 240], atol=1e-12)


@few
@given(seeds, masses)
def test_rigid_motion_and_the_choice_of_frames_change_no_eigenvalue(seed, mass):
    mesh, rng = noisy(seed), np.random.default_rng(seed)
    expected = spectrum(mesh, mass)
    moved = mesh.vertices @ Rotation.random(rng=rng).as_matrix().T + rng.standard_normal(3)
    for other in (TriangleMesh(moved, mesh.faces), shuffled(mesh, seed)):
        np.testing.assert_allclose(
            spectrum(other, mass), expected, rtol=0, atol=1e-10 * expected[-1]
        )


@few
@given(seeds, masses)
def test_turning_the_surface_inside_out_mirrors_the_fields(seed, mass):
    mesh = noisy(seed)
    expected = spectrum(mesh, mass)
    found = spectrum(TriangleMesh(mesh.vertices, mesh.faces[:, ::-1]), mass)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * expected[-1])


@few
@given(seeds, masses, st.integers(-300, 300))
def test_powers_of_two_scale_bit_for_bit(seed, mass, power):
    mesh, scale = noisy(seed), 2.0**power
    near = connection_laplacian(mesh, mass)
    far = connection_laplacian(TriangleMesh(mesh.vertices * scale, mesh.faces), mass)
    np.testing.assert_array_equal(far.stiffness.toarray(), near.stiffness.toarray())
    np.testing.assert_array_equal(far.mass.toarray(), near.mass.toarray() * scale * scale)


@few
@given(seeds)
def test_vectors_weigh_what_their_points_weigh(seed):
    mesh = noisy(seed)
    scalar = cotangent_laplacian(mesh).mass.diagonal()
    np.testing.assert_allclose(
        connection_laplacian(mesh).mass.toarray(), np.diag(np.repeat(scalar, 2)), rtol=1e-15
    )
    assert connection_laplacian(mesh).mass.sum() == pytest.approx(2 * surface_area(mesh), rel=1e-13)


@few
@given(seeds)
def test_frames_are_orthonormal_and_face_outward(seed):
    mesh = noisy(seed)
    frames = tangent_frames(mesh)
    products = frames @ frames.transpose(0, 2, 1)
    np.testing.assert_allclose(products, np.broadcast_to(np.eye(2), products.shape), atol=1e-14)
    np.testing.assert_allclose(
        np.cross(frames[:, 0], frames[:, 1]), vertex_normals(mesh), atol=1e-14
    )


def test_frames_do_not_depend_on_the_unit():
    mesh = noisy(1)
    for power in (-900, -300, 300, 900):
        np.testing.assert_array_equal(
            tangent_frames(TriangleMesh(mesh.vertices * 2.0**power, mesh.faces)),
            tangent_frames(mesh),
        )


def test_frames_at_the_boundary_start_along_it():
    mesh = grid(3, 3)
    first = tangent_frames(mesh)[boundary_vertices(mesh), 0]
    np.testing.assert_allclose(np.sort(np.abs(first), axis=1), [[0, 0, 1]] * 12, atol=1e-15)


def test_an_edge_with_three_faces_is_refused():
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]
    mesh = TriangleMesh(points, [[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    for build in (connection_laplacian, tangent_frames):
        with pytest.raises(
            InvalidShapeError,
            match=r"At most two faces may share an edge; more share edge \(0, 1\) \(1 such\)",
        ):
            build(mesh)


def test_two_fans_at_a_vertex_are_refused():
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    with pytest.raises(
        InvalidShapeError, match=r"the faces at vertex 0 at \[0\.0, .* form more than one fan"
    ):
        connection_laplacian(TriangleMesh(points, [[0, 1, 2], [0, 3, 4]]))


def test_faces_turned_against_each_other_are_refused():
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    with pytest.raises(
        InvalidShapeError, match=r"turned the same way; the two at edge \(1, 2\) are turned against"
    ):
        connection_laplacian(TriangleMesh(points, [[0, 1, 2], [1, 2, 3]]))


def test_the_rest_of_what_is_refused():
    with pytest.raises(InvalidShapeError, match=r"Faces must have area; all 1 have none"):
        tangent_frames(TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]))
    with pytest.raises(InvalidShapeError, match=r"Every vertex must belong to a face; vertex 3"):
        tangent_frames(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], [[0, 1, 2]]))


def test_a_vertex_without_tangent_plane_has_no_frame_and_yet_a_laplacian():
    # Three triangles around a point and their backs around another: the normals cancel at the corners of both.
    front = np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3]])
    back = np.where(front == 3, 4, front)[:, ::-1]
    pillow = TriangleMesh(
        [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 0], [1, 1, 0]], np.concatenate([front, back])
    )
    with pytest.raises(
        InvalidShapeError, match=r"must have a tangent plane; at vertex 0 at \[0\.0, .* cancel"
    ):
        tangent_frames(pillow)
    assert np.linalg.eigvalsh(connection_laplacian(pillow).stiffness.toarray())[0] > -1e-15


def test_parts_do_not_feel_each_other():
    parts = [noisy(0), noisy(1)]
    found = spectrum(disjoint_union(*parts))
    expected = np.sort(np.concatenate([spectrum(part) for part in parts]))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * expected[-1])


@pytest.mark.data
@pytest.mark.parametrize("name", ["eight.off", "bunny.off"])
def test_real_surfaces_have_fields_of_little_energy(data, name):
    laplacian = connection_laplacian(read_mesh(data / "classics" / name))
    values = solve_spectrum(laplacian, 6).eigenvalues
    np.testing.assert_allclose(values[::2], values[1::2], rtol=1e-9)  # a field and its quarter turn
    assert values[0] > 0
