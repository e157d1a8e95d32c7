"""The accuracy tables: the folders say what their runs gave, and quick forms of the runs give it again."""

import json
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"
ACCURACY, SPHERE = EXPERIMENTS / "ch3_accuracy", EXPERIMENTS / "ch3_sphere"


def expected(folder):
    return json.loads((folder / "expected.json").read_text())


def test_the_readme_shows_the_accuracy_table():
    markdown = runpy.run_path(str(ACCURACY / "run.py"))["markdown"]
    assert markdown(expected(ACCURACY)) in (ACCURACY / "README.md").read_text()


def test_orders_are_those_of_theory():
    table = expected(ACCURACY)
    for case, order in (("square", 4), ("square, Dirichlet", 4), ("interval", 4), ("box", 4)):
        assert table[case]["P2"]["order"] == pytest.approx(order, abs=0.3), case
    for case in ("square", "square, Dirichlet"):  # on the interval rounding is all that is left
        assert table[case]["P3"]["order"] == pytest.approx(6, abs=0.6), case
    for case, rows in table.items():
        if case.startswith(("3-sphere", "ball", "box")):
            continue  # too coarse to show it
        for mass in ("lumped", "consistent"):
            assert rows[f"cotangent, {mass}"]["order"] == pytest.approx(2, abs=0.25), (case, mass)


def test_the_readme_shows_the_sphere():
    text = (SPHERE / "README.md").read_text()
    for name, row in expected(SPHERE).items():
        for what, (median, worst) in row.items():
            assert f"{median:.4f} | {worst:.4f}" in text, (name, what)


def test_the_sphere_is_heard_as_well_as_promised():
    table = expected(SPHERE)
    assert table["n = 16000"]["literal"][0] == pytest.approx(0.070, abs=0.01)
    assert table["n = 16000"]["corrected"][0] <= 0.002
    assert table["n = 16000"]["corrected"][1] <= 0.01
    assert table["noise"]["random-walk"][0] <= 0.02
    assert table["noise"]["cotangent"][0] > 0.2


@pytest.mark.slow
def test_the_sphere_again(tmp_path):
    out = tmp_path / "results.json"
    subprocess.run([sys.executable, SPHERE / "run.py", "--most", "2000", "--out", out], check=True, capture_output=True)
    found = json.loads(out.read_text())
    for name, row in found.items():
        for what, errors in row.items():
            assert errors == pytest.approx(expected(SPHERE)[name][what], rel=0.02, abs=2e-5), (name, what)
