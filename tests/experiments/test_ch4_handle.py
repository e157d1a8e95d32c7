"""A torus attached to a torus: what the folder says is what comes out, and what its text claims."""

import json
from pathlib import Path

import numpy as np
import pytest
from quick_forms import change_rows, largest, require_equal, run_quickly

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch4_handle"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
FULL = EXPECTED["full"]
SAMPLES = FULL["samples"]


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    assert all(row in text for row in change_rows(SAMPLES))
    for name, row in FULL["surfaces"].items():
        areas = f"{row['area of X']:.4f} | {row['area of Y']:.4f}"
        ends = f"{row['δ']:.3f} | {row['limited by']}"
        assert f"| {name} | {row['Euler characteristic']} | {areas} | {ends} |" in text
    for name, row in FULL["meshes"]["cotangent"].items():
        assert f"| {name} | {row['λ_2']:.2f} | {row['largest/λ']:.4f} |" in text


def test_surfaces_are_sound():
    for row in FULL["surfaces"].values():
        assert (row["closed manifold"], row["Euler characteristic"]) == (True, -2)
        assert (row["components"], row["crossing faces"]) == (1, 0)
        assert row["area of X"] < 0.02 * row["area of Y"]


def test_changes_are_large_and_grow():
    for time in ("t = 0.001, n = 3000", "t = 0.0003, n = 8000"):
        assert (np.diff(largest(SAMPLES[f"{time}, coupled"])) > 0).all()
    coupled, independent = (SAMPLES[f"t = 0.01, n = 1500, {form}"] for form in ("coupled", "independent"))
    assert largest(independent, "least").min() > independent["M again"]["largest"]["most"]
    assert largest(independent) == pytest.approx(largest(coupled), rel=0.15)
    assert largest(coupled)[0] > 7 * largest(SAMPLES["t = 0.001, n = 3000, coupled"])[0]


def test_most_of_it_is_volume():
    row, surface = SAMPLES["t = 0.001, n = 3000, coupled"]["s = 1"], FULL["surfaces"]["s = 1"]
    last = row["largest"]["mean"] / row["largest/λ"]["mean"]
    grown = surface["area of M"] - surface["area of X"] + surface["area of Y"]
    assert last * (1 - surface["area of M"] / grown) == pytest.approx(0.39, abs=0.005)
    assert row["largest"]["mean"] == pytest.approx(0.48, abs=0.005)


@pytest.mark.slow
def test_the_quick_form_gives_the_expected_figures(tmp_path):
    require_equal(run_quickly(FOLDER, tmp_path), EXPECTED["quick"])
