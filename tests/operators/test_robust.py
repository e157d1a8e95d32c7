import numpy as np
import pytest
from broken_meshes import moebius
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from certeig.kit.errors import CerteigError, ConvergenceError, InvalidParameterError
from eigenshape._corners import edge_keys, side_ends
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_steps import drop_duplicate_faces
from eigenshape.geometry.topology import disjoint_union
from eigenshape.io.mesh_files import read_mesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.robust import robust_laplacian
from eigenshape.operators.tufted import (
    Triangulation,
    flip_to_delaunay,
    mollify_lengths,
    tufted_cover,
)
from eigenshape.shapes.surfaces import grid, icosphere, torus
from eigenshape.spectral.solve import solve_spectrum

few = settings(deadline=None, max_examples=15)
seeds = st.integers(0, 2**32 - 1)

# Three faces at one edge; two tetrahedra that share a vertex; faces turned against each other.
FAN = TriangleMesh(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
)
CORNERS = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
HOURGLASS = TriangleMesh(
    [
        [0, 0, 0],
        *(np.array([[1, 0, 1], [0, 1, 1], [-1, -1, 1]])),
        *(np.array([[1, 0, -1], [0, 1, -1], [-1, -1, -1]])),
    ],
    [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2], [0, 5, 4], [0, 6, 5], [0, 4, 6], [4, 5, 6]],
)
TURNED = TriangleMesh(
    grid(3, 3).vertices, [face[::-1] if i % 2 else face for i, face in enumerate(grid(3, 3).faces)]
)


def soup(seed: int) -> TriangleMesh:
    """Different faces over random points, some on each other, some without area."""
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 3, size=(9, 3)) + (
        0.3 * rng.standard_normal((9, 3)) if seed % 2 else 0.0
    )
    faces = np.array([rng.choice(9, 3, replace=False) for _ in range(25)])
    used, renumbered = np.unique(faces, return_inverse=True)
    return drop_duplicate_faces(TriangleMesh(points[used], renumbered.reshape(-1, 3))).mesh


def noisy(seed: int) -> TriangleMesh:
    mesh = (torus(9, 6), icosphere(1), grid(5, 4), moebius(12, 2))[seed % 4]
    bumps = 0.05 * np.random.default_rng(seed).standard_normal(mesh.vertices.shape)
    return TriangleMesh(mesh.vertices + bumps, mesh.faces)


def require_laws(mesh: TriangleMesh) -> None:
    laplacian = robust_laplacian(mesh)
    stiffness, mass = laplacian.stiffness.toarray(), laplacian.mass.toarray()
    largest = np.abs(stiffness).max()
    np.testing.assert_array_equal(stiffness, stiffness.T)
    np.testing.assert_allclose(stiffness.sum(axis=1), 0, atol=1e-13 * largest)
    assert (stiffness - np.diag(np.diag(stiffness)) <= 0).all()
    assert np.linalg.eigvalsh(stiffness)[0] >= -1e-13 * len(stiffness) * largest
    assert (np.diag(mass) > 0).all()
    np.testing.assert_array_equal(mass, np.diag(np.diag(mass)))


