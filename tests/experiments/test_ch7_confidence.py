"""The experiment on confidence: its quick form runs, and a fragment of a flake has one place."""

import pytest


@pytest.mark.long
@pytest.mark.data
def test_a_fragment_of_a_flake_is_placed_and_sure(quick_form):
    (row,) = quick_form("ch7_confidence/rows.py").values()
    assert row["right"] > 0.95
    assert row["places"] == 1
    assert row["said"] > 0.9
