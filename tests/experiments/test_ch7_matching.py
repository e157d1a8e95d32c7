"""The experiment on dense correspondences: what its README claims."""

import pytest


@pytest.mark.long
@pytest.mark.data
def test_two_parts_of_lions_are_placed(quick_form):
    found = quick_form("ch7_matching/run.py")
    assert max(found["mean error"].values()) < 10


@pytest.mark.long
@pytest.mark.data
def test_a_hand_is_placed_on_another_one(quick_form):
    row = quick_form("ch7_matching/further.py")["individuals"]["hand"]
    assert row["wholes"] > row["usual"] + 0.1


@pytest.mark.long
@pytest.mark.data
def test_constants_fitted_to_three_parts_tell_right_vertices_from_wrong_ones(quick_form):
    groups = quick_form("ch7_matching/calibrate.py")["groups"].values()
    # Half of all vertices are right, so that one number for all would score 0.25.
    scores = [row["fitted"]["Brier"] for row in groups]
    assert sum(scores) / len(scores) < 0.2


@pytest.mark.long
@pytest.mark.data
def test_torn_and_awkward_files_are_matched_or_refused_with_the_reason(quick_form):
    found = quick_form("ch7_matching/awkward.py")
    (part,) = found["torn"].values()
    assert part["repairs"]
    assert part["error of the largest piece"] < 5
    assert part["confidence of the others"] < 0.2  # limbs of 1 % of the area
    rows = {row["file"]: row for row in found["awkward"]}
    assert rows["geometrycentral/fox.ply"]["mean error"] < 1
    assert rows["trimesh/cylinder.stl"]["equally good"] > 1
    strip = rows["geometrycentral/moebius.obj"]
    assert "one side only" in strip["refused"]
    assert strip["remedy"] == "cut_one_sided"
    assert strip["mean error"] < 1