def dense(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    laplacian = robust_laplacian(mesh)
    return laplacian.stiffness.toarray(), laplacian.mass.toarray()


def require_same(one, two, rtol: float = 1e-11) -> None:
    for first, second in zip(one, two, strict=True):
        np.testing.assert_allclose(second, first, rtol=0, atol=rtol * np.abs(first).max())


@pytest.mark.parametrize("mesh", [FAN, HOURGLASS, TURNED, moebius(), grid(4, 3), torus(7, 5)])
def test_laws_where_faces_meet_in_any_way(mesh):
    require_laws(mesh)
    np.testing.assert_allclose(robust_laplacian(mesh).mass.sum(), surface_area(mesh), rtol=1e-12)


@pytest.mark.filterwarnings("ignore:Both sides of a seam")
@few
@given(seeds)
def test_laws_in_a_soup(seed):
    require_laws(soup(seed))


@few
@given(seeds)
def test_laws_on_noisy_surfaces(seed):
    require_laws(noisy(seed))


@pytest.mark.parametrize(
    "mesh", [icosphere(2), grid(6, 5), grid(4, 9, width=3.0), TURNED, disjoint_union(grid(2, 2))]
)
def test_on_a_delaunay_mesh_it_is_the_cotangent_laplacian(mesh):
    expected = cotangent_laplacian(mesh)
    require_same((expected.stiffness.toarray(), expected.mass.toarray()), dense(mesh), 1e-14)


def test_three_faces_at_an_edge_sum_over_all():
    # Right and isosceles all three: each gives its legs 1/2 and its long side 0.
    stiffness, mass = dense(FAN)
    np.testing.assert_allclose(stiffness[0], [3, -1.5, -0.5, -0.5, -0.5], atol=1e-14)
    np.testing.assert_allclose(np.diag(mass), [1 / 2, 1 / 2, 1 / 6, 1 / 6, 1 / 6], rtol=1e-14)


def test_a_flip_by_hand():
    # A kite with the long diagonal: flat, so that the flip gives the mesh with the short one.
    points = [[-2, 0, 0], [0, -1, 0], [2, 0, 0], [0, 1, 0]]
    long, short = (
        TriangleMesh(points, [[0, 1, 2], [0, 2, 3]]),
        TriangleMesh(points, [[0, 1, 3], [1, 2, 3]]),
    )
    expected = cotangent_laplacian(short)
    require_same((expected.stiffness.toarray(), expected.mass.toarray()), dense(long), 1e-14)
    assert cotangent_laplacian(long).stiffness[0, 2] > 0.5  # what the flip takes away


def test_an_obtuse_angle_at_the_boundary_has_no_negative_weight():
    # On its two sides the triangle is a pillow; the flip of its long side leaves an edge from the top to itself.
    mesh = TriangleMesh([[-3, 0, 0], [3, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    stiffness, mass = dense(mesh)
    assert stiffness[0, 1] == 0
    np.testing.assert_allclose(np.diag(mass).sum(), 3, rtol=1e-14)
    assert cotangent_laplacian(mesh).stiffness[0, 1] > 0


def test_functions_obey_the_maximum_principle():
    mesh = noisy(5)
    stiffness, _ = dense(mesh)
    fixed = np.zeros(mesh.n_vertices, dtype=bool)
    fixed[:3] = True
    values = np.array([0.0, 1.0, 0.5])
    inner = np.linalg.solve(
        stiffness[np.ix_(~fixed, ~fixed)], -stiffness[np.ix_(~fixed, fixed)] @ values
    )
    assert inner.min() >= 0
    assert inner.max() <= 1


@few
@given(seeds)
def test_orientation_rigid_motion_and_names_do_not_matter(seed):
    mesh, rng = noisy(seed), np.random.default_rng(seed)
    flip = rng.random(mesh.n_faces) < 0.5
    turned = TriangleMesh(mesh.vertices, np.where(flip[:, None], mesh.faces[:, ::-1], mesh.faces))
    require_same(dense(mesh), dense(turned))
    moved = mesh.vertices @ Rotation.random(rng=rng).as_matrix().T + rng.standard_normal(3)
    require_same(dense(mesh), dense(TriangleMesh(moved, mesh.faces)), 1e-9)
    old_of_new = rng.permutation(mesh.n_vertices)
    renamed = TriangleMesh(
        mesh.vertices[old_of_new], np.argsort(old_of_new)[mesh.faces][rng.permutation(mesh.n_faces)]
    )
    require_same(
        [part[np.ix_(old_of_new, old_of_new)] for part in dense(mesh)], dense(renamed), 1e-9
    )


@few
@given(seeds, st.integers(-300, 300))
def test_powers_of_two_scale_bit_for_bit(seed, power):
    mesh, scale = noisy(seed), 2.0**power
    stiffness, mass = dense(mesh)
    far = dense(TriangleMesh(mesh.vertices * scale, mesh.faces))
    np.testing.assert_array_equal(far[0], stiffness)
    np.testing.assert_array_equal(far[1], mass * scale * scale)


@pytest.mark.parametrize("order", [[4, 0, 1, 2, 3], [0, 1, 2, 3, 4], [2, 4, 0, 3, 1]])
def test_a_face_without_area_does_not_hide_the_order_of_the_others(order):
    # Low roofs over the edge 0-1 at 0°, 80°, 200° and 290°, listed out of turn; flips carry edges over to their
    # neighbors. The flat face has no angle; it lies before or behind the highest roof, where angles start.
    angles, heights = np.radians([200, 0, 290, 80]), np.array([0.2, 0.4, 0.25, 0.3])
    roofs = np.column_stack([np.full(4, 0.5), heights * np.cos(angles), heights * np.sin(angles)])
    points = np.concatenate([[[0, 0, 0], [1, 0, 0]], roofs, [[0.5, 0, 0]]])
    faces = np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4], [0, 1, 5], [0, 1, 6]])
    stiffness, _ = dense(TriangleMesh(points, faces[order]))
    joined = {frozenset(pair) for pair in np.argwhere(stiffness < 0).tolist()}
    assert {frozenset(pair) for pair in ([5, 2], [2, 4])} <= joined
    assert not {frozenset(pair) for pair in ([3, 2], [5, 4])} & joined


def test_faces_on_each_other_lie_in_one_order_from_every_side():
    # Three sheets, each glued to the next along all three of its sides: six sheets of three pillows, none between.
    points, faces = np.array(CORNERS[:3], dtype=float), np.array([[0, 1, 2], [2, 0, 1], [1, 0, 2]])
    cover = tufted_cover(points, faces, np.ones(9))
    pairs = {
        frozenset(pair) for pair in (np.column_stack([np.arange(18), cover.twins]) // 3).tolist()
    }
    assert len(pairs) == 3
    assert all(len(pair) == 2 for pair in pairs)


@few
@given(seeds)
def test_the_cover_is_a_closed_oriented_surface(seed):
    mesh = soup(seed)
    cover = tufted_cover(mesh.vertices, mesh.faces, np.arange(3.0 * mesh.n_faces))
    sides = np.arange(len(cover.tails))
    following = sides - sides % 3 + (sides + 1) % 3
    np.testing.assert_array_equal(cover.twins[cover.twins], sides)
    assert (cover.twins != sides).all()
    np.testing.assert_array_equal(cover.tails[cover.twins], cover.tails[following])


@few
@given(seeds)
def test_flips_keep_the_surface_and_end_delaunay(seed):
    mesh = noisy(seed)
    lengths = np.linalg.norm(
        mesh.vertices[mesh.faces] - mesh.vertices[np.roll(mesh.faces, -1, axis=1)], axis=2
    ).ravel()
    before = tufted_cover(mesh.vertices, mesh.faces, lengths)
    after = flip_to_delaunay(before)
    sides = np.arange(len(after.tails))
    np.testing.assert_array_equal(after.twins[after.twins], sides)
    np.testing.assert_array_equal(after.lengths[after.twins], after.lengths)
    np.testing.assert_array_equal(
        after.tails[after.twins], after.tails[sides - sides % 3 + (sides + 1) % 3]
    )
    np.testing.assert_allclose(
        around(after, mesh.n_vertices), around(before, mesh.n_vertices), rtol=1e-11
    )
    opposite = angles(after)[sides - sides % 3 + (sides + 2) % 3]
    assert (opposite + opposite[after.twins] < np.pi + 1e-9).all()


@few
@given(seeds)
def test_a_rectangle_keeps_its_diagonal_however_thin_it_is(seed):
    """Both diagonals are Delaunay, and rounding must not choose between them."""
    rng = np.random.default_rng(seed)
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]] * 10 ** rng.uniform(-5, 0, 3)
    points, faces = Rotation.random(rng=rng).apply(corners), np.array([[0, 1, 2], [0, 2, 3]])
    lengths = np.linalg.norm(points[faces] - points[np.roll(faces, -1, axis=1)], axis=2)
    before = tufted_cover(points, faces, lengths.ravel())
    np.testing.assert_array_equal(flip_to_delaunay(before).tails, before.tails)


