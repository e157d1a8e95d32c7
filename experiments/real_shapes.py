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


def labeled_shapes() -> list[tuple[str, str, Path]]:
    """List name, class and file of the shapes whose faces have names, by class and number."""
    found = [(row["cls"], Path(row["path"])) for row in manifest()]
    labeled = [
        (cls, path) for cls, path in found if (DATA / "parts" / f"{cls}-{path.stem}.npy").exists()
    ]
    labeled.sort(key=lambda one: (one[0], int(one[1].stem.removeprefix("psb"))))
    return [(f"{cls}-{path.stem}", cls, DATA / path) for cls, path in labeled]


def first_members(n: int) -> set[str]:
    """Return the names of the first n labeled shapes of each class."""
    members: dict[str, list[str]] = {}
    for name, cls, _ in labeled_shapes():
        members.setdefault(cls, []).append(name)
    return {name for names in members.values() for name in names[:n]}


def require_data() -> None:
    """End where there are no real shapes."""
    if not DATA.is_dir():
        sys.exit(f"real shapes are absent: {DATA} is not a folder (set EIGENSHAPE_DATA)")


def inner_curvature(mesh: es.TriangleMesh) -> np.ndarray:
    """Return the Gaussian curvature; on a boundary, where it is none, the least inside."""
    values, edge = es.geometry.gaussian_curvature(mesh), es.geometry.boundary_vertices(mesh)
    values[edge] = np.delete(values, edge).min()
    return values
