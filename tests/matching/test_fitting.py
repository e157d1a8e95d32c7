"""A part bent onto a whole, and views of a whole, on creatures whose poses share their vertices."""

from dataclasses import replace

import numpy as np
import pytest
from matched_poses import N_POINTS, N_VERTICES, describe_poses

import eigenshape as es
from eigenshape.matching import growth
from eigenshape.matching.evidence import FittedMap
from eigenshape.matching.fitting import fit_part, plan_fit, plan_rough_fit, slide_part
from eigenshape.matching.growth import (
    EQUALLY_GOOD,
    MOST_OF_AREA,
    MUCH_WORSE,
    N_FIRST_GROWN,
    N_GROWN_AGAIN,
    _is_clear,
    find_maps,
    fitted_maps,
    grow_maps,
)
from eigenshape.matching.pairs import patch_differences
from eigenshape.matching.spectral_refinement import lowest_modes, modes_of_part, smooth_places
from eigenshape.matching.surface import describe_surface
from eigenshape.matching.target import N_VIEWS, describe_views
from eigenshape.matching.turns import OTHER_PLACE, is_rigid


@pytest.fixture(scope="module")
def surfaces():
    """Two poses of a creature in one unit, with the same vertices."""
    return describe_poses()


def test_a_misfit_is_a_mean_over_the_area_that_is_compared(surfaces):
    part, whole = surfaces
    for plan in (plan_fit(part, whole), plan_rough_fit(part, whole)):
        assert plan.shares.sum() == pytest.approx(1)
        assert plan.pull.sum() == pytest.approx(1)
        gaps = fit_part(plan, plan.frames).gaps
        assert len(gaps) == len(plan.compared) == len(plan.shares)


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
    part = describe_surface(es.operators.denoise(scan), 1.0, N_POINTS)
    alone, both = patch_differences(part, whole), patch_differences(part, seen)
    assert (both <= alone).all()
    assert (both < alone).any()


def test_low_modes_make_a_map_smooth(surfaces):
    part, whole = surfaces
    modes = lowest_modes(whole.mesh)
    ours = modes_of_part(part.mesh, modes)
    rng = np.random.default_rng(3)
    wrong = rng.random(part.mesh.n_vertices) < 0.2
    rough = np.where(wrong, rng.integers(0, N_VERTICES, N_VERTICES), np.arange(N_VERTICES))
    places, smooth = smooth_places(ours, modes, rough, 20, np.arange(N_VERTICES))
    assert smooth.shape == (N_VERTICES, 20)
    # The poses share their vertices.
    before = np.linalg.norm(whole.mesh.vertices[rough] - whole.mesh.vertices, axis=1)
    after = np.linalg.norm(whole.mesh.vertices[places] - whole.mesh.vertices, axis=1)
    assert after.mean() < 0.7 * before.mean()


@pytest.fixture(scope="module")
def grown(surfaces):
    """A plan to bend what one viewpoint sees of a pose onto the other, differences, and maps."""
    pose, whole = surfaces
    scan = es.partial_scan(pose.mesh, [0.3, 0.2, 1])
    part = describe_surface(es.operators.denoise(scan.mesh), 1.0, N_POINTS)
    plan, differences = plan_fit(part, whole), patch_differences(part, whole)
    return plan, differences, grow_maps(plan, differences)


@pytest.mark.long
def test_more_starts_fit_no_worse_and_are_sorted(grown):
    plan, differences, more = grown
    maps = fitted_maps(plan, differences)
    misfits = [one.fit.misfit for one in more]
    assert len(more) > len(maps)
    assert misfits == sorted(misfits)
    assert misfits[0] <= maps[0].fit.misfit


def test_a_search_ends_early_if_no_rough_bend_fits_well(grown):
    plan, differences, _ = grown
    assert grow_maps(plan, differences, wanted=0.0) == []


@pytest.mark.long
def test_a_search_in_a_coarse_part_ends_early_if_no_first_map_fits_well(surfaces):
    """All vertices are points: there rough bends say nothing."""
    pose, whole = surfaces
    scan = es.partial_scan(pose.mesh, [0.3, 0.2, 1])
    part = describe_surface(es.operators.denoise(scan.mesh), 1.0, scan.mesh.n_vertices)
    plan, differences = plan_fit(part, whole), patch_differences(part, whole)
    every = grow_maps(plan, differences)
    few = grow_maps(plan, differences, wanted=0.0)
    assert 0 < len(few) <= N_FIRST_GROWN < len(every)
    misfits = [one.fit.misfit for one in few]
    assert misfits == sorted(misfits)
    assert set(misfits) <= {one.fit.misfit for one in every}


