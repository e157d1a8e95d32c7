"""The experiment on dense correspondences: what its README shows."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch7_matching"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    for group in ("lion", "rigid", "tuning"):
        for kind, row in FULL[group]["match_shapes"].items():
            today = FULL[group]["nearest pair of match_patches"][kind]["mean"]
            numbers = f"{row['mean']:.1f} | {row['median']:.1f} | {row['under 5']:.2f}"
            line = f"| {group} | {kind} | {numbers} | {row['over 20']:.2f} | {today:.1f} |"
            assert line in text, line


@pytest.mark.long
@pytest.mark.data
def test_two_parts_of_lions_are_placed(quick_form):
    found = quick_form("ch7_matching/run.py")
    assert max(found["mean error"].values()) < 10
