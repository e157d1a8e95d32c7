from fractions import Fraction
from math import factorial

import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.operators import elements
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.fem import fem_boundary_nodes, fem_laplacian, fem_nodes
from eigenshape.shapes.domains import ball, box, disc, interval, irregular_grid
from eigenshape.shapes.surfaces import grid, icosphere, torus

RNG = np.random.default_rng


def corner_simplex(dim):
    return SimplicialMesh(np.vstack([np.zeros(dim), np.eye(dim)]), [np.arange(dim + 1)])


def test_quadratic_elements_of_a_segment_by_hand():
    laplacian = fem_laplacian(interval(1), 2)  # nodes 0, 1 and the middle
    np.testing.assert_allclose(
        laplacian.stiffness.toarray() * 3,
        [[7, 1, -8], [1, 7, -8], [-8, -8, 16]],
        rtol=1e-13,
        atol=1e-13,
    )
    np.testing.assert_allclose(
        laplacian.mass.toarray() * 30, [[4, -1, 2], [-1, 4, 2], [2, 2, 16]], atol=1e-13
    )


def test_quadratic_mass_of_a_triangle_from_the_textbook():
    mass = fem_laplacian(corner_simplex(2), 2).mass.toarray() * 360
    np.testing.assert_allclose(np.diag(mass), [6] * 3 + [32] * 3, rtol=1e-12)
    np.testing.assert_allclose(
        mass[:3, :3] - np.diag([6] * 3), -np.ones((3, 3)) + np.eye(3), atol=1e-12
    )
    np.testing.assert_allclose(np.sort(mass[:3, 3:], axis=1), [[-4, 0, 0]] * 3, atol=1e-12)
    np.testing.assert_allclose(mass[3:, 3:], 16 + 16 * np.eye(3), rtol=1e-12)


@pytest.mark.parametrize("dim", [1, 2, 3, 4])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_reference_masses_add_up_to_one(dim, order):
    assert elements.reference_mass(dim, order).sum() == pytest.approx(1, rel=1e-12)
    n_nodes = factorial(dim + order) // factorial(dim) // factorial(order)
    assert elements.reference_mass(dim, order).shape == (n_nodes, n_nodes)


def monomial_integral(powers):
    """∫ x^a over the corner simplex of R^m: a! / (m + |a|)!."""
    above = np.prod([factorial(power) for power in powers])
    return Fraction(int(above), factorial(len(powers) + sum(powers)))


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_polynomials_of_the_order_have_their_exact_norm_and_energy(dim, order):
    mesh = corner_simplex(dim)
    laplacian, nodes = fem_laplacian(mesh, order), fem_nodes(mesh, order)
    for axis in range(dim):
        values = nodes[:, axis] ** order
        powers = [2 * order if a == axis else 0 for a in range(dim)]
        assert values @ laplacian.mass @ values == pytest.approx(
            float(monomial_integral(powers)), rel=1e-11
        )
        powers[axis] -= 2
        energy = order**2 * float(monomial_integral(powers))
        assert values @ laplacian.stiffness @ values == pytest.approx(energy, rel=1e-11)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_linear_functions_are_harmonic_inside_irregular_meshes(order):
    mesh = irregular_grid(6, 5, rng=RNG(0))
    residual = fem_laplacian(mesh, order).stiffness @ fem_nodes(mesh, order)
    inside = np.setdiff1d(np.arange(len(residual)), fem_boundary_nodes(mesh, order))
    np.testing.assert_allclose(residual[inside], 0, atol=1e-13)


@pytest.mark.parametrize(
    "mesh", [interval(3), torus(6, 5), irregular_grid(4, 4, rng=RNG(1)), box(2, 1, 2), ball(3)]
)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_mass_is_the_volume_and_constants_have_no_energy(mesh, order):
    laplacian = fem_laplacian(mesh, order)
    ones = np.ones(laplacian.n_points)
    assert ones @ laplacian.mass @ ones == pytest.approx(simplex_volumes(mesh).sum(), rel=1e-12)
    np.testing.assert_allclose(
        laplacian.stiffness @ ones, 0, atol=1e-12 * laplacian.stiffness.max()
    )
    if laplacian.n_points < 400:
        assert (
            np.linalg.eigvalsh(laplacian.stiffness.toarray())[0]
            > -1e-12 * laplacian.stiffness.max()
        )
        assert np.linalg.eigvalsh(laplacian.mass.toarray())[0] > 0


