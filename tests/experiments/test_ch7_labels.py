"""The experiment on labels: what its README claims."""

import json
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "experiments" / "ch7_labels"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_confidence_holds_on_shapes_on_which_it_was_not_fitted():
    for way in ("one", "all"):
        table = FULL[way]["confidence"]
        rows = zip(*(table[key] for key in table), strict=True)
        for share, confidence, right in rows:
            if share > 0.05:
                assert abs(confidence - right) < 0.1, way


@pytest.mark.long
@pytest.mark.data
def test_labels_are_right_far_more_often_than_the_commonest(quick_form):
    found = quick_form("ch7_labels/run.py")
    for way in ("one", "all"):
        means = found[way]["mean over classes"]
        assert means["right"] > means["commonest"] + 0.2
