"""Figures 1.1 and 1.2: what the READMEs claim."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"


def full(name):
    return json.loads((EXPERIMENTS / name / "expected.json").read_text(encoding="utf-8"))["full"]


def test_reconstructions_of_the_horse():
    found = full("ch1_projection")
    means = [row["mean / diagonal"] for row in found["errors"].values()]
    assert (np.diff(means) < 0).all()
    assert means[-1] < 0.002
    assert all(found["exact to 1e-10"].values())


@pytest.mark.data
def test_the_horse_is_turned_outward():
    """The file's faces point inward, which made shares of the volume negative."""
    script = str(EXPERIMENTS / "ch1_projection" / "run.py")
    horse = runpy.run_path(script)["load_shape"](quick=False)
    assert es.geometry.enclosed_volume(horse) > 0


def test_eigenfunctions_of_the_head():
    found = full("ch1_eigenfunctions")
    for number, row in enumerate(found["functions"], 1):
        share = row["share in the surface's functions"]
        assert share > (0.99 if number <= 4 else 0.95)
