"""The experiment on bending: what the README shows and claims."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch6_deformation"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
FULL, OTHER = EXPECTED["full"], EXPECTED["other scenes"]


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    methods = ("graded", "uncrossed", "thesis", "ARAP", "ARAP (libigl)", "biharmonic", "spectral")
    for scene, row in FULL.items():
        assert (
            f"| {scene} | " + " | ".join(f"{row[m]['edges']:.4f}" for m in methods) + " |" in text
        )
        assert (
            f"| {scene} | " + " | ".join(f"{row[m]['of the box']:.5f}" for m in methods) + " |"
            in text
        )
        cells = [
            f"{row[m]['least area']:.2f}; {row[m]['flipped']}; {row[m]['crossing']:,}"
            for m in methods
        ]
        assert f"| {scene} | " + " | ".join(cells) + " |" in text


def test_the_readme_shows_the_other_scenes_and_what_it_claims_of_them():
    text = (FOLDER / "README.md").read_text()
    for scene, row in OTHER.items():
        errors, ratios = list(row.values())[:4], list(row.values())[4:]
        cells = [f"{value:.4f}" for value in errors] + [f"{value:.2f}" for value in ratios]
        assert f"| {scene} | " + " | ".join(cells) + " |" in text
    assert max(row["over ARAP, same held"] for row in OTHER.values()) < 1.015


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
