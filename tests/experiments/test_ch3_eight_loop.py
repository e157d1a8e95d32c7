"""The spectrum of a loop that is deformed: what the README claims."""

from itertools import pairwise

import pytest


@pytest.mark.long
@pytest.mark.data
def test_changes_are_halved_with_the_step_and_bounded_by_how_far_the_surface_moved(quick_form):
    found = quick_form("ch3_eight_loop/run.py")
    rows = list(found["steps"].values())
    for name in ("mesh", "cotangent"):
        changes = [row[f"{name}: largest change"] for row in rows]
        assert [finer / coarser for coarser, finer in pairwise(changes)] == pytest.approx(
            [0.5, 0.5], abs=0.15
        )
        assert max(row[f"{name}: change / δ"] for row in rows) < 0.72
    assert max(row["mesh: change / Weyl's bound"] for row in rows) <= 1
    assert max(row["cotangent: change / bound"] for row in rows) <= 1
    assert min(found["largest change on the way"].values()) > 0.4
    assert found["faces that cross"] == 0
