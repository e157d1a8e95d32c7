"""Points moved by noise: what the README shows and claims."""

import json
from pathlib import Path

import numpy as np
import pytest
from quick_forms import change_rows, largest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch4_perturbation"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]
SAMPLES = FULL["samples"]


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    assert all(row in text for row in change_rows(SAMPLES))

    for name, row in FULL["power of δ"].items():
        assert f"| {name} | {row['largest']:.2f} | {row['mean']:.2f} |" in text
    for name in FULL["meshes"]["cotangent"]:
        cells = [
            f"{rows[name]['λ_2']:.2f} | {rows[name]['largest/λ']:.4f}"
            for rows in FULL["meshes"].values()
        ]
        assert f"| {name} | " + " | ".join(cells) + " |" in text


@pytest.mark.long
def test_changes_grow_with_the_noise_and_pass_the_floor(quick_form):
    for name, rows in quick_form("ch4_perturbation/run.py")["samples"].items():
        assert (np.diff(largest(rows)) > 0).all(), name
        for noise, row in rows.items():
            if noise != "M again":
                assert 4.2 < row["δ"]["mean"] / float(noise.split()[-1]) < 4.5
        floor = rows["M again"]["largest"]["mean"]
        assert largest(rows)[0] < floor < largest(rows)[-1], name
