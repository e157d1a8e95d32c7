"""Weyl's bound on real operators, and the heat times that can be trusted."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import eigenshape as es


def eigenvalues(laplacian):
    return scipy.linalg.eigh(
        laplacian.stiffness.toarray(), laplacian.mass.toarray(), eigvals_only=True
    )


def moved_points(n, delta, seed):
    rng = np.random.default_rng(seed)
    points = es.geometry.sample_surface(es.shapes.torus(24, 12), n, rng=rng).points
    steps = rng.standard_normal(points.shape)
    return points, points + delta * steps / np.linalg.norm(steps, axis=1, keepdims=True)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:A kernel of width")
@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.floats(1e-4, 0.3), st.floats(0.1, 0.5))
def test_no_eigenvalue_moves_further_than_weyl_and_ours_allow(seed, delta, t):
    points, moved = moved_points(120, delta, seed)
    one, two = (es.operators.gaussian_laplacian(each, t, 2, cutoff=6) for each in (points, moved))
    change = np.abs(eigenvalues(one) - eigenvalues(two)).max()
    bound = es.stability.weyl_bound(one, two)
    assert change <= bound.norm * (1 + 1e-5) <= bound.proven * (1 + 2e-5)
    assert bound.proven <= es.stability.theorem_rate("lipschitz", 2).at(delta, t) * (1 + 1e-9)


@pytest.mark.long
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_dense_samples_move_by_no_more_than_their_integrals(dim):
    """Points of a flat torus of volume 1 (a grid in R^2m) that all move outward and inward by turns."""
    n, t = {1: 4000, 2: 60, 3: 14}[dim], {1: 2e-4, 2: 4e-3, 3: 2e-2}[dim]
    angles = np.stack(np.meshgrid(*[2 * np.pi * np.arange(n) / n] * dim, indexing="ij")).reshape(
        dim, -1
    )
    points = np.concatenate([np.cos(angles), np.sin(angles)]).T / (2 * np.pi)
    delta = 0.02 * t**0.5
    steps = np.random.default_rng(0).standard_normal(points.shape)
    steps *= delta / np.linalg.norm(steps, axis=1, keepdims=True)
    one, two = (es.operators.gaussian_laplacian(each, t, dim) for each in (points, points + steps))
    law = es.stability.theorem_rate("dense", dim)
    assert (
        es.stability.weyl_bound(one, two).proven
        <= 1.02 * law.at(delta, t)
        < es.stability.theorem_rate("lipschitz", dim).at(delta, t)
    )


def test_the_norm_is_that_of_the_dense_difference():
    points, moved = moved_points(200, 0.05, 1)
    one, two = (es.operators.gaussian_laplacian(each, 0.1, 2) for each in (points, moved))
    dense = 200 * (one.stiffness - two.stiffness).toarray()  # the mass is 1/n
    assert es.stability.weyl_bound(one, two).norm == pytest.approx(
        np.linalg.norm(dense, 2), rel=1e-5
    )
    assert es.stability.weyl_bound(one, two).proven == pytest.approx(np.linalg.norm(dense, np.inf))


def test_masses_of_their_own_are_counted_in():
    mesh = es.shapes.torus(16, 8)
    stretched = es.TriangleMesh(mesh.vertices * [1, 1, 1.3], mesh.faces)
    one, two = es.cotangent_laplacian(mesh), es.cotangent_laplacian(stretched)
    change = np.abs(eigenvalues(one) - eigenvalues(two)).max()
    assert 0 < change <= es.stability.weyl_bound(one, two).norm * (1 + 1e-5)


def test_points_renumbered_are_the_same_points():
    points, _ = moved_points(100, 0.1, 2)
    order = np.random.default_rng(3).permutation(100)
    one, two = (
        es.operators.gaussian_laplacian(points, 0.1, 2),
        es.operators.gaussian_laplacian(points[order], 0.1, 2),
    )
    back = np.argsort(order)
    assert (
        es.stability.weyl_bound(one, two, back).proven
        <= 1e-12 * es.stability.weyl_bound(one, two).proven
    )
    same = es.stability.weyl_bound(one, one)
    assert (same.norm, same.proven) == (0.0, 0.0)


def test_a_bound_follows_the_unit():
    points, moved = moved_points(100, 0.1, 4)
    one, two = (es.operators.gaussian_laplacian(each, 0.1, 2) for each in (points, moved))
    small = [es.operators.gaussian_laplacian(each * 1e-30, 0.1e-60, 2) for each in (points, moved)]
    # Eigenvalues of a graph Laplacian are in 1/length⁴ on a surface: its weights have no unit.
    assert es.stability.weyl_bound(*small).norm == pytest.approx(
        1e120 * es.stability.weyl_bound(one, two).norm, rel=1e-5
    )


def test_heat_times_are_trusted_between_the_change_and_the_last_eigenvalue():
    times = es.stability.admissible_times(delta=0.1, spacing=0.01, eigenvalue=20.0)
    assert (times.low, times.high, times.low_reason, times.empty) == (
        pytest.approx(0.01),
        0.025,
        "closeness",
        False,
    )
    assert "from 0.01" in times.explain()
    times = es.stability.admissible_times(delta=0.0, spacing=0.1, eigenvalue=20.0, corrected=True)
    assert (times.low, times.high, times.low_reason) == (
        pytest.approx(0.1**2),
        pytest.approx(0.145),
        "spacing",
    )
    none = es.stability.admissible_times(delta=0.5, spacing=0.1, eigenvalue=20.0)
    assert none.empty
    assert "No heat time is reliable" in none.explain()


def test_bad_input_is_named(monkeypatch):
    points, moved = moved_points(100, 0.1, 5)
    one, two = (es.operators.gaussian_laplacian(each, 0.1, 2) for each in (points, moved))
    fewer = es.operators.gaussian_laplacian(points[:90], 0.1, 2)
    with pytest.raises(es.InvalidParameterError, match="they have 100 and 90"):
        es.stability.weyl_bound(one, fewer)
    with pytest.raises(es.InvalidParameterError, match="name each point once; there are 3 of 100"):
        es.stability.weyl_bound(one, two, [0, 1, 2])
    twice = np.arange(100)
    twice[7] = 8
    with pytest.raises(es.InvalidParameterError, match="name each point once; point 8 has 2"):
        es.stability.weyl_bound(one, two, twice)
    corrected = es.operators.gaussian_laplacian(moved, 0.1, 2, correct="log", form="random-walk")
    with pytest.raises(es.InvalidParameterError, match="two must be given by its matrices alone"):
        es.stability.weyl_bound(one, corrected)
    mesh = es.shapes.torus(16, 8)
    full = es.cotangent_laplacian(mesh, mass="consistent")
    with pytest.raises(es.InvalidParameterError, match="diagonal mass; that of one is not"):
        es.stability.weyl_bound(full, es.cotangent_laplacian(mesh))
    with pytest.raises(es.InvalidParameterError, match="spacing and eigenvalue"):
        es.stability.admissible_times(delta=0.1, spacing=0.0, eigenvalue=1.0)
    with pytest.raises(es.InvalidParameterError, match="delta must be positive"):
        es.stability.admissible_times(delta=-0.1, spacing=0.1, eigenvalue=1.0)
    monkeypatch.setattr("eigenshape.stability.bounds.MOST_STEPS", 1)
    monkeypatch.setattr("eigenshape.stability.bounds.TOLERANCE", 0.0)
    n = 2000
    path = sp.diags_array(
        [np.r_[1, 2 * np.ones(n - 2), 1], -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1]
    )
    line = es.Laplacian(path.tocsr(), sp.eye_array(n).tocsr())
    half = es.Laplacian((path / 2).tocsr(), sp.eye_array(n).tocsr())
    with pytest.raises(es.ConvergenceError, match="it was not found in 1 steps"):
        es.stability.weyl_bound(line, half)
