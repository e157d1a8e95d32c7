"""Bounds beside what is measured: what the folder says is what comes out, and what its text claims."""

import json
import runpy
from pathlib import Path

import pytest
from quick_forms import require_equal, run_quickly

import eigenshape as es

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch4_bound"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
FULL = EXPECTED["full"]
README = (FOLDER / "README.md").read_text()


def test_the_readme_shows_the_expected_figures(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER.parent)
    monkeypatch.syspath_prepend(FOLDER)
    for table in runpy.run_path(str(FOLDER / "run.py"))["markdown"](FULL).values():
        assert table in README
    assert f"{100 * FULL['largest share of our bound for dense samples']:.0f} % of it is used" in README
    assert f"change by {100 * FULL['lowest ten, relative, t ≤ δ²/4']:.0f} % where" in README
    assert f"fitted as {FULL['functional']['t']:.2f};" in README


def test_no_change_exceeds_a_bound():
    for name in ("largest share of our bound", "largest share of Weyl's norm", "samples, largest share of our bound"):
        assert 0 < FULL[name] < 1, name
    assert FULL["largest share of our bound for dense samples"] < 1


def test_powers_are_those_of_dense_samples_and_not_those_proven():
    measured, dense = FULL["points, t ≥ 4δ²"], es.theorem_rate("dense", 2)
    assert measured["delta"] == pytest.approx(dense.delta, abs=0.1)
    assert measured["t"] == pytest.approx(dense.t, abs=0.35)
    assert measured["t"] > es.theorem_rate("4.3.1", 2).t + 1


def test_the_case_that_theory_forbids_fails():
    assert FULL["lowest ten, relative, t ≥ 4δ²"] < 0.02
    assert FULL["lowest ten, relative, t ≤ δ²/4"] > 0.7


def test_surfaces_follow_first_order_perturbation_and_the_functional_is_linear_in_t():
    for name, row in FULL["surfaces"].items():
        assert row["δ, by number"] == pytest.approx(1, abs=0.25), name
        assert row["δ, as sets"] < row["δ, by number"], name
    assert FULL["functional"]["t"] == pytest.approx(1, abs=0.02)


@pytest.mark.slow
def test_the_quick_form_gives_the_expected_figures(tmp_path):
    require_equal(run_quickly(FOLDER, tmp_path), EXPECTED["quick"])
