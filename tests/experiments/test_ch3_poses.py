"""The poses of one cat: what the folder says is what comes out, and what its text claims."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_poses"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())


@pytest.mark.slow
@pytest.mark.data
def test_the_experiment_gives_the_expected_figures(tmp_path):
    out = tmp_path / "results.json"
    subprocess.run([sys.executable, FOLDER / "run.py", "--out", out], check=True, capture_output=True)
    found = json.loads(out.read_text())
    for part, rows in EXPECTED.items():
        for name, values in rows.items():
            assert found[part][name] == pytest.approx(values, rel=1e-3, abs=1e-3), name


def test_the_readme_shows_the_expected_figures():
    table = (FOLDER / "README.md").read_text()
    for name, row in EXPECTED["differences"].items():
        assert f"| {name} | " + " | ".join(f"{value:.4f}" for value in row.values()) + " |" in table


def test_the_geodesic_kernel_is_nearly_as_stable_as_linear_elements():
    rows = EXPECTED["differences"]
    for measure in ("median", "90 %"):
        assert rows["mesh, geodesic"][measure] - rows["cotangent, lumped"][measure] < 0.05
        assert rows["mesh, Euclidean"][measure] - rows["cotangent, lumped"][measure] > 0.05
