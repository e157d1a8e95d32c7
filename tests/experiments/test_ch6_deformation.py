"""The experiment on bending: what the README claims."""

import json
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXPECTED = json.loads((ROOT / "experiments" / "ch6_deformation" / "expected.json").read_text())
FULL, OTHER = EXPECTED["full"], EXPECTED["other scenes"]


def test_other_scenes_change_edges_as_little_as_arap_does():
    assert max(row["over ARAP, same held"] for row in OTHER.values()) < 1.015


def test_the_page_on_bending_says_how_edges_change_beside_as_rigid_as_possible():
    # Beside the better of two implementations.
    *most, last = sorted(
        row["graded"]["edges"] / min(row[peer]["edges"] for peer in ("ARAP", "ARAP (libigl)"))
        for row in FULL.values()
    )
    assert len(most) == 10
    page = " ".join((ROOT / "docs" / "bending.md").read_text().split())
    assert f"({most[0]:.2f} to {most[-1]:.2f} times in ten of eleven scenes, " in page
    assert f"{last:.1f} in one;" in page


@pytest.mark.long
def test_the_other_scenes_are_as_rigid_as_their_peer(quick_form):
    found = quick_form("ch6_deformation/other_scenes.py")
    # The coarse egg settles in another fold than ARAP, at 1.12; the full one is at 1.01.
    assert all(row["over ARAP, same held"] <= 1.15 for row in found.values())


@pytest.mark.long
def test_ours_is_as_rigid_as_its_peers_at_equal_handles(quick_form):
    plane = quick_form("ch6_deformation/run.py")["coarse plane 90°"]
    assert plane["graded"]["edges"] <= 1.1 * min(
        plane[peer]["edges"] for peer in ("ARAP", "ARAP (libigl)")
    )
    assert plane["graded"]["handles"] == 0


@pytest.mark.long
def test_half_a_turn_keeps_every_triangle_and_uncrossed_leaves_no_crossing(quick_form):
    found = quick_form("ch6_deformation/run.py")
    assert all(
        row[mode]["flipped"] == 0 for row in found.values() for mode in ("graded", "uncrossed")
    )
    assert all(row["uncrossed"]["crossing"] == 0 for row in found.values())
    twisted = found["bar twisted 180°"]
    assert min(twisted[mode]["least area"] for mode in ("graded", "uncrossed")) > 0.5
    # Which triangles as-rigid-as-possible squeezes where it folds, from rest, is chance: the least area was .22 to .25
    # by two kernels of BLAS. That it folds is not.
    assert twisted["ARAP"]["least area"] < 0.5
    assert twisted["thesis"]["least area"] < 0.05
    assert min(twisted[method]["crossing"] for method in ("thesis", "ARAP", "biharmonic")) > 500
