"""Pointwise convergence: what the README claims."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch2_pointwise"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_only_the_pointwise_rule_and_the_theorem_converge():
    for kind, row in FULL["rates"].items():
        default, pointwise, theorem, cotangent = row.values()
        assert default < -0.5, kind
        assert 0.8 < pointwise < 1.2
        assert 0.2 < theorem < 0.4
        assert cotangent < 0


@pytest.mark.long
def test_coarse_meshes_converge_as_well(quick_form):
    for row in quick_form("ch2_pointwise/run.py")["rates"].values():
        assert 0.8 < row["t = pointwise"] < 1.4
