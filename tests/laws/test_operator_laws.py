"""What must hold for the operator of any mesh."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.measure import enclosed_volume, face_areas, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import grid, icosphere, torus

seeds = st.integers(0, 2**32 - 1)
masses = st.sampled_from(["lumped", "consistent", "averaged"])
few = settings(deadline=None, max_examples=15)


def shape(seed: int) -> TriangleMesh:
    """A bumpy torus, sphere or sheet without symmetry, or faces thrown together at random."""
    rng = np.random.default_rng(seed)
    if seed % 4 == 3:
        return soup(rng)
    mesh = (torus(9, 6), icosphere(1), grid(5, 4))[seed % 4]
    return TriangleMesh(mesh.vertices + 0.05 * rng.standard_normal(mesh.vertices.shape), mesh.faces)


def soup(rng: np.random.Generator) -> TriangleMesh:
    """Different faces over random points, most edges and vertices no manifold; none a needle, no vertex loose."""
    points = rng.standard_normal((9, 3))
    rows = np.array([rng.choice(9, 3, replace=False) for _ in range(25)])
    rows = rows[np.sort(np.unique(np.sort(rows, axis=1), axis=0, return_index=True)[1])]
    a, b, c = points[rows].transpose(1, 0, 2)
    longest = np.max([np.linalg.norm(side, axis=1) for side in (b - a, c - b, a - c)], axis=0)
    kept = rows[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0.02 * longest**2]
    used, faces = np.unique(kept, return_inverse=True)
    return TriangleMesh(points[used], faces.reshape(-1, 3))


def dense(mesh: TriangleMesh, mass: str) -> tuple[np.ndarray, np.ndarray]:
    laplacian = cotangent_laplacian(mesh, mass)
    return laplacian.stiffness.toarray(), laplacian.mass.toarray()


def require_same(one: TriangleMesh, two: TriangleMesh, mass: str) -> None:
    for first, second in zip(dense(one, mass), dense(two, mass), strict=True):
        np.testing.assert_allclose(second, first, rtol=0, atol=1e-11 * np.abs(first).max())


@few
@given(seeds, masses)
def test_stiffness_is_symmetric_semidefinite_and_blind_to_constants(seed, mass):
    stiffness, weights = dense(shape(seed), mass)
    largest = np.abs(stiffness).max()
    np.testing.assert_array_equal(stiffness, stiffness.T)
    np.testing.assert_array_equal(weights, weights.T)
    np.testing.assert_allclose(stiffness.sum(axis=1), 0, atol=1e-13 * largest)
    assert np.linalg.eigvalsh(stiffness)[0] > -1e-13 * len(stiffness) * largest
    assert np.linalg.eigvalsh(weights)[0] > 0


@few
@given(seeds, masses)
def test_mass_sums_to_the_area(seed, mass):
    mesh = shape(seed)
    np.testing.assert_allclose(
        cotangent_laplacian(mesh, mass).mass.sum(), surface_area(mesh), rtol=1e-13
    )


@few
@given(seeds)
def test_all_masses_have_the_same_row_sums(seed):
    mesh = shape(seed)
    lumped, consistent, averaged = (
        dense(mesh, mass)[1] for mass in ("lumped", "consistent", "averaged")
    )
    np.testing.assert_allclose(consistent.sum(axis=1), np.diag(lumped), rtol=1e-13)
    np.testing.assert_allclose(averaged, (lumped + consistent) / 2, rtol=1e-14, atol=0)


@few
@given(seeds, masses)
def test_rigid_motion_changes_nothing(seed, mass):
    mesh, rng = shape(seed), np.random.default_rng(seed)
    turned = mesh.vertices @ Rotation.random(rng=rng).as_matrix().T + rng.standard_normal(3)
    require_same(mesh, TriangleMesh(turned, mesh.faces), mass)


@few
@given(seeds, masses)
def test_relabeling_permutes(seed, mass):
    mesh, rng = shape(seed), np.random.default_rng(seed)
    old_of_new = rng.permutation(mesh.n_vertices)
    faces = np.argsort(old_of_new)[mesh.faces][rng.permutation(mesh.n_faces)]
    renamed = TriangleMesh(mesh.vertices[old_of_new], np.roll(faces, 1, axis=1))
    for first, second in zip(dense(mesh, mass), dense(renamed, mass), strict=True):
        expected = first[np.ix_(old_of_new, old_of_new)]
        np.testing.assert_allclose(second, expected, rtol=0, atol=1e-11 * np.abs(first).max())


@few
@given(seeds, masses)
def test_orientation_does_not_matter(seed, mass):
    mesh = shape(seed)
    flip = np.random.default_rng(seed).random(mesh.n_faces) < 0.5
    require_same(
        mesh,
        TriangleMesh(mesh.vertices, np.where(flip[:, None], mesh.faces[:, ::-1], mesh.faces)),
        mass,
    )


@few
@given(seeds, masses, st.floats(-100, 100))
def test_scaling_leaves_stiffness_and_squares_into_mass(seed, mass, power):
    mesh, scale = shape(seed), 10.0**power
    one, two = dense(mesh, mass)
    stiffness, weights = dense(TriangleMesh(scale * mesh.vertices, mesh.faces), mass)
    np.testing.assert_allclose(stiffness, one, rtol=0, atol=1e-11 * np.abs(one).max())
    np.testing.assert_allclose(weights / scale / scale, two, rtol=1e-11, atol=0)


@few
@given(seeds, masses, st.integers(-300, 300))
def test_powers_of_two_scale_bit_for_bit(seed, mass, power):
    mesh, scale = shape(seed), 2.0**power
    one, two = dense(mesh, mass)
    far = TriangleMesh(scale * mesh.vertices, mesh.faces)
    stiffness, weights = dense(far, mass)
    np.testing.assert_array_equal(stiffness, one)
    np.testing.assert_array_equal(weights, two * scale * scale)
    np.testing.assert_array_equal(face_areas(far), face_areas(mesh) * scale * scale)
    if not len(inconsistent_edges(mesh)):  # a soup encloses nothing, and is refused
        np.testing.assert_array_equal(
            enclosed_volume(far), enclosed_volume(mesh) * scale * scale * scale
        )


@few
@given(seeds, masses)
def test_a_disjoint_union_is_block_diagonal(seed, mass):
    parts = [shape(seed), shape(seed + 1)]
    n = parts[0].n_vertices
    for whole, one, two in zip(
        dense(disjoint_union(*parts), mass),
        dense(parts[0], mass),
        dense(parts[1], mass),
        strict=True,
    ):
        np.testing.assert_allclose(whole[:n, :n], one, rtol=0, atol=1e-11 * np.abs(one).max())
        np.testing.assert_allclose(whole[n:, n:], two, rtol=0, atol=1e-11 * np.abs(two).max())
        assert not whole[:n, n:].any()
        assert not whole[n:, :n].any()


@few
@given(seeds)
def test_energy_is_never_negative(seed):
    mesh = shape(seed)
    stiffness = cotangent_laplacian(mesh).stiffness
    functions = np.random.default_rng(seed).standard_normal((mesh.n_vertices, 10))
    assert (np.einsum("ij,ij->j", functions, stiffness @ functions) > 0).all()
