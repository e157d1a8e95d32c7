from fractions import Fraction

import numpy as np
import pytest
import scipy.linalg as sl

from certeig.kit.arrays import EPS
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.crouzeix_raviart import crouzeix_raviart_laplacian, mass_floor
from eigenshape.shapes.domains import ball, interval
from eigenshape.shapes.surfaces import grid, icosphere
from eigenshape.spectral.bounds.nonconforming import enclose, relative_rounding
from eigenshape.spectral.solve import solve_spectrum

EQUILATERAL = TriangleMesh([[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0]], [[0, 1, 2]])


def exact_sides(corners):
    """Return e_a·e_b of the sides opposite to the corners, without rounding."""
    rows = [[Fraction(float(value)) for value in point] for point in corners]
    sides = [
        [y - x for x, y in zip(rows[(a + 1) % 3], rows[(a + 2) % 3], strict=True)] for a in range(3)
    ]
    return [[sum(x * y for x, y in zip(one, two, strict=True)) for two in sides] for one in sides]


def test_an_equilateral_triangle_by_hand():
    # Σ |e|² / (height · height) = 3 · 4/3; 4 · 3² · (3 coordinates + 1 triangle at an edge)
    assert relative_rounding(EQUILATERAL) == pytest.approx(4 * 9 * 4 * EPS * 4)


@pytest.mark.parametrize("height", [1.0, 1e-2, 1e-4, 1e-6])
def test_what_rounding_does_to_one_triangle_is_within_the_bound(height):
    rng = np.random.default_rng(int(-np.log10(height)))
    for _ in range(40):
        points = rng.standard_normal((3, 3))
        points[2] = (
            points[0] + rng.uniform() * (points[1] - points[0]) + height * rng.standard_normal(3)
        )
        points += rng.standard_normal(3)  # far from the origin, for one more rounding
        mesh = TriangleMesh(points, [[0, 1, 2]])
        products = exact_sides(points)
        doubled = products[0][0] * products[1][1] - products[0][1] ** 2  # (2 area)²
        # W_ab = e_a·e_b / 4V and V² known exactly, so that (4V W)_ab can be compared as fractions.
        weights = cotangent_laplacian(mesh).stiffness.toarray()
        area = Fraction(float(doubled)) ** Fraction(1, 2) / 2
        off = [
            [
                Fraction(float(weights[a, b])) * 4 * Fraction(float(area)) - products[a][b]
                for b in range(3)
            ]
            for a in range(3)
        ]
        error = np.array([[float(entry) for entry in row] for row in off])
        known = np.array([[float(entry) for entry in row] for row in products])
        basis = np.array([[1.0, -1, 0], [1, 1, -2]]).T
        worst = np.abs(sl.eigvals(basis.T @ error @ basis, basis.T @ known @ basis)).max()
        assert worst <= relative_rounding(mesh)


def test_flat_triangles_and_crowded_edges_cost_digits():
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [0.5, 1e-3, 0]], [[0, 1, 2]])
    assert relative_rounding(flat) == pytest.approx(4 * 9 * 4 * EPS * 1e6 / 2, rel=0.01)
    angles = np.arange(9.0)
    fan = [[0, 0, 0], [0, 0, 1], *np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])]
    book = TriangleMesh(fan, [[0, 1, page] for page in range(2, 11)])
    single = TriangleMesh(fan[:3], [[0, 1, 2]])
    assert relative_rounding(book) == pytest.approx(relative_rounding(single) * (3 + 9) / (3 + 1))


@pytest.mark.parametrize("scale", [1e-90, 1e90])
def test_it_has_no_unit(scale):
    mesh = ball(4)
    assert relative_rounding(SimplicialMesh(scale * mesh.points, mesh.simplices)) == pytest.approx(
        relative_rounding(mesh), rel=1e-10
    )


@pytest.mark.parametrize("mesh", [interval(30), grid(6, 6), icosphere(1), ball(4)])
@pytest.mark.parametrize("build", ["linear", "crouzeix-raviart"])
def test_eigenvalues_of_the_matrices_lie_inside(mesh, build):
    if build == "linear":
        laplacian, floor = cotangent_laplacian(mesh, "consistent"), 0.5
    else:
        laplacian, floor = crouzeix_raviart_laplacian(mesh), mass_floor(mesh.dim)
    known = sl.eigh(laplacian.stiffness.toarray(), laplacian.mass.toarray(), eigvals_only=True)[:20]
    low, high = enclose(solve_spectrum(laplacian, 20), laplacian, floor, relative_rounding(mesh))
    assert (low <= np.maximum(known, 0)).all()
    assert (known <= high).all()
    assert (high - low <= 1e-9 * known[-1]).all()
