"""Neurons, in pieces: the quick form, and what the README claims."""

import json
from importlib.util import find_spec
from pathlib import Path

import pytest
from quick_forms import require_expected

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "brain_neurons"
EXPECTED = json.loads((FOLDER / "expected.json").read_text(encoding="utf-8"))
NEURONS = EXPECTED["full"]["neurons"]


@pytest.mark.long
@pytest.mark.skipif(
    find_spec("navis") is None, reason="neurons are absent: pip install --no-deps navis"
)
def test_the_quick_form_gives_the_expected_figures(quick_form):
    require_expected(quick_form("brain_neurons/run.py"), EXPECTED["quick"])


def test_all_spectra_are_certified():
    for row in NEURONS.values():
        spectra = [*row["all pieces"].values(), *row["largest"].values()]
        assert len(spectra) == 6
        assert all(spectrum["certified"] for spectrum in spectra)
        assert row["all pieces"]["200"]["zeros"] == row["pieces"]
        assert row["largest"]["200"]["zeros"] == 1


def test_a_hundred_regions_hold_the_heat():
    assert len(NEURONS) == 5
    for row in NEURONS.values():
        assert row["regions"]["0.05"] < 60
        assert row["regions"]["0.01"] < 150


def test_the_stated_error_bounds_the_true_one():
    large = EXPECTED["full"]["large"]
    assert large["split four times"]["vertices"] > 1_000_000
    assert large["split four times"]["stated error"] < 0.01
    assert large["split twice"]["true error"] < large["split twice"]["stated error"]
    assert large["split four times"]["regions"] == large["split twice"]["regions"]
