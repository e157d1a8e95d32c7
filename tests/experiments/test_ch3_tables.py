"""The accuracy table: the folder says what its run gave, and orders are those of theory."""

import json
import runpy
from pathlib import Path

import pytest

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"
ACCURACY = EXPERIMENTS / "ch3_accuracy"


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