def angles(cover: Triangulation) -> np.ndarray:
    """The angle at the tail of each side, by the law of cosines."""
    a, c, b = np.moveaxis(cover.lengths.reshape(-1, 3)[:, [[0, 1, 2], [1, 2, 0], [2, 0, 1]]], 1, 0)
    return np.arccos(np.clip((a**2 + b**2 - c**2) / (2 * a * b), -1, 1)).ravel()


def around(cover: Triangulation, n: int) -> np.ndarray:
    return np.bincount(cover.tails, weights=angles(cover), minlength=n)


def test_mollification_by_hand():
    # Sides 3, 4, 7 have no slack; the mean edge is 14/3, so ε = .3 of it wants 1.4 more.
    found = mollify_lengths(np.array([3.0, 4.0, 7.0]), np.arange(3), 0.3)
    np.testing.assert_allclose(found, [4.4, 5.4, 8.4], rtol=1e-15)
    np.testing.assert_array_equal(
        mollify_lengths(np.array([3.0, 4.0, 5.0]), np.arange(3), 0.3), [3, 4, 5]
    )


def test_sides_of_one_edge_have_one_key():
    faces = np.array([[0, 1, 2], [1, 0, 3]])
    tails, heads = side_ends(faces)
    assert tails.tolist() == [0, 1, 2, 1, 0, 3]
    assert heads.tolist() == [1, 2, 0, 0, 3, 1]
    keys = edge_keys(faces, 4)
    assert keys[0] == keys[3]
    assert len(set(keys.tolist())) == 5


