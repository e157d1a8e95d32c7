"""The experiment on dense correspondences: what its README shows."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch7_matching"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
FULL, FURTHER, CALIBRATED = EXPECTED["full"], EXPECTED["further"], EXPECTED["calibrate"]


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    for group in ("lion", "rigid", "tuning"):
        for kind, row in FULL[group]["match_shapes"].items():
            today = FULL[group]["nearest pair of match_patches"][kind]["mean"]
            numbers = f"{row['mean']:.1f} | {row['median']:.1f} | {row['under 5']:.2f}"
            line = f"| {group} | {kind} | {numbers} | {row['over 20']:.2f} | {today:.1f} |"
            better = row.get("mean of the better mirror image")
            line += " – |" if better is None else f" {better:.1f} |"
            assert line in text, line
    for kind, row in FURTHER["lion"].items():
        numbers = f"{row['mean']:.1f} | {row['median']:.1f} | {row['under 5']:.2f}"
        assert f"| {kind} | {numbers} | {row['over 20']:.2f} |" in text, kind
    for cls, row in FURTHER["individuals"].items():
        line = f"| {cls} | {row['wholes']:.2f} | {row['cuts']:.2f} | {row['usual']:.2f} |"
        assert line in text, line
    for group, row in CALIBRATED["groups"].items():
        line = f"| {group} | {row['right']:.2f} |"
        for way in ("confidence", "left out", "former"):
            score = row.get(way)
            line += f" {score['Brier']:.2f} |" if score else " – |"
        assert line in text, line
    means = " | ".join(f"{mean:.1f}" for mean in CALIBRATED["mean errors"].values())
    assert f"| maps of `match_shapes` | {means} |" in text


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
