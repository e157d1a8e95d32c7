"""What experiments share: where real shapes lie, and which there are."""

import csv
import os
import sys
from pathlib import Path

import numpy as np

import eigenshape as es

DATA = Path(
    os.environ.get("EIGENSHAPE_DATA", Path(__file__).resolve().parents[2] / "shared" / "data")
)


def manifest() -> list[dict[str, str]]:
    """Return class and path of each shape."""
    with (DATA / "retrieval" / "manifest.csv").open() as file:
        return list(csv.DictReader(file))


def require_data() -> None:
    """End where there are no real shapes."""
    if not DATA.is_dir():
        sys.exit(f"real shapes are absent: {DATA} is not a folder (set EIGENSHAPE_DATA)")


def inner_curvature(mesh: es.TriangleMesh) -> np.ndarray:
    """Return the Gaussian curvature; on a boundary, where it is none, the least inside."""
    values, edge = es.geometry.gaussian_curvature(mesh), es.geometry.boundary_vertices(mesh)
    values[edge] = np.delete(values, edge).min()
    return values
