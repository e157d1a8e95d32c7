"""Spectra that are known in closed form, and the order at which ours approach them."""

import numpy as np
import pytest
import scipy.sparse as sp

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.shapes.surfaces import grid, icosphere
from eigenshape.spectral.solve import solve_spectrum

MASSES = ["lumped", "consistent", "averaged"]


def sphere_eigenvalues(k):
    degrees = np.arange(k)
    return np.repeat(degrees * (degrees + 1), 2 * degrees + 1)[:k].astype(float)


RIGHT = np.array([[1.0, 0.0], [0.0, 0.7]])
EQUILATERAL = np.array([[1.0, 0.0], [-0.5, np.sqrt(0.75)]])


def flat_torus(n: int, periods: np.ndarray, mass: str) -> Laplacian:
    """Linear elements on the parallelogram of two periods, cut into 2n² equal triangles, opposite sides glued."""
    square = grid(n, n)
    steps = np.round(square.vertices[:, :2] * n).astype(int) % n
    mesh = TriangleMesh(np.pad(square.vertices[:, :2] @ periods, ((0, 0), (0, 1))), square.faces)
    whole = cotangent_laplacian(mesh, mass)
    glue = sp.csr_array((np.ones(mesh.n_vertices), (np.arange(mesh.n_vertices), steps @ [n, 1])))
    return Laplacian(
        sp.csr_array(glue.T @ whole.stiffness @ glue), sp.csr_array(glue.T @ whole.mass @ glue)
    )


def flat_torus_eigenvalues(periods, k):
    """4π² |ξ|² over the lattice of frequencies ξ that are whole on both periods."""
    modes = np.stack(np.meshgrid(np.arange(-k, k + 1), np.arange(-k, k + 1)), axis=-1).reshape(
        -1, 2
    )
    frequencies = modes @ np.linalg.inv(periods).T
    return np.sort(4 * np.pi**2 * (frequencies**2).sum(axis=1))[:k]


def observed_order(errors, ratio=2.0):
    return np.diff(-np.log(errors)) / np.log(ratio)


@pytest.mark.parametrize(("mass", "order"), [("lumped", 2), ("consistent", 2), ("averaged", 2)])
def test_sphere_converges(mass, order):
    exact = sphere_eigenvalues(36)
    errors = []
    for level in (2, 3, 4):
        found = solve_spectrum(cotangent_laplacian(icosphere(level), mass), 36).eigenvalues
        errors.append(np.abs(found[1:] / exact[1:] - 1).max())
    np.testing.assert_allclose(observed_order(np.array(errors))[-1], order, atol=0.15)
    assert errors[-1] < 0.02


def test_sphere_multiplicities_are_seen_as_clusters():
    values = solve_spectrum(cotangent_laplacian(icosphere(4), "averaged"), 64).eigenvalues
    for degree in range(8):
        cluster = values[degree**2 : (degree + 1) ** 2]
        assert np.ptp(cluster) < 0.02 * max(degree * (degree + 1), 1)
        if degree:
            assert cluster[0] - values[degree**2 - 1] > degree


@pytest.mark.parametrize(
    ("periods", "mass", "order"),
    [
        (RIGHT, "lumped", 2),
        (RIGHT, "consistent", 2),
        (RIGHT, "averaged", 2),
        (EQUILATERAL, "lumped", 2),
        (EQUILATERAL, "consistent", 2),
        (
            EQUILATERAL,
            "averaged",
            4,
        ),  # here the two leading errors are opposite in every direction, and cancel
    ],
)
def test_flat_torus_converges(periods, mass, order):
    exact = flat_torus_eigenvalues(periods, 19)
    errors = []
    for n in (12, 24, 48):
        found = solve_spectrum(flat_torus(n, periods, mass), 19).eigenvalues
        errors.append(np.abs(found[1:] / exact[1:] - 1).max())
    np.testing.assert_allclose(observed_order(np.array(errors))[-1], order, atol=0.15)


@pytest.mark.parametrize("n", [16, 20])
def test_flat_torus_multiplicities_are_exact(n):
    laplacian = flat_torus(n, EQUILATERAL, "lumped")
    values = solve_spectrum(laplacian, 19).eigenvalues
    np.testing.assert_allclose(values[1:7], values[1], rtol=1e-12)  # the six shortest frequencies
    np.testing.assert_allclose(values[7:13], values[7], rtol=1e-12)
    assert solve_spectrum(laplacian, 5).certificate.n_split == 2
    assert solve_spectrum(laplacian, 7).certificate.n_split == 0


@pytest.mark.parametrize("mass", MASSES)
def test_rectangle_with_free_boundary(mass):
    modes = np.arange(8)
    exact = np.sort(((np.pi * modes / 1.0) ** 2)[:, None] + (np.pi * modes / 0.6) ** 2, axis=None)[
        :12
    ]
    found = solve_spectrum(
        cotangent_laplacian(grid(50, 30, width=1.0, height=0.6), mass), 12
    ).eigenvalues
    np.testing.assert_allclose(found, exact, rtol=0.01, atol=1e-9)


def test_consistent_mass_bounds_from_above_and_lumped_from_below():
    exact = flat_torus_eigenvalues(RIGHT, 25)[1:]
    above = solve_spectrum(flat_torus(20, RIGHT, "consistent"), 25).eigenvalues[1:]
    below = solve_spectrum(flat_torus(20, RIGHT, "lumped"), 25).eigenvalues[1:]
    assert (above >= exact).all()
    assert (below <= exact).all()


@pytest.mark.parametrize("n", [50, 400])
def test_path_graph(n):
    adjacency = sp.diags_array([np.ones(n - 1), np.ones(n - 1)], offsets=[1, -1])
    stiffness = sp.csr_array(sp.diags_array(adjacency.sum(axis=1)) - adjacency)
    found = solve_spectrum(Laplacian(stiffness, sp.csr_array(sp.eye_array(n))), 20).eigenvalues
    np.testing.assert_allclose(
        found, 4 * np.sin(np.pi * np.arange(20) / (2 * n)) ** 2, rtol=1e-9, atol=1e-14
    )


def test_regular_tetrahedron_by_hand():
    # Edge 1, area √3/4 a face: W has 3/√3 on the diagonal and -1/√3 off it, B is √3/4; so λ = (4/√3) / (√3/4) = 16/3.
    corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(8)
    mesh = TriangleMesh(corners, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]))
    np.testing.assert_allclose(
        solve_spectrum(cotangent_laplacian(mesh), 4).eigenvalues,
        [0, 16 / 3, 16 / 3, 16 / 3],
        atol=1e-14,
    )
