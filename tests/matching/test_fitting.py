"""A part bent onto a whole, and views of a whole, on creatures whose poses share their vertices."""

from dataclasses import replace

import numpy as np
import pytest

import eigenshape as es
from eigenshape.matching.fitting import fit_part, plan_fit
from eigenshape.matching.pairs import patch_differences
from eigenshape.matching.surface import UNIT, describe_surface
from eigenshape.matching.views import N_VIEWS, describe_views

N_VERTICES = 600
N_POINTS = 150


@pytest.fixture(scope="module")
def surfaces():
    """Two poses of a creature in one unit, with the same vertices."""
    poses = [es.make_creature("quadruped", pose, n_vertices=N_VERTICES) for pose in (0, 1)]
    unit = UNIT * float(np.sqrt(es.geometry.surface_area(poses[1])))
    return [describe_surface(pose, unit, N_POINTS) for pose in poses]


def test_a_part_that_is_bent_by_the_true_map_comes_to_lie_there(surfaces):
    part, whole = surfaces
    fit = fit_part(plan_fit(part, whole), part.points)
    gaps = whole.mesh.vertices[fit.places] - whole.mesh.vertices
    assert np.linalg.norm(gaps, axis=1).mean() < 0.02
    assert fit.gaps.mean() < 0.02


def test_noise_of_the_map_is_taken_off(surfaces):
    part, whole = surfaces
    rng = np.random.default_rng(0)
    near = np.argsort(whole.distances[whole.nearest[part.points]], axis=1)[:, 1:20]
    rough = near[np.arange(len(near)), rng.integers(0, near.shape[1], len(near))]
    fit = fit_part(plan_fit(part, whole), rough)
    before = whole.mesh.vertices[rough] - whole.mesh.vertices[part.points]
    after = whole.mesh.vertices[fit.places[part.points]] - whole.mesh.vertices[part.points]
    assert np.linalg.norm(after, axis=1).mean() < 0.6 * np.linalg.norm(before, axis=1).mean()


def test_wrong_maps_need_more_bending_and_stay_farther(surfaces):
    part, whole = surfaces
    plan = plan_fit(part, whole)
    right = fit_part(plan, part.points).misfit
    mirror = whole.mesh.vertices * [1, 1, -1]
    apart = np.linalg.norm(mirror[part.points][:, None] - whole.mesh.vertices, axis=2)
    mirrored = fit_part(plan, apart.argmin(axis=1)).misfit
    mixed = fit_part(plan, np.random.default_rng(1).permutation(part.points)).misfit
    assert 0 <= right < 0.7 * mirrored
    assert mirrored < mixed


def test_the_fit_does_not_depend_on_how_the_part_lies_in_space(surfaces):
    part, whole = surfaces
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    mesh = es.TriangleMesh(part.mesh.vertices @ turn.T + 0.3, part.mesh.faces)
    turned = replace(part, mesh=mesh, normals=part.normals @ turn.T)
    one, two = (fit_part(plan_fit(side, whole), part.points) for side in (part, turned))
    assert np.isclose(one.misfit, two.misfit, rtol=1e-6)
    assert (one.places == two.places).mean() > 0.99


def test_a_part_of_four_points_has_a_fit():
    grid = describe_surface(es.shapes.grid(1, 1), 1.2, 300)
    fit = fit_part(plan_fit(grid, grid), grid.points)
    assert fit.places.tolist() == [0, 1, 2, 3]
    assert fit.misfit < 1e-6


def test_views_show_points_of_the_whole_and_an_open_mesh_has_none(surfaces):
    whole = surfaces[1]
    views = describe_views(whole.mesh, whole.points)
    assert len(views) == N_VIEWS
    for view in views:
        assert 0 < len(view.points) < N_POINTS
        assert view.numbers.shape[:2] == view.weights.shape
        assert view.weights.min() < 1  # a view has a rim
    assert describe_views(es.shapes.grid(3, 3), np.arange(4)) == ()


def test_only_parts_with_a_rim_are_compared_with_views(surfaces):
    closed, whole = surfaces
    seen = replace(whole, views=describe_views(whole.mesh, whole.points))
    alone = patch_differences(closed, whole)
    assert np.array_equal(patch_differences(closed, seen), alone)
    scan = es.partial_scan(closed.mesh, [0, 0, 1]).mesh
    part = describe_surface(scan, 1.0, N_POINTS)
    alone, both = patch_differences(part, whole), patch_differences(part, seen)
    assert (both <= alone).all()
    assert (both < alone).any()
