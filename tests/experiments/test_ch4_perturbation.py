"""Points moved by noise: what the folder says is what comes out, and what its text claims."""

import json
from pathlib import Path

import numpy as np
import pytest
from quick_forms import change_rows, largest, require_equal, run_quickly

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch4_perturbation"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
FULL = EXPECTED["full"]
SAMPLES = FULL["samples"]


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    assert all(row in text for row in change_rows(SAMPLES))

    for name, row in FULL["power of δ"].items():
        assert f"| {name} | {row['largest']:.2f} | {row['mean']:.2f} |" in text
    for name in FULL["meshes"]["cotangent"]:
        cells = [f"{rows[name]['λ_2']:.2f} | {rows[name]['largest/λ']:.4f}" for rows in FULL["meshes"].values()]
        assert f"| {name} | " + " | ".join(cells) + " |" in text


def test_changes_grow_with_the_noise():
    for rows in SAMPLES.values():
        assert (np.diff(largest(rows)) > 0).all()
        moved = {name: row for name, row in rows.items() if name != "M again"}
        for name, row in moved.items():
            assert 4.3 < row["δ"]["mean"] / float(name.split()[-1]) < 4.5
    small, *_, large = (run["ε = 0.008"]["largest/λ"]["mean"] for run in SAMPLES.values())
    assert small == pytest.approx(0.34, abs=0.01)
    assert large == pytest.approx(0.08, abs=0.005)


def test_the_floor_is_passed_where_the_text_says():
    for (name, rows), (below, above) in zip(SAMPLES.items(), ((1, 2), (2, 3), (3, 4)), strict=True):
        floor = rows["M again"]["largest"]["mean"]
        assert largest(rows)[below] < floor < largest(rows)[above], name


def test_the_powers_are_what_the_text_says():
    powers = list(FULL["power of δ"].values())
    assert all(1 <= row["mean"] < 1.7 for row in powers)
    assert [row["largest"] > 0.8 for row in powers] == [True, True, False]


def test_one_operator_falls_and_the_other_rises():
    second = {name: [row["λ_2"] for row in rows.values()] for name, rows in FULL["meshes"].items()}
    assert (np.diff(second["cotangent"]) < 0).all()
    assert (np.diff(second["mesh, corrected"]) > 0).all()


@pytest.mark.slow
def test_the_quick_form_gives_the_expected_figures(tmp_path):
    require_equal(run_quickly(FOLDER, tmp_path), EXPECTED["quick"])
