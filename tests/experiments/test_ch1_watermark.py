"""Watermarks after attacks, and false alarms: what the README claims."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch1_watermark"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]
SURVIVED = (
    "none",
    "turned, scaled, moved",
    "low-pass to 70 % of the modes",
    "noise of 0.1 %",
    "low-pass, then noise",
)


def test_every_mark_is_found_after_smoothing_and_noise():
    assert FULL["shapes"] == 20
    for attack in SURVIVED:
        assert FULL["attacks"][attack]["found"] == 20, attack


def test_wrong_keys_are_not_found():
    wrong = FULL["wrong keys"]
    assert wrong["tries"] == 10_000
    assert wrong["found"] == 0


@pytest.mark.long
def test_a_few_marks_are_found_and_no_wrong_key_is(quick_form):
    found = quick_form("ch1_watermark/run.py")
    assert all(found["attacks"][attack]["found"] == found["shapes"] for attack in SURVIVED)
    assert found["wrong keys"]["found"] == 0
