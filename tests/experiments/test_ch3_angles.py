"""Angles of eigenspaces: what the README claims."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_angles"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_angles_grow_with_the_change_and_shrink_with_the_gap():
    medians = [FULL[f"stretch {share}"]["median"] for share in (0.001, 0.01, 0.1)]
    assert medians[1] / medians[0] == pytest.approx(10, rel=0.1)
    assert medians[2] / medians[1] == pytest.approx(10, rel=0.1)
    for row in FULL.values():
        assert row["rank correlation with the gap"] < -0.6
        assert row["median, narrow gaps"] > 1.3 * row["median, wide gaps"]
        assert row["largest angle over its bound"] <= 1


@pytest.mark.long
@pytest.mark.data
def test_no_angle_is_above_its_bound(quick_form):
    for row in quick_form("ch3_angles/run.py").values():
        assert row["largest angle over its bound"] <= 1
