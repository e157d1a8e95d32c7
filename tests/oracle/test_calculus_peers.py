"""Derivatives and equations beside LaPy, libigl and potpourri3d, which discretize as we do."""

import igl
import lapy
import numpy as np
import pytest
import scipy.sparse as sp
from lapy import diffgeo
from lapy.heat import diffusion
from scipy.sparse import csc_matrix

import eigenshape as es
from eigenshape import calculus

TORUS = es.shapes.torus(20, 12)
BIPED = es.make_creature("biped", n_vertices=800)
SQUARE = es.shapes.grid(9, 7)
BOX = es.shapes.box(3, 4, 3)


def lapy_mesh(mesh):
    if mesh.dim == 2:
        return lapy.TriaMesh(mesh.points.copy(), mesh.simplices.copy())
    solid = lapy.TetMesh(mesh.points.copy(), mesh.simplices.copy())
    solid.orient_()
    # Its gradients depend on the order of corners: after its own `orient_` they point down the
    # slope, with two corners swapped they point up. Ours do not depend on it.
    return lapy.TetMesh(solid.v, solid.t[:, [0, 1, 3, 2]])


def lapy_solver(mesh):
    return lapy.Solver(lapy_mesh(mesh), lump=True)


@pytest.mark.parametrize("mesh", [TORUS, BIPED, BOX], ids=["torus", "biped", "box"])
def test_gradient_and_divergence_are_those_of_lapy(mesh):
    values = np.random.default_rng(0).standard_normal(mesh.n_points)
    slopes = calculus.gradient(mesh, values)
    size = np.abs(slopes).max()
    theirs = diffgeo.compute_gradient(lapy_mesh(mesh), values)
    np.testing.assert_allclose(slopes, theirs, atol=1e-12 * size)
    ours = calculus.divergence(mesh, slopes)
    theirs = diffgeo.compute_divergence(lapy_mesh(mesh), slopes)
    np.testing.assert_allclose(ours, theirs, atol=1e-12 * np.abs(ours).max())


@pytest.mark.parametrize("mesh", [TORUS, BIPED, BOX], ids=["torus", "biped", "box"])
def test_the_gradient_matrix_is_that_of_libigl(mesh):
    theirs = igl.grad(mesh.points, mesh.simplices)
    s = len(mesh.simplices)
    by_simplex = np.arange(3 * s).reshape(3, s).T.ravel()  # theirs are ordered by axis
    ours = calculus.gradient(mesh)
    assert abs(ours - theirs[by_simplex]).max() < 1e-12 * abs(ours).max()


@pytest.mark.parametrize("mesh", [SQUARE, BOX], ids=["square", "box"])
def test_poisson_with_dirichlet_values_is_that_of_lapy(mesh):
    rim = es.geometry.boundary_vertices(mesh)
    source = np.random.default_rng(1).standard_normal((mesh.n_points, 3))
    values = np.random.default_rng(2).standard_normal(len(rim))
    theirs = lapy_solver(mesh).poisson(source, dtup=(rim, values))
    laplacian = es.cotangent_laplacian(mesh, mass="lumped")
    ours = calculus.solve_poisson(laplacian, source, fixed=rim, values=values[:, None])
    np.testing.assert_allclose(ours, theirs, atol=1e-12 * np.abs(theirs).max())


def test_poisson_with_a_flux_is_that_of_lapy():
    # LaPy subtracts the flux from the source and integrates both with the mass of the surface.
    rim = es.geometry.boundary_vertices(SQUARE)
    flux = np.random.default_rng(3).standard_normal(len(rim))
    laplacian = es.cotangent_laplacian(SQUARE)
    theirs = lapy_solver(SQUARE).poisson(1.0, dtup=([0], [2.0]), ntup=(rim[3:], flux[3:]))
    source = np.ones(SQUARE.n_vertices)
    source[rim[3:]] -= flux[3:]
    ours = calculus.solve_poisson(laplacian, source, fixed=[0], values=[2.0])
    np.testing.assert_allclose(ours, theirs, atol=1e-11 * np.abs(theirs).max())


@pytest.mark.parametrize("mesh", [BIPED, BOX], ids=["biped", "box"])
def test_a_heat_step_is_that_of_lapy(mesh):
    theirs = diffusion(lapy_mesh(mesh), [0, 5], m=2.0)
    start = np.zeros(mesh.n_points)
    start[[0, 5]] = 1.0
    laplacian = es.cotangent_laplacian(mesh, mass="lumped")
    t = 2.0 * lapy_mesh(mesh).avg_edge_length() ** 2
    # LaPy starts from a load of 1 at the sources, not from a value of 1.
    ours = calculus.factor_equations(laplacian.mass + t * laplacian.stiffness).solve(start)
    np.testing.assert_allclose(ours, theirs, atol=1e-12 * np.abs(theirs).max())


