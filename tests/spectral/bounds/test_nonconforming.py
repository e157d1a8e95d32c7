from itertools import pairwise

import numpy as np
import pytest
from intervals import assert_around

from certeig.kit.errors import ConvergenceError
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.crouzeix_raviart import crouzeix_raviart_laplacian
from eigenshape.shapes import exact
from eigenshape.shapes.domains import irregular_grid
from eigenshape.shapes.surfaces import grid
from eigenshape.spectral.bounds.brackets import bracket_eigenvalues
from eigenshape.spectral.bounds.nonconforming import lower_bounds
from eigenshape.spectral.solve import solve_spectrum


@pytest.mark.parametrize("seed", range(8))
def test_on_coarse_triangles_the_elements_alone_are_no_bound(seed):
    mesh = irregular_grid(4, 4, jitter=0.45, rng=np.random.default_rng(seed))
    table, free = facet_table(mesh), np.empty(0, dtype=np.int64)
    known = exact.box_eigenvalues(len(table.facets))
    assert (lower_bounds(mesh, table, len(known), free, None) <= known).all()
    alone = solve_spectrum(crouzeix_raviart_laplacian(mesh), len(known)).eigenvalues
    assert (alone > 1.2 * known).any()


def graded(n):
    """Return the unit square with columns that grow by 15 % each."""
    mesh = grid(n, n)
    places = np.r_[0, np.cumsum(1.15 ** np.arange(n))]
    points = mesh.vertices.copy()
    points[:, 0] = (places / places[-1])[np.round(points[:, 0] * n).astype(int)]
    return TriangleMesh(points, mesh.faces)


@pytest.mark.parametrize("condition", ["neumann", "dirichlet"])
def test_uneven_edges_are_bracketed_and_the_weights_pay(condition, monkeypatch):
    mesh, known = graded(24), exact.box_eigenvalues(20, (1, 1), condition)
    found = bracket_eigenvalues(mesh, 20, boundary=condition)
    assert_around(found, known)
    monkeypatch.setattr("eigenshape.spectral.bounds.nonconforming.EVEN_CONSTANTS", np.inf)
    unweighed = bracket_eigenvalues(mesh, 20, boundary=condition)
    assert_around(unweighed, known)
    assert (unweighed.lower <= found.lower).all()
    np.testing.assert_array_equal(unweighed.upper, found.upper)
    gaps = [1 - ends.lower[ends.n_zero :] / known[ends.n_zero :] for ends in (found, unweighed)]
    assert np.median(gaps[0]) < 0.75 * np.median(gaps[1])


def test_a_weight_that_cannot_be_solved_is_left_out(monkeypatch):
    mesh, solves = graded(12), []

    def solve_once(laplacian, k, *, fixed, progress):
        solves.append(k)
        if len(solves) > 1:
            raise ConvergenceError(
                "Every eigenvalue that inertia counts must be found; some are not."
            )
        return solve_spectrum(laplacian, k)

    monkeypatch.setattr("eigenshape.spectral.bounds.nonconforming.solve_spectrum", solve_once)
    found = bracket_eigenvalues(mesh, 10)
    assert len(solves) > 2
    assert solves == sorted(solves, reverse=True)
    monkeypatch.undo()
    monkeypatch.setattr("eigenshape.spectral.bounds.nonconforming.EVEN_CONSTANTS", np.inf)
    np.testing.assert_array_equal(found.lower, bracket_eigenvalues(mesh, 10).lower)


def test_one_long_edge_spoils_little():
    # A square cut in fine triangles but for one coarse corner.
    fine = grid(24, 24)
    middles = fine.vertices[fine.faces].mean(axis=1)
    corner = (middles[:, :2] > 2 / 3).all(axis=1)
    rim = np.array(
        [[2 / 3, y] for y in np.linspace(2 / 3, 1, 9)]
        + [[x, 2 / 3] for x in np.linspace(2 / 3, 1, 9)[1:]]
    )
    points = np.concatenate([fine.vertices, [[1, 1, 0]]])
    places = {
        tuple(np.round(point[:2] * 24).astype(int)): name
        for name, point in enumerate(fine.vertices)
    }
    names = [places[tuple(np.round(point * 24).astype(int))] for point in rim]
    chain = [*names[8::-1], *names[9:]]  # down the left side, then along the bottom
    apex = len(fine.vertices)
    patch = [[a, b, apex] for a, b in pairwise(chain)]
    used, faces = np.unique(np.concatenate([fine.faces[~corner], patch]), return_inverse=True)
    mesh = TriangleMesh(points[used], faces.reshape(-1, 3))
    known = exact.box_eigenvalues(40)
    found = bracket_eigenvalues(mesh, 40)
    assert_around(found, known)
    unweighed = 1 / (1 + found.constant**2 * known[1:])
    assert (found.lower[1:] / known[1:] > unweighed).mean() > 0.9


def test_progress_runs_from_0_to_1():
    shares = []
    bracket_eigenvalues(graded(12), 10, progress=lambda share, message: shares.append(share))
    assert shares[0] == 0
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1)
