"""The retrieval experiment, in quick form, prints what its folder says."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch5_retrieval"
ONE_QUERY = 100 / 12 + 0.1  # in per cent, of the 12 partial scans in the quick form: rounding may turn a near tie


def figures(tree, path=()):
    if isinstance(tree, dict):
        return {key: value for name, below in tree.items() for key, value in figures(below, (*path, name)).items()}
    return {path: tree}


@pytest.mark.slow
@pytest.mark.data
def test_quick_form_gives_the_expected_figures(tmp_path):
    out = tmp_path / "results.json"
    command = [sys.executable, FOLDER / "run.py", "--quick", "--db", tmp_path / "db", "--out", out]
    subprocess.run(command, check=True, capture_output=True)
    expected = figures(json.loads((FOLDER / "expected.json").read_text())["quick"])
    found = figures(json.loads(out.read_text()))
    assert found.keys() == expected.keys()
    for key, rates in expected.items():
        assert found[key] == pytest.approx(rates, abs=ONE_QUERY), key


def test_the_readme_shows_the_expected_figures():
    table = (FOLDER / "README.md").read_text()
    full = json.loads((FOLDER / "expected.json").read_text())["full"]
    for recipe in ("scale-free", "thesis"):
        for what in ("complete", "partial scans"):
            for rates in full[recipe][what].values():
                assert " / ".join(f"{rate:.1f}" for rate in rates) in table
