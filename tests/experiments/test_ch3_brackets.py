"""The brackets of ten shapes: what the folder says is what comes out, and what its text claims."""

import json
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_brackets"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())


def test_the_readme_shows_the_table():
    markdown = runpy.run_path(str(FOLDER / "run.py"))["markdown"]
    assert markdown(EXPECTED) in (FOLDER / "README.md").read_text()


def test_every_bracket_holds_a_truth_that_no_longer_moves():
    assert len({name.split(",")[0] for name in EXPECTED}) == 10
    for name, row in EXPECTED.items():
        assert row["held"] == 100, name
        assert row["moved / width"] < 0.01, name
        assert row["room / moved"] is None or row["room / moved"] > 100, name


def test_widths_fall_with_the_square_where_eigenfunctions_are_smooth():
    for name, row in EXPECTED.items():
        if name.startswith(("square", "polygon of 24", "flat torus", "tetrahedron", "cube", "eight")):
            assert 1.9 < row["order"][0] <= row["order"][1] < 2.1, name
    assert EXPECTED["fox"]["order"][0] < 1.7  # around its vertices lie up to 490°


def test_two_shapes_again(tmp_path):
    out = tmp_path / "results.json"
    names = ["tetrahedron", "polygon of 24 sides"]
    subprocess.run(
        [sys.executable, FOLDER / "run.py", "--quick", "--only", *names, "--out", out], check=True, capture_output=True
    )
    found = json.loads(out.read_text())
    assert len(found) == 3
    for name, row in found.items():
        assert row["held"] == 100, name
        for key in ("first", "median", "last"):
            # residuals, up to 1e-8 of an eigenvalue, are part of a width
            assert row[key] == pytest.approx(EXPECTED[name][key], rel=1e-5), (name, key)
