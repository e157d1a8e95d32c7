"""Repeatability of feature points: what the README claims."""

import pytest


@pytest.mark.long
def test_maxima_come_back_in_other_poses_far_more_often_than_by_chance(quick_form):
    for name, row in quick_form("ch5_repeatability/run.py")["made"].items():
        assert row["poses"] > 5 * row["chance"], name
