"""The brackets of ten shapes: the quick form shows what the text claims."""

import json
import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_brackets"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_there_are_ten_shapes():
    assert len({name.split(",")[0] for name in FULL}) == 10


@pytest.mark.long
def test_every_bracket_holds_a_truth_that_no_longer_moves(quick_form):
    for name, row in quick_form("ch3_brackets/run.py").items():
        assert row["held"] == 100, name
        assert row["moved / width"] < 0.01, name
        assert row["room / moved"] is None or row["room / moved"] > 100, name


@pytest.mark.long
def test_widths_fall_with_the_square_where_eigenfunctions_are_smooth():
    order, case = (runpy.run_path(str(FOLDER / "run.py"))[name] for name in ("order", "flat_torus"))
    least, most = order(case(8), "neumann")
    assert 1.9 < least <= most < 2.1
