"""The accuracy table: orders of the quick form are those of theory."""

import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_accuracy"


def test_no_more_eigenvalues_are_asked_for_than_a_small_solid_has():
    module = runpy.run_path(str(FOLDER / "run.py"))
    found = module["measured"](module["CASES"]["box, Dirichlet"], "P2", (300, 600))
    assert found["n"] == [729, 1331]


@pytest.mark.long
def test_orders_are_those_of_theory(quick_form):
    table = quick_form("ch3_accuracy/run.py")
    for case in ("square", "square, Dirichlet"):
        assert table[case]["P2"]["order"] == pytest.approx(4, abs=0.3), case
        assert table[case]["P3"]["order"] == pytest.approx(6, abs=0.6), case
    for case in ("square", "disc", "flat torus in R⁴"):
        for mass in ("lumped", "consistent"):
            assert table[case][f"cotangent, {mass}"]["order"] == pytest.approx(2, abs=0.25), (
                case,
                mass,
            )
