"""Bounds beside what is measured: what the README claims."""

import pytest


@pytest.mark.long
def test_no_change_exceeds_a_bound_and_powers_are_those_of_dense_samples(quick_form):
    found = quick_form("ch4_bound/run.py")
    for name in (
        "largest share of our bound",
        "largest share of Weyl's norm",
        "samples, largest share of our bound",
    ):
        assert 0 < found[name] < 1, name
    assert found["largest share of our bound for dense samples"] < 1
    measured, dense, proven = (
        found[name] for name in ("points, t ≥ 4δ²", "expected (dense)", "proven (4.3.1)")
    )
    assert measured["delta"] == pytest.approx(dense["delta"], abs=0.2)
    assert measured["t"] == pytest.approx(dense["t"], abs=0.35)
    assert measured["t"] > proven["t"] + 0.5
    # where theory forbids it, under a quarter of δ², nothing is kept
    assert found["lowest ten, relative, t ≥ 4δ²"] < 0.02
    assert found["lowest ten, relative, t ≤ δ²/4"] > 0.7
    for name, row in found["surfaces"].items():
        assert row["δ, by number"] == pytest.approx(1, abs=0.25), name
        assert row["δ, as sets"] < row["δ, by number"], name
    assert found["functional"]["t"] == pytest.approx(1, abs=0.02)
