"""Two tori and a bridge: what the folder says is what comes out, and what its text claims."""

import json
from pathlib import Path

import numpy as np
import pytest
from quick_forms import change_rows, largest, require_equal, run_quickly

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch4_bridge"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
FULL = EXPECTED["full"]
THOUSANDTH, HUNDREDTH, TEN_THOUSANDTH, INDEPENDENT = (
    FULL["samples"][name]
    for name in (
        "t = 0.001, n = 2000, coupled",
        "t = 0.0003, n = 3000, coupled",
        "t = 0.0001, n = 6500, coupled",
        "t = 0.001, n = 2000, independent",
    )
)


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    assert all(row in text for row in change_rows(FULL["samples"]))
    for name, row in FULL["surfaces"].items():
        start = f"| {name} | {row['Euler characteristic']} | {row['area of X']:.4f} | {row['area of Y']:.4f} | "
        assert (
            start + f"{row['δ']:.3f} | {row['limited by']} | {row['least δ']:.3f} | {row['widened by']:.3f} |" in text
        )
    for name in FULL["meshes"]["cotangent"]:
        row = " | ".join(f"{rows[name]['λ_2']:.3f}" for rows in FULL["meshes"].values())
        assert f"| {name} | {row} |" in text


def test_bridges_are_sound():
    for row in FULL["surfaces"].values():
        assert (row["closed manifold"], row["Euler characteristic"]) == (True, -2)
        assert (row["components"], row["crossing faces"]) == (1, 0)


def test_the_largest_change_grows_with_the_radius():
    for rows in (THOUSANDTH, HUNDREDTH):
        assert (np.diff(largest(rows)) > 0).all()
    ratio = largest(THOUSANDTH)[-1] / largest(THOUSANDTH)[0]
    assert 5 < ratio < 5.5
    assert largest(THOUSANDTH)[-1] < 0.025
    assert largest(THOUSANDTH, "least")[-1] > largest(THOUSANDTH, "most")[:-1].max()
    tenth = largest(TEN_THOUSANDTH)
    assert (np.diff(tenth[:4]) > 0).all()
    assert tenth[3] > tenth[5]


def test_independent_samples_hide_it():
    floor = INDEPENDENT["M again"]["largest"]["mean"]
    assert (largest(THOUSANDTH) < floor).all()
    assert (largest(INDEPENDENT) > floor).all()
    assert largest(INDEPENDENT)[-1] < 1.01 * largest(INDEPENDENT)[0]


def test_only_the_cotangent_operator_knows_of_two_pieces():
    second = {name: [row["λ_2"] for row in rows.values()] for name, rows in FULL["meshes"].items()}
    assert second["cotangent"][0] < 1e-6
    assert second["cotangent"][1] > 2
    assert second["mesh, corrected"][0] > 1


@pytest.mark.slow
def test_the_quick_form_gives_the_expected_figures(tmp_path):
    require_equal(run_quickly(FOLDER, tmp_path), EXPECTED["quick"])
