"""Cortices, left and right: the quick form, and what the README claims."""

import json
from pathlib import Path

import pytest
from quick_forms import require_expected

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "brain_cortex"
EXPECTED = json.loads((FOLDER / "expected.json").read_text(encoding="utf-8"))


@pytest.mark.long
def test_the_quick_form_gives_the_expected_figures(quick_form):
    pytest.importorskip("neuromodes")
    found = quick_form("brain_cortex/run.py")
    # A vertex on a nodal line may fall to either parcel: a seventieth of the smallest.
    require_expected(found, EXPECTED["quick"], one_more=0.02)


def test_parcels_are_connected_alike_in_size_and_first_cuts_agree():
    for rows in EXPECTED["full"]["parcels"].values():
        assert all(row["in pieces"] == 0 for row in rows.values())
        assert all(row["smallest"] > 0.5 and row["largest"] < 1.6 for row in rows.values())
        assert rows["10"]["agreement"] > 0.9
        agreement = [row["agreement"] for row in rows.values()]
        assert agreement == sorted(agreement, reverse=True)


def test_sides_differ_on_large_scales():
    sides = EXPECTED["full"]["sides"]
    assert sides["human"]["share"]["4"] > 0.25
    assert sides["macaque"]["size"] < 0.5 * min(sides["human"]["size"], sides["marmoset"]["size"])
    assert sides["macaque"]["share"]["16"] < min(
        sides["human"]["share"]["16"], sides["marmoset"]["share"]["16"]
    )
