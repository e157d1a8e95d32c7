"""The experiment on skulls of mice: what its README claims."""

import json
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FULL = json.loads((ROOT / "experiments" / "ch7_collection" / "expected.json").read_text())["full"]


def test_more_labelled_skulls_are_better():
    assert FULL["7 labelled skulls"]["mean"] < FULL["one labelled skull"]["mean"]
    assert FULL["failed"] == 0


def test_errors_grow_with_the_spread_that_is_given():
    parts = [FULL["spread"][str(fifth)] for fifth in range(1, 6)]
    assert parts[-1]["error"] > 2 * parts[0]["error"]
    for part in parts:
        assert 0.6 < part["spread"] / part["error"] < 1.6
