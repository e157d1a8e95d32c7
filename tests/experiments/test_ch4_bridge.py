"""Two tori and a bridge: what the README shows and claims."""

import json
from pathlib import Path

import pytest
from quick_forms import change_rows, largest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch4_bridge"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    assert all(row in text for row in change_rows(FULL["samples"]))
    for name, row in FULL["surfaces"].items():
        start = f"| {name} | {row['Euler characteristic']} | {row['area of X']:.4f} | {row['area of Y']:.4f} | "
        assert (
            start
            + f"{row['δ']:.3f} | {row['limited by']} | {row['least δ']:.3f} | {row['widened by']:.3f} |"
            in text
        )
    for name in FULL["meshes"]["cotangent"]:
        row = " | ".join(f"{rows[name]['λ_2']:.3f}" for rows in FULL["meshes"].values())
        assert f"| {name} | {row} |" in text


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
