"""The armadillo's fingers: what the README shows and claims."""

import json
from pathlib import Path

import pytest
from quick_forms import change_rows, largest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch4_armadillo"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]
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
