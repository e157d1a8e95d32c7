"""Repeatability of feature points: what the README shows and claims."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch5_repeatability"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_the_text_says_how_maps_agree():
    text = (FOLDER / "README.md").read_text()
    for kind, row in FULL["maps"].items():
        assert f"{kind} {100 * row['median']:.1f} % and {100 * row['within 5 %']:.0f} %" in text


@pytest.mark.long
def test_maxima_come_back_in_other_poses_far_more_often_than_by_chance(quick_form):
    for name, row in quick_form("ch5_repeatability/run.py")["made"].items():
        assert row["poses"] > 5 * row["chance"], name
