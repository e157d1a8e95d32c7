"""Orders of convergence of derivatives, equations and curvatures; fitted, not assumed."""

import numpy as np
import pytest
from scipy.linalg import eigh

import eigenshape as es
from eigenshape import calculus

LEVELS = (2, 3, 4)


def fitted_order(widths, errors):
    """Return the slope of log error over log width."""
    return np.polyfit(np.log(widths), np.log(errors), 1)[0]


def spheres():
    return [es.icosphere(level) for level in LEVELS]


def random_spheres():
    rng = np.random.default_rng(7)
    return [es.shapes.random_sphere(10 * 4**level + 2, rng=rng) for level in LEVELS]


def tori():
    return [es.shapes.torus(2 * n, n, outer=2.0, inner=1.0) for n in (12, 24, 48)]


def solids():
    return [es.shapes.box(n, n, n) for n in (4, 8, 12)]


def widths_of(meshes):
    return [es.geometry.mean_side_length(mesh) for mesh in meshes]


def rms(mesh, errors):
    weights = es.geometry.dual_volumes(mesh)
    return np.sqrt(weights @ np.square(errors) / weights.sum())


def sphere_source(mesh):
    """Return u = xy + z, harmonics of degree 2 and 1 on the unit sphere, and -Δu."""
    x, y, z = mesh.vertices.T
    return x * y + z, 6 * x * y + 2 * z


@pytest.mark.parametrize("meshes", [spheres, random_spheres])
def test_poisson_on_the_sphere_is_of_second_order(meshes):
    family, errors = meshes(), []
    for mesh in family:
        laplacian = es.cotangent_laplacian(mesh)
        exact, source = sphere_source(mesh)
        source = calculus.remove_means(laplacian, source)
        exact = calculus.remove_means(laplacian, exact)
        errors.append(rms(mesh, calculus.solve_poisson(laplacian, source) - exact))
    assert fitted_order(widths_of(family), errors) > 1.8


def test_poisson_on_the_torus_is_of_second_order():
    family, errors = tori(), []
    for mesh in family:
        laplacian = es.cotangent_laplacian(mesh)
        x, y, z = mesh.vertices.T
        # u = z = sin θ on the tube: -Δu = sin θ + sin θ cos θ / (2 + cos θ).
        rho = np.hypot(x, y)
        source = calculus.remove_means(laplacian, z + z * (rho - 2) / rho)
        found = calculus.solve_poisson(laplacian, source)
        errors.append(rms(mesh, found - calculus.remove_means(laplacian, z)))
    assert fitted_order(widths_of(family), errors) > 1.8


def test_poisson_in_a_cube_is_of_second_order():
    family, errors = solids(), []
    for mesh in family:
        rim = es.geometry.boundary_vertices(mesh)
        exact = np.sin(np.pi * mesh.points).prod(axis=1)
        laplacian = es.cotangent_laplacian(mesh)
        found = calculus.solve_poisson(laplacian, 3 * np.pi**2 * exact, fixed=rim)
        errors.append(rms(mesh, found - exact))
    assert fitted_order(widths_of(family), errors) > 1.7


def test_the_gradient_on_the_sphere_is_of_first_order():
    family, errors = spheres(), []
    for mesh in family:
        middles = mesh.vertices[mesh.faces].mean(axis=1)
        middles /= np.linalg.norm(middles, axis=1, keepdims=True)
        slope = np.array([0.0, 0.0, 1.0]) - middles[:, 2:] * middles
        found = calculus.gradient(mesh, mesh.vertices[:, 2])
        errors.append(np.linalg.norm(found - slope, axis=1).max())
    assert fitted_order(widths_of(family), errors) > 0.9


def test_heat_steps_are_of_first_order_in_time():
    mesh = es.icosphere(2)
    laplacian = es.cotangent_laplacian(mesh)
    values, modes = eigh(laplacian.stiffness.toarray(), laplacian.mass.toarray())
    mode, value = modes[:, 1], values[1]
    counts = np.array([4, 8, 16])
    errors = [
        np.abs(
            calculus.solve_heat(laplacian, mode, 0.5, int(n)) - np.exp(-0.5 * value) * mode
        ).max()
        for n in counts
    ]
    assert fitted_order(1 / counts, errors) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("meshes", [spheres, random_spheres])
def test_principal_curvatures_of_the_sphere_are_of_second_order(meshes):
    family = meshes()
    errors = [
        rms(mesh, np.abs(es.geometry.principal_curvatures(mesh).values - 1).max(axis=1))
        for mesh in family
    ]
    assert fitted_order(widths_of(family), errors) > 1.8


def test_principal_curvatures_and_directions_of_the_torus():
    family, errors, turns = tori(), [], []
    for mesh in family:
        x, y, z = mesh.vertices.T
        rho = np.hypot(x, y)
        found = es.geometry.principal_curvatures(mesh)
        exact = np.stack([np.ones_like(rho), (rho - 2) / rho], axis=1)
        errors.append(rms(mesh, np.abs(found.values - exact).max(axis=1)))
        around = np.stack([-y / rho, x / rho, 0 * z], axis=1)
        turns.append(np.abs(np.einsum("ni,ni->n", found.directions[:, 0], around)).max())
    assert fitted_order(widths_of(family), errors) > 1.8
    assert fitted_order(widths_of(family), turns) > 0.9


def test_lengths_of_level_sets_are_of_second_order():
    family = spheres()
    errors = [
        abs(calculus.level_set(mesh, mesh.vertices[:, 2], 0.5).size - 2 * np.pi * 0.75**0.5)
        for mesh in family
    ]
    assert fitted_order(widths_of(family), errors) > 1.7
