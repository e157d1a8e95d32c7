"""The armadillo's fingers: what the README claims."""

import pytest
from quick_forms import largest


@pytest.mark.long
@pytest.mark.data
def test_surfaces_are_sound_and_small_changes_stay_small(quick_form):
    found = quick_form("ch4_armadillo/run.py")
    euler = {"two touch": 2, "two joined": 0, "two touch, one on nose": 2, "legs joined": 0}
    for name, row in found["surfaces"].items():
        assert (row["closed manifold"], row["Euler characteristic"]) == (True, euler[name])
        assert (row["components"], row["crossing faces"]) == (1, 0)
    touch, joined, nose, bar = largest(found["samples"]["t = 0.001, n = 800, coupled"])
    assert max(touch, joined) < 0.5 * min(nose, bar)