def test_linear_elements_are_the_cotangent_laplacian():
    mesh = torus(8, 6)
    one, two = fem_laplacian(mesh, 1), cotangent_laplacian(mesh, "consistent")
    for name in ("stiffness", "mass"):
        np.testing.assert_allclose(
            getattr(one, name).toarray(), getattr(two, name).toarray(), atol=1e-14
        )


def test_nodes_are_counted_as_euler_says():
    mesh = icosphere(1)  # 42 vertices, 120 edges, 80 faces
    assert [len(fem_nodes(mesh, order)) for order in (1, 2, 3)] == [42, 42 + 120, 42 + 240 + 80]
    np.testing.assert_array_equal(fem_nodes(mesh, 3)[:42], mesh.vertices)


def test_boundary_nodes():
    assert fem_boundary_nodes(interval(4), 3).tolist() == [0, 4]
    assert fem_boundary_nodes(icosphere(1), 2).size == 0
    for order in (1, 2, 3):
        square, drum = grid(3, 4), disc(3)
        nodes = fem_nodes(square, order)
        on_rim = (nodes[:, :2] == 0).any(axis=1) | (np.abs(nodes[:, :2] - 1) < 1e-14).any(axis=1)
        np.testing.assert_array_equal(fem_boundary_nodes(square, order), np.flatnonzero(on_rim))
        assert len(fem_boundary_nodes(drum, order)) == 18 * order
    cube = box(2, 2, 2)
    nodes = fem_nodes(cube, 2)
    on_rim = (np.abs(nodes - 0.5) > 0.5 - 1e-12).any(axis=1)
    np.testing.assert_array_equal(fem_boundary_nodes(cube, 2), np.flatnonzero(on_rim))


@pytest.mark.parametrize("size", [1e-100, 1e100])
@pytest.mark.parametrize("mesh", [interval(4), torus(6, 5), box(1, 2, 1)])
def test_units_scale_exactly(size, mesh):
    one, other = (
        fem_laplacian(mesh, 2),
        fem_laplacian(SimplicialMesh(size * mesh.points, mesh.simplices), 2),
    )
    np.testing.assert_allclose(
        other.mass.toarray() / size**mesh.dim, one.mass.toarray(), rtol=1e-10, atol=1e-15
    )
    expected = one.stiffness.toarray() * size ** (mesh.dim - 2)
    np.testing.assert_allclose(
        other.stiffness.toarray(), expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max()
    )


def test_many_points_get_keys_that_fit():
    far = 3_000_000  # its keys of three corners need more than 64 bits
    names, numbers = elements.number_nodes(np.array([[0, 5], [0, far], [0, 5]]), 3)
    assert numbers[0].tolist() == numbers[2].tolist()
    assert len(np.unique(numbers)) == len(names) == 7
    assert names[numbers[1]].tolist() == [[0, 0, 0], [0, 0, far], [0, far, far], [far, far, far]]


@pytest.mark.parametrize("order", [0, 4])
def test_other_orders_are_refused(order):
    with pytest.raises(InvalidParameterError, match=rf"order must lie in 1\.\.3; it is {order}"):
        fem_laplacian(icosphere(1), order)


def test_loose_points_and_flat_elements_are_refused():
    points = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [5, 5, 5]]
    with pytest.raises(InvalidShapeError, match="Every point must belong to a simplex; point 4"):
        fem_laplacian(SimplicialMesh(points, [[0, 1, 2, 3]]), 2)
    with pytest.raises(InvalidShapeError, match="Tetrahedra must have volume; all 1 have none"):
        fem_laplacian(SimplicialMesh(np.arange(12.0).reshape(4, 3), [[0, 1, 2, 3]]), 2)
