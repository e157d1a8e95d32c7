"""What should change nothing changes nothing: the folder's figures, and a quick form of its run."""

import json
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_invariance"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())


def require_invariant(table):
    for name, row in table.items():
        assert row["scaled"] <= 1e-9, name
        assert row["scaled by 2ᵖ"] == 0, name
        assert row["shifted"] <= 1e-6, name
        assert row["renumbered"] <= 1e-10, name
        assert row["threads"] == 0, name


def test_the_readme_shows_the_table():
    markdown = runpy.run_path(str(FOLDER / "run.py"))["markdown"]
    assert markdown(EXPECTED) in (FOLDER / "README.md").read_text()
    assert len(EXPECTED) == 16
    require_invariant(EXPECTED)


def run(out, *options):
    subprocess.run([sys.executable, FOLDER / "run.py", *options, "--out", out], check=True, capture_output=True)
    return json.loads(out.read_text())


def test_small_shapes_again(tmp_path):
    found = run(tmp_path / "results.json", "--quick")
    assert len(found) == 8
    require_invariant(found)


@pytest.mark.slow
@pytest.mark.data
def test_all_shapes_again(tmp_path):
    found = run(tmp_path / "results.json")
    assert found.keys() == EXPECTED.keys()
    require_invariant(found)
