"""The experiment on parts: what the README shows and claims."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch5_parts"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    for way, halves in FULL["error"].items():
        row = f"| {way} | " + " | ".join(
            f"{halves[half]:.3f}" for half in ("tuning", "reporting", "all")
        )
        assert row in text.replace("*", ""), way
    for cls, share in FULL["largest part of the default, median"].items():
        assert f"| {cls} | {FULL['by class'][cls]['default']:.3f} | {share:.2f} |" in text


@pytest.mark.long
@pytest.mark.data
def test_the_default_beats_every_other_way(quick_form):
    found = quick_form("ch5_parts/run.py")
    errors = {way: halves["all"] for way, halves in found["error"].items()}
    assert min(errors, key=errors.get) == "default"
    largest = found["largest part of the default, median"]
    assert all(largest[cls] < 0.5 for cls in ("armadillo", "human", "teddy", "ant"))
