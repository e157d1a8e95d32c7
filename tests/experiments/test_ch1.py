"""Figures 1.1 and 1.2: what the READMEs show and claim."""

import json
from pathlib import Path

import numpy as np

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"


def read(name):
    folder = EXPERIMENTS / name
    expected = json.loads((folder / "expected.json").read_text(encoding="utf-8"))
    return expected["full"], (folder / "README.md").read_text(encoding="utf-8")


def test_reconstructions_of_the_horse():
    found, _ = read("ch1_projection")
    means = [row["mean / diagonal"] for row in found["errors"].values()]
    assert (np.diff(means) < 0).all()
    assert means[-1] < 0.002
    assert all(found["exact to 1e-10"].values())


def test_eigenfunctions_of_the_head():
    found, readme = read("ch1_eigenfunctions")
    for number, row in enumerate(found["functions"], 1):
        share = row["share in the surface's functions"]
        assert share > (0.99 if number <= 4 else 0.95)
    assert f"{found['longest / shortest edge']:.0f} times" in readme
