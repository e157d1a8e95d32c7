"""What the verbs that cut a mesh share: the files asked for, and rows and a table of the parts."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int, UInt8

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import print_table, print_written
from eigenshape.cli.outputs import require_mesh_path
from eigenshape.features.segmentation import Segmentation
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.mesh_files import write_mesh
from eigenshape.plot.save import require_picture_path

SHOWN: dict[str, Callable[[Any], str]] = {
    "position": lambda place: "  ".join(f"{coordinate:.4g}" for coordinate in place),
    "heat": lambda heat: f"{heat:.4g}",
    "area_share": lambda share: f"{100 * share:.1f} %",
    "confidence": lambda share: f"{100 * share:.0f} %",
    "splits_from": lambda part: "none" if part is None else str(part),
    "persistence": lambda persistence: (
        "never merges" if np.isinf(persistence) else f"{persistence:.4g}"
    ),
}


def require_paths(picture: Path | None, colored: Path | None, labels: Path | None = None) -> None:
    """Refuse a path that no picture, mesh in colours or labels can be written to, before any work is done."""
    if picture:
        require_picture_path(picture)
    if colored and colored.suffix.lower() != ".ply":
        raise InvalidParameterError(
            f"Colours go to a .ply file; {colored} ends in {colored.suffix!r}."
        )
    require_mesh_path(colored)
    if labels and not labels.absolute().parent.is_dir():
        raise InvalidParameterError(
            f"Labels need a folder to lie in; {labels.absolute().parent} is not there."
        )


def save_colors(
    mesh: TriangleMesh,
    colors: UInt8[np.ndarray, "n 3"],
    path: Path,
    face_labels: Int[np.ndarray, " f"] | None = None,
) -> None:
    """Write a mesh with its colors, and its labels if there are any, and say so on stderr."""
    write_mesh(mesh, path, colors=colors, face_labels=face_labels)
    print_written(path)


def part_rows(mesh: TriangleMesh, parts: Segmentation) -> list[dict[str, Any]]:
    """Return for each part its feature point, where that lies, its share of the area and its persistence."""
    areas, points = np.bincount(parts.labels, weights=face_areas(mesh)), parts.features
    return [
        {
            "vertex": int(vertex),
            "position": mesh.vertices[vertex].tolist(),
            "area_share": float(areas[number] / areas.sum()),
            "persistence": float(points.persistence[number]),
        }
        for number, vertex in enumerate(points.vertices)
    ]


def print_rows(title: str, columns: dict[str, str], rows: list[dict[str, Any]]) -> None:
    """Print rows as a table: under each heading the entry that it names."""
    print_table(
        title,
        list(columns),
        [[SHOWN.get(key, str)(row[key]) for key in columns.values()] for row in rows],
    )
