"""A torus attached to a torus: what the README claims."""

import pytest
from quick_forms import largest


@pytest.mark.long
def test_changes_are_large_and_grow_with_the_torus(quick_form):
    found = quick_form("ch4_handle/run.py")
    for row in found["surfaces"].values():
        assert (row["closed manifold"], row["Euler characteristic"]) == (True, -2)
        assert (row["components"], row["crossing faces"]) == (1, 0)
        assert row["area of X"] < 0.02 * row["area of Y"]
    coupled, independent = (
        found["samples"][f"t = 0.01, n = 500, {form}"] for form in ("coupled", "independent")
    )
    small, large = largest(coupled)
    assert 0.2 < small < large
    assert largest(independent, "least").min() > independent["M again"]["largest"]["most"]
    assert largest(independent) == pytest.approx(largest(coupled), rel=0.15)
