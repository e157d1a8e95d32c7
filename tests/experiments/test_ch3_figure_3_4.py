"""Figure 3.4 by the operator of the thesis: what the README claims."""

import json
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_poses"
FULL = json.loads((FOLDER / "expected_figure_3_4.json").read_text())["full"]


def test_by_the_printed_operator_a_crouching_man_is_farther_from_himself_than_a_horse_is():
    printed, linear = FULL["area 1"]["mesh, as printed"], FULL["area 1"]["cotangent, averaged"]
    assert printed["michael2"] > max(printed["horse0"], printed["cat0"])
    assert max(linear[name] for name in linear if "michael" in name) < 0.25 * linear["cat0"]