def test_faces_without_area_are_lived_with_and_refused_without_mollification():
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], [[0, 1, 2], [0, 1, 3]])
    require_laws(mesh)
    equal = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], [[0, 1, 2], [1, 3, 2]])
    require_laws(equal)
    with pytest.raises(InvalidShapeError, match=r"Faces must have area; face 1 is \[0, 1, 3\]"):
        robust_laplacian(mesh, mollify=0.0)
    with pytest.raises(
        InvalidShapeError,
        match=r"Mollified faces must have area; face 1 .* larger mollify than 1e-18",
    ):
        robust_laplacian(mesh, mollify=1e-18)


def test_without_mollification_good_faces_give_the_same():
    require_same(dense(torus(7, 5)), dense(torus(7, 5)))
    laplacian = robust_laplacian(torus(7, 5), mollify=0.0)
    require_same(
        dense(torus(7, 5)), (laplacian.stiffness.toarray(), laplacian.mass.toarray()), 1e-14
    )


def test_what_cannot_be_lived_with_is_refused():
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]]
    with pytest.raises(
        InvalidShapeError, match=r"Faces must have distinct corners; face 1 is \[0, 3, 3\]"
    ):
        robust_laplacian(TriangleMesh(points, [[0, 1, 2], [0, 3, 3]]))
    with pytest.raises(InvalidShapeError, match=r"Every vertex must belong to a face; vertex 3"):
        robust_laplacian(TriangleMesh(points, [[0, 1, 2]]))
    with pytest.raises(
        InvalidShapeError, match=r"Faces must differ, or they count twice; faces 0 and 1 both have"
    ):
        robust_laplacian(TriangleMesh(points[:3], [[0, 1, 2], [2, 1, 0]]))
    with pytest.raises(
        InvalidShapeError, match=r"vertices of a mesh must differ; all 3 are \[5\.0, 5\.0, 5\.0\]"
    ):
        robust_laplacian(TriangleMesh([[5, 5, 5]] * 3, [[0, 1, 2]]))


