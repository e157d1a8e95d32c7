"""Approximate heat beside that of certified spectra, and the error that it states beside the true one."""

from dataclasses import replace

import numpy as np
import pytest

import eigenshape as es
from eigenshape.spectral.signatures import approximate_heat

TIMES = np.array([1e-3, 4e-3, 2e-2, 0.1])


def exact(laplacian, k, times):
    return es.heat_kernel_signature(es.solve_spectrum(laplacian, k), times)


def true_errors(laplacian, found, values):
    mass = laplacian.mass.diagonal()
    return np.sqrt(mass @ (found.values - values) ** 2 / (mass @ values**2))


def creature(n_vertices=5000, kind="quadruped"):
    mesh = es.geometry.normalize_mesh(es.make_creature(kind, 1, n_vertices=n_vertices), "box")
    return mesh, es.cotangent_laplacian(mesh)


def poor_torus():
    """Vertices pushed about until triangles are poor, and masses far apart."""
    mesh = es.shapes.torus(120, 50)
    rng = np.random.default_rng(3)
    edge = np.linalg.norm(np.diff(mesh.vertices[mesh.faces[:, :2]], axis=1), axis=2).mean()
    return es.cotangent_laplacian(
        es.TriangleMesh(
            mesh.vertices + 0.2 * edge * rng.normal(size=mesh.vertices.shape), mesh.faces
        )
    )


@pytest.mark.long
@pytest.mark.parametrize("kind", ["quadruped", "octopus", "chair"])
def test_heat_of_creatures_is_within_a_hundredth_and_the_stated_error_says_so(kind):
    _, laplacian = creature(kind=kind)
    times = TIMES * laplacian.mass.sum()
    found = es.spectral.approximate_heat_signature(laplacian, 30, times)
    off = true_errors(laplacian, found, exact(laplacian, 30, times))
    assert not found.complete
    assert off.max() < 0.01
    assert (off <= 1.5 * found.errors).all()
    assert (found.errors <= 30 * off + 1e-4).all()


def test_heat_on_poor_triangles():
    laplacian = poor_torus()
    times = TIMES * laplacian.mass.sum()
    found = es.spectral.approximate_heat_signature(laplacian, 30, times)
    off = true_errors(laplacian, found, exact(laplacian, 30, times))
    assert off.max() < 0.01
    assert (off <= 1.5 * found.errors).all()


@pytest.mark.long
def test_the_error_falls_with_the_accuracy():
    _, laplacian = creature()
    times = TIMES * laplacian.mass.sum()
    values = exact(laplacian, 30, times)
    runs = [
        es.spectral.approximate_heat_signature(laplacian, 30, times, accuracy=most)
        for most in (1e-1, 1e-4)
    ]
    true = [true_errors(laplacian, run, values)[0] for run in runs]
    assert true[0] > 5 * true[1]
    assert runs[0].errors[0] > 5 * runs[1].errors[0]
    assert true[1] < 1e-3


@pytest.mark.long
def test_pairs_that_are_good_enough_are_not_refined(monkeypatch):
    def refuse(*_):
        raise AssertionError("refined")

    _, laplacian = creature()
    times = TIMES * laplacian.mass.sum()
    monkeypatch.setattr(approximate_heat, "refine", refuse)
    found = es.spectral.approximate_heat_signature(laplacian, 12, times, accuracy=0.05)
    assert not found.complete
    off = true_errors(laplacian, found, exact(laplacian, 12, times))
    assert off.max() < 0.05
    assert (off <= 1.5 * found.errors).all()
    with pytest.raises(AssertionError, match="refined"):
        es.spectral.approximate_heat_signature(laplacian, 12, times, accuracy=1e-4)


def test_eigenvalues_are_ritz_values():
    _, laplacian = creature()
    found = es.spectral.approximate_heat_signature(laplacian, 20, [0.01]).eigenvalues
    true = es.solve_spectrum(laplacian, 20).eigenvalues
    assert (found[1:] >= true[1:] * (1 - 1e-5)).all()
    assert found[1:] == pytest.approx(true[1:], rel=3e-3)
    assert abs(found[0]) < 1e-6 * true[1]


def test_the_sum_of_heat_is_the_trace():
    _, laplacian = creature()
    found = es.spectral.approximate_heat_signature(laplacian, 20, TIMES)
    trace = np.exp(-np.outer(found.eigenvalues, TIMES)).sum(axis=0)
    assert laplacian.mass.diagonal() @ found.values == pytest.approx(trace, rel=1e-5)


def test_several_components_and_a_loose_piece():
    one, two = creature()[0], es.icosphere(3)
    faces = np.concatenate([one.faces, two.faces + one.n_vertices])
    mesh = es.TriangleMesh(np.concatenate([one.vertices, 0.2 * two.vertices + 3]), faces)
    laplacian = es.cotangent_laplacian(mesh)
    found = es.spectral.approximate_heat_signature(laplacian, 30, TIMES)
    off = true_errors(laplacian, found, exact(laplacian, 30, TIMES))
    assert off.max() < 0.02
    assert (off <= 1.5 * found.errors).all()


