"""The armadillo's fingers: what the folder says is what comes out, and what its text claims."""

import json
from pathlib import Path

import numpy as np
import pytest
from quick_forms import change_rows, largest, require_equal, run_quickly

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch4_armadillo"
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
    genera = {"two touch": 2, "two joined": 0, "two touch, one on nose": 2, "legs joined": 0}
    for name, row in FULL["surfaces"].items():
        assert (row["closed manifold"], row["Euler characteristic"]) == (True, genera[name])
        assert (row["components"], row["crossing faces"]) == (1, 0)


def test_small_changes_stay_small_and_the_larger_is_noticeable():
    rows = SAMPLES["t = 0.0001, n = 8000, coupled"]
    shares = [row["largest/λ"]["mean"] for row in rows.values()]
    assert shares == pytest.approx([0.010, 0.008, 0.025, 0.060], abs=0.002)
    assert largest(rows).argmax() == 3


def test_at_a_larger_time_the_finger_on_the_nose_changes_most():
    touch, _, nose, bar = largest(SAMPLES["t = 0.001, n = 2000, coupled"])
    assert nose > bar
    assert 9 < nose / touch < 11


def test_independent_samples_hide_all_but_the_finger_on_the_nose():
    rows = SAMPLES["t = 0.001, n = 2000, independent"]
    floor = rows["M again"]["largest"]
    means = largest(rows)
    assert (floor["least"] < means).all()
    assert (means < floor["most"]).all()
    assert means.argmax() == 2
    assert 1.4 < means[2] / floor["mean"] < 1.8
    assert (np.delete(means, 2) < 1.25 * floor["mean"]).all()


def test_the_cotangent_operator_hears_no_jump():
    rows = FULL["meshes"]["cotangent"]
    assert rows["two joined"]["λ_2"] == pytest.approx(rows["M"]["λ_2"], rel=0.002)
    assert rows["two joined"]["largest/λ"] == pytest.approx(rows["two touch"]["largest/λ"], rel=0.02)


@pytest.mark.data
@pytest.mark.slow
def test_the_quick_form_gives_the_expected_figures(tmp_path):
    require_equal(run_quickly(FOLDER, tmp_path), EXPECTED["quick"])
