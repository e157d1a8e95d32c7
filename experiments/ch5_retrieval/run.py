"""Leave-one-out retrieval over real, complete shapes: Top-1, Top-3 and Top-5 hit rates.

The index is kept, so a second run measures without describing anything again.
"""

import argparse
import csv
import json
import os
from functools import partial
from pathlib import Path

import numpy as np

import eigenshape as es

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("EIGENSHAPE_DATA", HERE.parents[2] / "shared" / "data"))
FOUR_LEGGED = ("fourleg", "horse", "dog", "cat", "wolf", "lion")
TOPS = (1, 3, 5)


def describe_file(path: str, recipes: tuple[es.Recipe, ...]) -> list[es.ShapeDescriptor]:
    """Read a mesh and describe it by each recipe."""
    mesh = es.read_mesh(path)
    return [es.describe_mesh(mesh, recipe).descriptor for recipe in recipes]


def shapes(quick: bool) -> list[dict[str, str]]:
    """Read the manifest: classes with at least three shapes, or every fourth shape of each."""
    with (DATA / "retrieval" / "manifest.csv").open() as file:
        rows = list(csv.DictReader(file))
    sizes = {row["cls"]: sum(other["cls"] == row["cls"] for other in rows) for row in rows}
    rows = [row for row in rows if sizes[row["cls"]] >= 3]
    return rows[::4] if quick else rows