@pytest.mark.parametrize("order", [1, 2])
def test_harmonic_functions_are_those_of_libigl(order):
    fixed = np.array([0, 50, 120])
    values = np.array([[0.0], [1.0], [-0.5]])
    theirs = igl.harmonic(TORUS.vertices, TORUS.faces, fixed, values, order)
    mass = igl.massmatrix(TORUS.vertices, TORUS.faces, igl.MASSMATRIX_TYPE_DEFAULT)
    stiffness = -igl.cotmatrix(TORUS.vertices, TORUS.faces)
    mixed = es.Laplacian(sp.csr_array(stiffness), sp.csr_array(mass))
    ours = calculus.solve_harmonic(mixed, fixed, values, order=order)
    np.testing.assert_allclose(ours, theirs, atol=1e-8)


def test_quadratic_problems_are_those_of_libigl():
    laplacian = es.cotangent_laplacian(SQUARE)
    rng = np.random.default_rng(4)
    fixed, values = np.array([0, 11, 33]), rng.standard_normal((3, 1))
    linear, d = rng.standard_normal((80, 1)), rng.standard_normal((2, 1))
    C = rng.standard_normal((2, 80))
    theirs = igl.min_quad_with_fixed(
        csc_matrix(laplacian.stiffness), -linear, fixed, values, csc_matrix(C), d, False
    )
    solver = calculus.factor_equations(laplacian.stiffness, fixed, C)
    ours = solver.solve(linear, values=values, targets=d)
    np.testing.assert_allclose(ours, np.reshape(theirs, (80, 1)), atol=1e-10)


def test_level_sets_have_the_length_of_libigl():
    values = TORUS.vertices @ [0.3, 1.0, 0.2]
    points, edges, _ = igl.isolines(TORUS.vertices, TORUS.faces, values, np.array([0.117]))
    theirs = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1).sum()
    assert calculus.level_set(TORUS, values, 0.117).size == pytest.approx(theirs, rel=1e-12)


def test_the_conformal_map_has_less_energy_than_pinned_ones():
    upper = BIPED.faces[(BIPED.vertices[BIPED.faces, 2] > np.median(BIPED.vertices[:, 2])).all(1)]
    repaired = es.repair(es.TriangleMesh(BIPED.vertices, upper), ["drop_unreferenced"]).mesh
    part = es.repair(repaired, ["largest_component"]).mesh
    rim = es.geometry.boundary_loops(part)[0]
    pins = np.array([rim[0], rim[len(rim) // 2]])
    theirs = igl.lscm(part.vertices, part.faces, pins, np.array([[0.0, 0.0], [1.0, 0.0]]))
    theirs = theirs[0] if isinstance(theirs, tuple) else theirs
    on_rim = np.zeros(part.n_vertices)
    on_rim[es.geometry.boundary_vertices(part)] = 1.0

    def energy(plane):
        z = plane[:, 0] + 1j * plane[:, 1]
        z = z - (on_rim @ z) / on_rim.sum()
        W = es.cotangent_laplacian(part).stiffness
        edges = es.geometry.boundary_edges(part)
        area = np.imag(np.conj(z[edges[:, 0]]) * z[edges[:, 1]]).sum() / 2
        return (0.5 * np.real(np.vdot(z, W @ z)) - area) / (on_rim @ np.abs(z) ** 2)

    assert energy(calculus.flatten_conformally(part)) <= energy(theirs) * (1 + 1e-9)


def test_curvatures_of_a_torus_have_a_quarter_of_the_error_of_libigl():
    mesh = es.shapes.torus(60, 30, outer=2.0, inner=1.0)
    _, _, largest, least, *_ = igl.principal_curvature(mesh.vertices, mesh.faces)
    theirs = np.sort(np.stack([largest, least], axis=1), axis=1)[:, ::-1]
    theirs = theirs if theirs.sum() > 0 else -theirs[:, ::-1]
    ours = es.geometry.principal_curvatures(mesh).values
    rho = np.hypot(*mesh.vertices[:, :2].T)
    exact = np.stack([np.ones_like(rho), (rho - 2) / rho], axis=1)
    assert np.abs(ours - exact).max() < np.abs(theirs - exact).max() / 4


def test_signed_distances_and_winding_numbers_are_those_of_libigl():
    points = np.random.default_rng(4).uniform(-1, 1, (300, 3))
    low, high = BIPED.vertices.min(axis=0), BIPED.vertices.max(axis=0)
    points = (low + high) / 2 + points * (high - low) * 0.6
    arrays = np.array(BIPED.vertices), np.array(BIPED.faces)
    kind = igl.SignedDistanceType.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    distances, _, nearest, _ = igl.signed_distance(points, *arrays, kind)
    ours = es.geometry.signed_distance(BIPED, points)
    assert 0 < np.count_nonzero(ours < 0) < 300
    np.testing.assert_allclose(ours, distances, atol=1e-12)
    np.testing.assert_allclose(
        es.geometry.closest_points(BIPED, points).points, nearest, atol=1e-12
    )
    np.testing.assert_allclose(
        es.geometry.winding_numbers(BIPED, points), igl.winding_number(*arrays, points), atol=1e-12
    )
