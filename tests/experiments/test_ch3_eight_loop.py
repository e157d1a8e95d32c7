"""The spectrum of a loop that is deformed: what the folder says is what comes out, and what its text claims."""

import json
from itertools import pairwise
from pathlib import Path

import pytest
from quick_forms import run_quickly

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_eight_loop"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
FULL = EXPECTED["full"]
README = (FOLDER / "README.md").read_text()
OPERATORS = ("mesh", "cotangent")


def test_the_readme_shows_the_expected_figures():
    for n, row in FULL["steps"].items():
        assert f"| {n} | " + " | ".join(f"{value:.4f}" for value in row.values()) + " |" in README
    assert f"{FULL['exchanges']} times" in README
    for name, change in FULL["largest change on the way"].items():
        assert f"{100 * change:.0f} % ({name})" in README


def test_the_largest_change_is_halved_with_the_step():
    for name in OPERATORS:
        changes = [row[f"{name}: largest change"] for row in FULL["steps"].values()]
        assert [finer / coarser for coarser, finer in pairwise(changes)] == pytest.approx([0.5, 0.5], abs=0.02)


def test_the_change_is_bounded_by_how_far_the_surface_moved():
    for row in FULL["steps"].values():
        for name in OPERATORS:
            assert row[f"{name}: change / δ"] < 0.72
        assert row["mesh: change / Weyl's bound"] <= 1
        assert row["cotangent: change / bound"] <= 1


def test_the_way_is_long_embedded_and_full_of_crossings():
    assert min(FULL["largest change on the way"].values()) > 0.4
    assert FULL["faces that cross"] == 0
    assert FULL["exchanges"] > 20


@pytest.mark.slow
@pytest.mark.data
def test_the_quick_form_gives_the_expected_figures(tmp_path):
    found, expected = run_quickly(FOLDER, tmp_path), EXPECTED["quick"]
    for n, row in expected["steps"].items():
        assert found["steps"][n] == pytest.approx(row, rel=1e-3), n
    assert found["faces that cross"] == expected["faces that cross"]
    assert found["largest change on the way"] == pytest.approx(expected["largest change on the way"], rel=1e-3)
