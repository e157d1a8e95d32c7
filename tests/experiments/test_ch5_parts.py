"""The experiment on parts, in quick form, prints what its folder says."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch5_parts"
OURS = ("default", "default, boundaries not smoothed", "heat, scale-free preset", "thesis preset")


@pytest.mark.slow
@pytest.mark.data
def test_quick_form_gives_the_expected_figures(tmp_path):
    out = tmp_path / "results.json"
    command = [sys.executable, FOLDER / "run.py", "--quick", "--db", tmp_path / "db", "--out", out]
    subprocess.run(command, check=True, capture_output=True)
    expected, found = json.loads((FOLDER / "expected.json").read_text())["quick"], json.loads(out.read_text())
    assert found.keys() == expected.keys()
    for way in OURS:
        assert found["error"][way]["all"] == pytest.approx(expected["error"][way]["all"], abs=0.01), way
    assert found["largest part of the default, median"] == pytest.approx(
        expected["largest part of the default, median"], abs=0.05
    )


def full():
    return json.loads((FOLDER / "expected.json").read_text())["full"]


def test_the_default_beats_every_other_way_on_the_half_that_nothing_was_chosen_on():
    errors = {way: halves["reporting"] for way, halves in full()["error"].items()}
    assert min(errors, key=errors.get) == "default"


def test_the_largest_part_of_animals_and_humans_is_below_half():
    largest = full()["largest part of the default, median"]
    assert all(largest[cls] < 0.5 for cls in ("armadillo", "fourleg", "human", "bird", "teddy", "ant"))


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    for way, halves in full()["error"].items():
        row = f"| {way} | " + " | ".join(f"{halves[half]:.3f}" for half in ("tuning", "reporting", "all"))
        assert row in text.replace("*", ""), way
    for cls, share in full()["largest part of the default, median"].items():
        assert f"| {cls} | {full()['by class'][cls]['default']:.3f} | {share:.2f} |" in text
