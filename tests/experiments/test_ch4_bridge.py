"""Two tori and a bridge: what the README claims."""

import pytest
from quick_forms import largest


@pytest.mark.long
def test_bridges_are_sound_change_little_and_hide_among_independent_samples(quick_form):
    found = quick_form("ch4_bridge/run.py")
    for row in found["surfaces"].values():
        assert (row["closed manifold"], row["Euler characteristic"]) == (True, -2)
        assert (row["components"], row["crossing faces"]) == (1, 0)
    coupled, independent = (
        found["samples"][f"t = 0.001, n = 800, {form}"] for form in ("coupled", "independent")
    )
    thin, thick = largest(coupled)
    assert thin < thick < 0.025
    assert thick < 0.5 * independent["M again"]["largest"]["mean"]
