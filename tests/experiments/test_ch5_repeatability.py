"""Repeatability of feature points: what the folder says is what comes out."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch5_repeatability"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
ONE_POINT = 100 / 60 + 0.1  # in per cent, of the 60 feature points behind a figure: rounding may turn a near tie


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    for what in ("made", "real"):
        for name, row in EXPECTED["full"][what].items():
            assert f"| {name} | " + " | ".join(f"{value:.1f}" for value in row.values()) + " |" in text
    for kind, row in EXPECTED["full"]["maps"].items():
        assert f"{kind} {100 * row['median']:.1f} % and {100 * row['within 5 %']:.0f} %" in text


@pytest.mark.slow
def test_the_quick_form_gives_the_expected_figures(tmp_path):
    out = tmp_path / "results.json"
    subprocess.run([sys.executable, FOLDER / "run.py", "--quick", "--out", out], check=True, capture_output=True)
    found, expected = json.loads(out.read_text())["made"], EXPECTED["quick"]["made"]
    assert found.keys() == expected.keys()
    for name, row in expected.items():
        assert found[name] == pytest.approx(row, abs=ONE_POINT), name
