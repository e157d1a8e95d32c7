"""The experiment on bending: its folder says what its run gave, and a quick form of it gives the same again."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch6_deformation"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
FULL = EXPECTED["full"]


def test_the_quick_form_gives_the_expected_figures(tmp_path):
    out = tmp_path / "results.json"
    subprocess.run([sys.executable, FOLDER / "run.py", "--quick", "--out", out], check=True, capture_output=True)
    found = json.loads(out.read_text())
    assert found.keys() == EXPECTED["quick"].keys()
    for scene, row in EXPECTED["quick"].items():
        for method in ("graded", "uncrossed", "thesis", "ARAP", "biharmonic", "spectral"):
            assert found[scene][method]["edges"] == pytest.approx(row[method]["edges"], abs=2e-4), (scene, method)
            assert found[scene][method]["least area"] == pytest.approx(row[method]["least area"], abs=2e-2)


@pytest.mark.parametrize("scene", ["knee 60°", "arm stretched", "plane 90°"])
def test_ours_is_as_rigid_as_its_peers_at_equal_handles(scene):
    peers = [FULL[scene][peer]["edges"] for peer in ("ARAP", "ARAP (libigl)")]
    assert FULL[scene]["graded"]["edges"] <= 1.1 * min(peers)
    assert FULL[scene]["graded"]["handles"] == 0


def test_what_was_asked_for_is_so():
    assert FULL["knee 60°"]["thesis"]["of the box"] <= 0.001
    assert FULL["arm stretched"]["thesis"]["of the box"] <= 0.0022
    assert FULL["waist 90°"]["graded"]["feet"] < 0.01
    twisted = FULL["bar twisted 180°"]
    assert twisted["graded"]["least area"] > 0.5
    assert twisted["thesis"]["least area"] < 0.05
    assert all(row["graded"]["flipped"] == row["uncrossed"]["flipped"] == 0 for row in FULL.values())


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    for scene, row in FULL.items():
        methods = ("graded", "uncrossed", "thesis", "ARAP", "ARAP (libigl)", "biharmonic", "spectral")
        assert f"| {scene} | " + " | ".join(f"{row[m]['edges']:.4f}" for m in methods) + " |" in text
        cells = [f"{row[m]['least area']:.2f}; {row[m]['flipped']}; {row[m]['crossing']:,}" for m in methods]
        assert f"| {scene} | " + " | ".join(cells) + " |" in text