def test_with_the_boundary_held():
    mesh = es.scans.cut_by_planes(creature()[0], [[0, 1, 0, 0.5]]).mesh
    inner, _ = es.operators.dirichlet_laplacian(
        es.cotangent_laplacian(mesh), es.geometry.boundary_vertices(mesh)
    )
    found = es.spectral.approximate_heat_signature(inner, 20, TIMES)
    off = true_errors(inner, found, exact(inner, 20, TIMES))
    assert off.max() < 0.02
    assert (off <= 2 * found.errors).all()


def test_graphs_without_geometry():
    laplacian = es.operators.graph_laplacian(
        es.operators.neighbor_graph(es.shapes.fibonacci_sphere(4000).vertices, 8)
    )
    scale = es.solve_spectrum(laplacian, 2).eigenvalues[1]
    times = np.array([0.1, 1.0]) / scale
    found = es.spectral.approximate_heat_signature(laplacian, 20, times)
    assert true_errors(laplacian, found, exact(laplacian, 20, times)).max() < 0.01


@pytest.mark.long
def test_the_same_again():
    _, laplacian = creature(3000)
    one, two = (es.spectral.approximate_heat_signature(laplacian, 10, TIMES) for _ in range(2))
    assert np.array_equal(one.values, two.values)
    assert np.array_equal(one.errors, two.errors)


@pytest.mark.parametrize("scale", [1e-100, 1e-3, 1e100])
def test_units(scale):
    mesh, laplacian = creature(3000)
    small = es.spectral.approximate_heat_signature(laplacian, 10, TIMES)
    scaled = es.cotangent_laplacian(es.TriangleMesh(scale * mesh.vertices, mesh.faces))
    found = es.spectral.approximate_heat_signature(scaled, 10, scale**2 * TIMES)
    assert found.values * scale**2 == pytest.approx(small.values, rel=1e-4)
    assert found.eigenvalues[1:] * scale**2 == pytest.approx(small.eigenvalues[1:], rel=1e-4)
    assert found.errors == pytest.approx(small.errors, rel=0.05)


def test_points_in_another_order_have_the_same_heat_nearly():
    _, laplacian = creature(3000)
    order = np.random.default_rng(0).permutation(laplacian.n_points)
    moved = es.Laplacian(laplacian.stiffness[order][:, order], laplacian.mass[order][:, order])
    one = es.spectral.approximate_heat_signature(laplacian, 10, TIMES)
    two = es.spectral.approximate_heat_signature(moved, 10, TIMES)
    assert np.abs(two.values - one.values[order]).max(axis=0) == pytest.approx(
        0, abs=0.03 * one.values.max()
    )


def test_few_points_are_solved_as_they_are():
    laplacian = es.cotangent_laplacian(es.icosphere(2))
    found = es.spectral.approximate_heat_signature(laplacian, 10, TIMES)
    assert found.complete
    assert found.values == pytest.approx(exact(laplacian, 10, TIMES))


def test_progress_runs_from_0_to_1():
    said = []
    _, laplacian = creature(3000)
    es.spectral.approximate_heat_signature(
        laplacian, 10, TIMES, progress=lambda *what: said.append(what)
    )
    shares = [share for share, _ in said]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_what_is_refused():
    _, laplacian = creature(3000)
    with pytest.raises(es.InvalidParameterError, match=r"k must lie in 1\.\.3000; it is 0"):
        es.spectral.approximate_heat_signature(laplacian, 0, TIMES)
    with pytest.raises(es.InvalidParameterError, match="times must be positive"):
        es.spectral.approximate_heat_signature(laplacian, 10, [0.0])
    with pytest.raises(
        es.InvalidParameterError, match=r"accuracy must lie in 0\.0001\.\.0\.1; it is 1e-05"
    ):
        es.spectral.approximate_heat_signature(laplacian, 10, TIMES, accuracy=1e-5)
    full = replace(laplacian, mass=es.cotangent_laplacian(creature(3000)[0], "consistent").mass)
    with pytest.raises(
        es.InvalidParameterError, match="mass must be diagonal for approximate eigenpairs"
    ):
        es.spectral.approximate_heat_signature(full, 10, TIMES)


@pytest.mark.data
@pytest.mark.long
@pytest.mark.sweep
@pytest.mark.parametrize("name", ["dragon", "armadillo"])
def test_scans(data, name):
    path = next((data / "classics").glob(f"{name}.*"))
    mesh = es.geometry.normalize_mesh(es.read_mesh(path), "box")
    laplacian = es.cotangent_laplacian(mesh)
    times = es.retrieval.THESIS.time_unit * np.array(es.retrieval.THESIS.scales)
    found = es.spectral.approximate_heat_signature(laplacian, 300, times)
    off = true_errors(laplacian, found, exact(laplacian, 300, times))
    assert not found.complete
    assert off.max() < 0.01
    assert (off <= 1.5 * found.errors).all()
