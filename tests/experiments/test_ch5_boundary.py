"""Boundary conditions in matching: what the README claims."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch5_boundary"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_without_reflections_heat_changes_least_and_finds_most():
    free, neumann = FULL["reflection-free"], FULL["Neumann"]
    assert free["change near"] < 0.25 * neumann["change near"]
    assert free["change elsewhere"] < 0.5 * neumann["change elsewhere"]
    assert free["found"] > neumann["found"] + 10
    assert free["top 1"] > neumann["top 1"] + 20


@pytest.mark.long
@pytest.mark.data
def test_without_reflections_heat_changes_least_on_other_shapes(quick_form):
    found = quick_form("ch5_boundary/run.py")
    changes = [found[name]["change near"] for name in ("reflection-free", "Neumann", "Dirichlet")]
    assert changes == sorted(changes)
