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
    found, readme = read("ch1_projection")
    for count, row in found["errors"].items():
        volume = 0.0 if isinstance(row["volume"], str) else row["volume"]
        cells = (
            f"{row['mean / diagonal']:.4f} | {row['largest / diagonal']:.4f} | {volume:.3f} | "
            f"{row['area']:.3f}"
        )
        assert f"| {count} | {cells} |" in readme
    means = [row["mean / diagonal"] for row in found["errors"].values()]
    assert (np.diff(means) < 0).all()
    assert means[-1] < 0.002
    assert all(found["exact to 1e-10"].values())


def test_eigenfunctions_of_the_head():
    found, readme = read("ch1_eigenfunctions")
    for number, row in enumerate(found["functions"], 1):
        share = row["share in the surface's functions"]
        assert f"| {number} | {row['eigenvalue']:.5f} | {share:.4f} |" in readme
        assert share > (0.99 if number <= 4 else 0.95)
    assert f"{found['longest / shortest edge']:.0f} times" in readme