@pytest.mark.parametrize("mollify", [-1e-9, np.nan, np.inf])
def test_a_mollification_that_is_no_length_is_refused(mollify):
    with pytest.raises(
        InvalidParameterError, match=r"mollify must be finite and not negative; it is"
    ):
        robust_laplacian(FAN, mollify=mollify)


@pytest.mark.parametrize("scale", [1e300, 1e160, 1e-160, 1e-300])
def test_areas_that_floats_cannot_hold_are_refused(scale):
    with pytest.raises(InvalidShapeError, match=r"To measure areas .* within 1e-150\.\.1e150"):
        robust_laplacian(TriangleMesh(FAN.vertices * scale, FAN.faces))


def test_flips_without_end_are_an_error():
    points, faces = grid(2, 2).vertices, grid(2, 2).faces
    lengths = np.linalg.norm(points[faces] - points[np.roll(faces, -1, axis=1)], axis=2).ravel()
    with pytest.raises(
        ConvergenceError, match=r"Flips to Delaunay must end; 48000 flips of 24 edges did not"
    ):
        flip_to_delaunay(
            tufted_cover(points, faces, lengths), tolerance=-1.0
        )  # flips what is Delaunay, too


def test_the_spectrum_of_the_moebius_strip_is_near_that_of_the_flat_one():
    # A strip of length 2π and width w, the ends glued upside down: cos and sin of kx/2, even in y for even k, odd for
    # odd k. The lowest are 0, 1, 1, 4, 4; odd ones need at least (π/w)².
    found = solve_spectrum(robust_laplacian(moebius(60, 6)), 5).eigenvalues
    np.testing.assert_allclose(found, [0, 1, 1, 4, 4], rtol=0.1, atol=1e-12)


@pytest.mark.filterwarnings("ignore:Both sides of a seam")
@pytest.mark.data
def test_every_nasty_file_that_can_be_read_gives_a_lawful_operator_or_a_named_error(data):
    refused, lawful = [], 0
    for path in sorted((data / "nasty").glob("*/*")):
        try:
            mesh = read_mesh(path)
        except CerteigError:
            continue
        try:
            require_laws(mesh)
            lawful += 1
        except InvalidShapeError:
            refused.append(path.name)
    # Faces with a corner twice, and the face between two tetrahedra, which both have.
    assert refused == ["cube-minimal-degenerated.obj", "joined_tetrahedra.obj"]
    assert lawful > 70


def ribbon(points):
    """Faces along a row of points."""
    return TriangleMesh(points, [[i, i + 1, i + 2] for i in range(len(points) - 2)])


@pytest.mark.parametrize("n", [30, 300, 3000])
@pytest.mark.parametrize(("scale", "shift"), [(1.0, 0.0), (1.0, 100.0), (1e-60, 0.0), (1e60, 0.0)])
@pytest.mark.parametrize("build", [robust_laplacian, cotangent_laplacian])
def test_points_on_a_line_have_no_operator(n, scale, shift, build):
    line = (
        np.linspace(0, scale, n)[:, None]
        * Rotation.random(rng=np.random.default_rng(n)).as_matrix()[0]
        + shift
    )
    fact = r"The vertices of a mesh must span 2 dimensions; all \d+ lie on a line through point 0|Faces must have area"
    with pytest.raises(InvalidShapeError, match=fact):
        build(ribbon(line))
    across = np.zeros((n, 3))
    across[::2] = 1e-3 * scale * np.cross(line[-1] - line[0], [1.0, 2.0, 3.0]) / scale
    assert build(ribbon(line + across)).n_points == n


def test_faces_without_area_that_span_space_have_no_operator():
    points = np.vstack([np.outer(np.arange(3.0), axis) for axis in np.eye(3)])
    with pytest.raises(InvalidShapeError, match="Faces must have area; all 3 have none"):
        robust_laplacian(TriangleMesh(points, np.arange(9).reshape(3, 3)))
