"""One surface bent onto another, by place or by intrinsic evidence."""

import numpy as np
import pytest
from specimens import half, make_specimen, mirror, move

import eigenshape as es
from eigenshape.collections import surface_fit


@pytest.mark.long
def test_a_specimen_is_bent_onto_another_in_place():
    source, truth = make_specimen(0), make_specimen(1)
    fit = es.collections.fit_surface(source, move(truth, 10.0))
    away = np.linalg.norm(fit.vertices - move(truth, 10.0).vertices, axis=1)
    assert np.median(away) < 0.05 * 10
    assert np.median(fit.gaps) < 0.005 * 10
    assert np.median(fit.confidence) > 0.9
    assert (fit.method, fit.side) == ("position", "same")
    assert fit.missing == fit.excess == 0


@pytest.mark.long
def test_more_points_in_the_last_level_bring_a_surface_nearer():
    source, truth = make_specimen(0), make_specimen(1)
    placing = es.collections.align_surfaces(truth, source)
    *coarse, fine = (level._replace(n_points=500) for level in surface_fit.LEVELS)
    few, many = (
        surface_fit.bend_placed(source, placing, truth, (*coarse, fine._replace(n_points=n_points)))
        for n_points in (500, 4000)
    )
    assert many.gaps.mean() < 0.8 * few.gaps.mean()
    error, error_of_few = (
        np.linalg.norm(fit.vertices - truth.vertices, axis=1).mean() for fit in (many, few)
    )
    assert error < 0.95 * error_of_few


@pytest.mark.long
def test_the_mirror_image_of_half_a_specimen_is_fitted_and_its_missing_half_is_not_sure():
    source, whole = make_specimen(0), make_specimen(1)
    target = mirror(half(whole))
    fit = es.collections.fit_surface(source, target)
    assert fit.reflected
    assert 0.1 < fit.missing < 0.6
    there = mirror(whole).vertices
    seen = whole.vertices[:, 2] > 0.2
    assert np.median(np.linalg.norm(fit.vertices - there, axis=1)[seen]) < 0.1
    assert fit.confidence[seen].mean() > 0.8
    assert fit.confidence[whole.vertices[:, 2] < -0.3].max() < 0.25


@pytest.mark.long
def test_another_pose_in_a_mirror_is_reached_by_intrinsic_evidence():
    rest, posed = (es.make_creature("hand", pose, n_vertices=600) for pose in (0, 3))
    posed = mirror(posed)
    fit = es.collections.fit_surface(rest, posed)
    assert (fit.method, fit.side) == ("intrinsic", "mirrored")
    assert np.linalg.norm(fit.vertices - posed.vertices, axis=1).mean() < 0.03


@pytest.mark.long
def test_a_biped_that_is_placed_back_to_front_is_turned(monkeypatch):
    rest, posed = (es.make_creature("biped", pose, n_vertices=600) for pose in (0, 1))
    found = es.collections.align_surfaces(posed, rest)
    turn = np.diag([-1.0, 1, -1])  # about the vertical axis, with little change of the front
    middle = rest.vertices.mean(axis=0)
    wrong = es.collections.Similarity(
        found.scale, turn @ found.rotation, middle + turn @ (found.translation - middle), found.gap
    )
    monkeypatch.setattr(surface_fit, "align_surfaces", lambda *_, **__: wrong)
    fit = es.collections.fit_surface(rest, posed)
    assert fit.method == "intrinsic"
    assert np.linalg.norm(fit.vertices - posed.vertices, axis=1).mean() < 0.03


@pytest.mark.long
def test_a_form_of_another_kind_is_refused():
    with pytest.raises(es.InvalidShapeError, match="must have about the form of the source"):
        es.collections.fit_surface(make_specimen(0), es.make_creature("octopus", n_vertices=500))


@pytest.mark.long
def test_a_ball_is_bent_onto_an_ellipsoid_without_a_search_for_poses(monkeypatch):
    ball = es.icosphere(3)
    ellipsoid = es.TriangleMesh(ball.vertices * [1, 1.6, 0.7], ball.faces)
    monkeypatch.setattr(surface_fit, "match_shapes", None)  # each call of it would fail
    fit = es.collections.fit_surface(ball, ellipsoid)
    assert (fit.n_ways, fit.side, fit.method) == (np.inf, "cannot be told", "position")
    assert np.median(fit.gaps) < 0.01
