import numpy as np
import pytest
import scipy.sparse as sp

from eigenshape._corners import longest_edges
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.crouzeix_raviart import (
    REGULAR_TETRAHEDRON,
    TRIANGLE,
    crouzeix_raviart_laplacian,
    interpolation_constants,
    mass_floor,
)
from eigenshape.operators.laplacian import Laplacian
from eigenshape.shapes import exact
from eigenshape.shapes.domains import ball, box, circle, interval, irregular_grid
from eigenshape.shapes.surfaces import grid, icosphere
from eigenshape.spectral.solve import solve_spectrum

RIGHT = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
CORNER = SimplicialMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
REGULAR = SimplicialMesh([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2, 3]])


def test_the_right_triangle_by_hand():
    # Facets (0,1), (0,2), (1,2) lie opposite to corners 2, 1, 0 with gradients (0,1), (1,0), (-1,-1); 4 V = 2.
    laplacian = crouzeix_raviart_laplacian(RIGHT)
    np.testing.assert_allclose(
        laplacian.stiffness.toarray(), [[2, 0, -2], [0, 2, -2], [-2, -2, 4]], atol=1e-15
    )
    np.testing.assert_allclose(laplacian.mass.toarray(), np.eye(3) / 6, rtol=1e-15)
    assert laplacian.mass.nnz == 3


def test_the_corner_of_a_cube_by_hand():
    # 9 V = 3/2, and the facet (1,2,3), last in order, has the gradient (-1,-1,-1).
    laplacian = crouzeix_raviart_laplacian(CORNER)
    expected = 1.5 * np.array([[1, 0, 0, -1], [0, 1, 0, -1], [0, 0, 1, -1], [-1, -1, -1, 3]])
    np.testing.assert_allclose(laplacian.stiffness.toarray(), expected, atol=1e-15)
    mass = np.full((4, 4), -1 / 20) + np.eye(4) * (2 / 5 + 1 / 20)
    np.testing.assert_allclose(laplacian.mass.toarray(), mass / 6, rtol=1e-14)


@pytest.mark.parametrize("mesh", [interval(5), grid(3, 2), box(2, 2, 2), icosphere(1)])
def test_linear_functions_have_their_energy_and_square(mesh):
    laplacian, linear = crouzeix_raviart_laplacian(mesh), cotangent_laplacian(mesh, "consistent")
    values = mesh.points @ np.arange(1.0, mesh.points.shape[1] + 1) + 0.3
    means = values[facet_table(mesh).facets].mean(axis=1)
    for ours, known in ((laplacian.stiffness, linear.stiffness), (laplacian.mass, linear.mass)):
        assert means @ ours @ means == pytest.approx(values @ known @ values, rel=1e-13)
    assert laplacian.mass.sum() == pytest.approx(simplex_volumes(mesh).sum(), rel=1e-13)
    np.testing.assert_allclose(laplacian.stiffness.sum(axis=1), 0, atol=1e-12)


def test_on_segments_they_are_linear_elements():
    mesh = circle(7)
    ours, known = crouzeix_raviart_laplacian(mesh), cotangent_laplacian(mesh, "consistent")
    np.testing.assert_allclose(ours.stiffness.toarray(), known.stiffness.toarray(), atol=1e-13)
    np.testing.assert_allclose(ours.mass.toarray(), known.mass.toarray(), atol=1e-15)


def test_in_four_dimensions_the_mass_is_that_of_the_functions():
    rng = np.random.default_rng(0)
    mesh = SimplicialMesh(np.concatenate([np.zeros((1, 4)), np.eye(4)]), [[0, 1, 2, 3, 4]])
    barycentric = rng.dirichlet(np.ones(5), 400_000)
    functions = (
        1 - 4 * barycentric[:, ::-1]
    )  # facets come in the order of the corners that they lack, from the last
    np.testing.assert_allclose(
        crouzeix_raviart_laplacian(mesh).mass.toarray(),
        functions.T @ functions / 400_000 / 24,
        atol=2e-4,
    )


@pytest.mark.parametrize("dim", [1, 2, 3, 4, 5])
def test_the_floor_of_the_mass(dim):
    mesh = SimplicialMesh(np.concatenate([np.zeros((1, dim)), np.eye(dim)]), [list(range(dim + 1))])
    mass = crouzeix_raviart_laplacian(mesh).mass.toarray()
    assert np.linalg.eigvalsh(mass / mass[0, 0])[0] == pytest.approx(mass_floor(dim), rel=1e-12)


def test_eigenvalues_come_from_below_on_fine_meshes():
    expected = exact.box_eigenvalues(12)
    found = solve_spectrum(crouzeix_raviart_laplacian(grid(24, 24)), 12).eigenvalues
    assert (found[1:] < expected[1:]).all()
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=1e-9)


def subdivided(corners, n):
    """Cut a simplex into n^m, and say where its points lie in it."""
    if len(corners) == 3:
        cells = [(i, j) for i in range(n) for j in range(n - i)]
        up = [((i, j), (i + 1, j), (i, j + 1)) for i, j in cells]
        down = [((i + 1, j), (i + 1, j + 1), (i, j + 1)) for i, j in cells if i + j < n - 1]
        names, simplices = np.unique(
            np.array(up + down).reshape(-1, 2), axis=0, return_inverse=True
        )
        inner = names / n
    else:
        cube = box(n, n, n)
        x, y, z = cube.points[cube.simplices].mean(axis=1).T
        kept, simplices = np.unique(cube.simplices[(x > y) & (y > z)], return_inverse=True)
        x, y, z = cube.points[kept].T
        inner = np.column_stack([x - y, y - z, z])
    places = np.column_stack([1 - inner.sum(axis=1), inner])
    return SimplicialMesh(places @ corners, simplices.reshape(-1, len(corners))), places