def test_a_search_ends_early_if_the_first_maps_are_the_known_one(surfaces):
    plan, differences = plan_fit(*surfaces), patch_differences(*surfaces)
    every = grow_maps(plan, differences, wanted=1.0)
    few = grow_maps(plan, differences, wanted=1.0, known=every[0])
    assert 0 < len(few) <= N_FIRST_GROWN < len(every)
    misfits = [one.fit.misfit for one in few]
    assert misfits == sorted(misfits)
    assert set(misfits) <= {one.fit.misfit for one in every}


def test_other_starts_are_left_out_where_the_first_maps_agree(surfaces, monkeypatch):
    plan, differences = plan_fit(*surfaces), patch_differences(*surfaces)
    asked = []
    monkeypatch.setattr(growth, "grow_starts", lambda *given: asked.append(given) or [])
    maps = grow_maps(plan, differences)
    assert not asked
    assert N_FIRST_GROWN < len(maps) <= N_FIRST_GROWN + N_GROWN_AGAIN
    ends = plan.whole.mesh.vertices[[one.fit.places for one in maps]]
    apart = np.linalg.norm(ends - ends[0], axis=2) > OTHER_PLACE
    assert (apart @ plan.shares < MOST_OF_AREA).all()
    # A search for other maps than a known one goes on.
    grow_maps(plan, differences, known=_elsewhere(maps[0]))
    assert asked


def test_evidence_is_clear_unless_a_map_elsewhere_fits_nearly_as_well(surfaces):
    plan, differences = plan_fit(*surfaces), patch_differences(*surfaces)
    best = grow_maps(plan, differences)[0]
    least = max(MUCH_WORSE * best.fit.misfit, EQUALLY_GOOD)
    nearly, worse = (_elsewhere(best, share * least) for share in (0.9, 1.1))
    assert _is_clear(plan, [best])
    assert _is_clear(plan, [best, replace(best), worse])
    assert not _is_clear(plan, [best, nearly])
    assert not _is_clear(plan, [])


def _elsewhere(one, misfit=0.0):
    places = np.random.default_rng(0).permutation(one.fit.places)
    return FittedMap(one.pairs, replace(one.fit, places=places, misfit=misfit))


@pytest.mark.long
def test_the_best_map_is_smoothed_and_slides(grown):
    plan, differences, maps = grown
    modes = lowest_modes(plan.whole.mesh)
    ours = modes_of_part(plan.part.mesh, modes)
    found, turn = find_maps(plan, differences, ours, modes)
    assert turn is not None
    assert not is_rigid(plan, turn)
    assert len(found) == len(maps)
    assert found[0].fit.misfit <= maps[0].fit.misfit
    assert not np.array_equal(found[0].fit.places, maps[0].fit.places)


def test_a_part_slides_back_from_a_shifted_map(surfaces):
    part, whole = surfaces
    shifted = whole.mesh.vertices[part.points] + [0.04, 0, 0]
    apart = np.linalg.norm(shifted[:, None] - whole.mesh.vertices, axis=2)
    plan = plan_fit(part, whole)
    stuck = fit_part(plan, apart.argmin(axis=1))
    slid = slide_part(plan, stuck)
    errors = [
        np.linalg.norm(whole.mesh.vertices[fit.places] - whole.mesh.vertices, axis=1).mean()
        for fit in (stuck, slid)
    ]
    assert errors[1] < 0.8 * errors[0]
    assert slid.misfit == stuck.misfit


def test_a_rough_fit_places_the_points_of_the_part(surfaces):
    part, whole = surfaces
    plan = plan_rough_fit(part, whole)
    fit = fit_part(plan, part.points[: len(plan.frames)])
    assert len(fit.places) == len(part.points)
    # The poses share their vertices.
    gaps = whole.mesh.vertices[fit.places] - whole.mesh.vertices[part.points]
    assert np.linalg.norm(gaps, axis=1).mean() < 0.03
    some = fit.select(np.arange(3))
    assert np.array_equal(some.places, fit.places[:3])
    assert np.array_equal(some.gaps, fit.gaps[:3])