def proved_constant(corners, n, constant):
    """Bound the interpolation constant of one simplex from that of its pieces.

    Functions without mean on its sides: Crouzeix-Raviart interpolation on the pieces keeps that, so their lower bound
    holds here too. A penalty on the means can but lower what it is a bound of.
    """
    mesh, places = subdivided(corners, n)
    laplacian, table = crouzeix_raviart_laplacian(mesh), facet_table(mesh)
    sides = (np.abs(places[table.facets]).max(axis=1) < 1e-9).astype(float)
    penalty = sp.csr_array(sides) @ sp.csr_array(sides).T
    strong = 100 * laplacian.stiffness.diagonal().mean() / n ** (len(corners) - 2)
    pencil = Laplacian((laplacian.stiffness + strong * penalty).tocsr(), laplacian.mass)
    lowest = solve_spectrum(pencil, 1).eigenvalues[0]
    return np.sqrt(1 / lowest + constant(mesh).max() ** 2)


def test_the_constant_of_the_equilateral_triangle_is_proved_from_a_cruder_one():
    def crude(mesh):  # 1/π² + 1/48, any triangle
        return 0.3496 * longest_edges(mesh)

    corners = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0]])
    bound = proved_constant(corners, 96, crude)
    assert 0.1891 < bound <= TRIANGLE


@pytest.mark.parametrize("apex", [[0.5, 0.5], [0.7, 0.7], [0.8, 0.6], [0.95, 0.1], [0.5, 0.1]])
def test_other_triangles_keep_below_the_constant_of_all(apex):
    corners = np.array([[0, 0, 0], [1, 0, 0], [*apex, 0]])
    assert proved_constant(corners, 40, lambda mesh: 0.3496 * longest_edges(mesh)) < TRIANGLE


@pytest.mark.long
def test_the_constant_of_the_regular_tetrahedron_is_proved_from_that_of_any():
    def any_shape(mesh):
        return 0.3312 * longest_edges(mesh)

    corners = REGULAR.points / 8**0.5
    assert 0.144 < proved_constant(corners, 18, any_shape) <= REGULAR_TETRAHEDRON


def test_constants_by_hand():
    assert interpolation_constants(interval(2, 3.0)) == pytest.approx([1.5 / np.pi] * 2)
    assert interpolation_constants(RIGHT) == pytest.approx([TRIANGLE * 2**0.5])
    assert interpolation_constants(REGULAR) == pytest.approx([REGULAR_TETRAHEDRON * 8**0.5])
    long = SimplicialMesh([[0, 0, 0], [9, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], [[0, 1, 2, 3]])
    edges = np.array([9, 0.1, 0.1, 81.01**0.5, 81.01**0.5, 0.02**0.5])
    assert interpolation_constants(long) <= np.sqrt(81.01 / np.pi**2 + (edges**2).sum() / 720) * (
        1 + 1e-12
    )


def test_constants_scale_and_turn_with_the_mesh():
    mesh, turn = ball(4), np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    turned = SimplicialMesh(1e90 * mesh.points @ turn, mesh.simplices[:, [2, 0, 3, 1]])
    np.testing.assert_allclose(
        interpolation_constants(turned), 1e90 * interpolation_constants(mesh), rtol=1e-12
    )


@pytest.mark.parametrize(
    "mesh", [irregular_grid(6, 6, rng=np.random.default_rng(2)), ball(4), circle(9)]
)
def test_no_function_breaks_the_constant(mesh):
    # ‖u - Πu‖ ≤ C ‖∇(u - Πu)‖ for u = |x|², simplex by simplex, by a quadrature of degree 4.
    rng, corners = np.random.default_rng(1), mesh.points[mesh.simplices]
    m = mesh.dim
    places = rng.dirichlet(np.ones(m + 1), 4000)
    sides = corners[:, 1:] - corners[:, :1]
    to_gradient = np.linalg.pinv(sides)
    for side, gradient, simplex, bound in zip(
        sides, to_gradient, corners, interpolation_constants(mesh), strict=True
    ):
        values = ((places @ simplex) ** 2).sum(axis=1)
        means = [_mean_of_square(np.delete(simplex, corner, axis=0)) for corner in range(m + 1)]
        at_corners = np.sum(means) - m * np.array(means)
        w = values - places @ at_corners
        tangent = gradient @ side
        slope = (2 * places @ simplex) @ tangent - gradient @ (at_corners[1:] - at_corners[0])
        assert np.mean(w**2) < bound**2 * np.mean((slope**2).sum(axis=1))


def _mean_of_square(points):
    m = len(points) - 1
    center = points.mean(axis=0)
    return (center**2).sum() + ((points - center) ** 2).sum() / ((m + 1) * (m + 2))


def test_flat_simplices_and_loose_points_are_refused():
    with pytest.raises(
        InvalidShapeError, match=r"Faces must have area; face 0 is \[0, 1, 1\]|all 1 have none"
    ):
        crouzeix_raviart_laplacian(TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]))
    with pytest.raises(InvalidShapeError, match="Every vertex must belong to a face"):
        crouzeix_raviart_laplacian(TriangleMesh([*RIGHT.vertices, [5, 5, 5]], [[0, 1, 2]]))
