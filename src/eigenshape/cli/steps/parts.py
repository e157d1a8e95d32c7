"""What the verbs that cut a mesh share: the files that they write, and rows and a table of the parts."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int, UInt8

from eigenshape.cli.console import print_table, print_written
from eigenshape.cli.steps.outputs import require_output, save_like
from eigenshape.features.segmentation import Segmentation
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.registry import WITH_COLORS
from eigenshape.io.labeled_shapes import write_labels
from eigenshape.io.mesh_files import write_mesh
from eigenshape.plot.fields import part_colors
from eigenshape.retrieval.labels.labeled_shape import LabeledShape
from eigenshape.retrieval.labels.transfer import LabelTransfer

LABEL_LISTS = (".seg", ".txt")  # files with one label a line
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


def require_colored_path(path: Path | None) -> None:
    """Raise an error if no mesh with colors can be written to a path, before any work is done."""
    require_output(path, WITH_COLORS, "A mesh with colors")


def require_label_path(path: Path | None) -> None:
    """Raise an error if no labels can be written to a path, before any work is done."""
    require_output(path, (*WITH_COLORS, *LABEL_LISTS), "A mesh with labels")


def save_colors(mesh: TriangleMesh, colors: UInt8[np.ndarray, "n 3"], path: Path) -> None:
    """Write a mesh with its colors, and print so on stderr."""
    write_mesh(mesh, path, colors=colors)
    print_written(path)


def save_labels(
    source: Path,
    mesh: TriangleMesh,
    labels: Int[np.ndarray, " f"],
    colors: UInt8[np.ndarray, "n 3"],
    path: Path,
) -> None:
    """Write labels of faces, with the mesh of a file or alone, and print so on stderr."""
    if path.suffix.lower() in LABEL_LISTS:
        write_labels(labels, path)
        print_written(path)
    else:
        save_like(source, mesh, path, colors=colors, face_labels=labels)


def label_colors(
    mesh: TriangleMesh, labels: Int[np.ndarray, " f"], examples: Sequence[LabeledShape]
) -> UInt8[np.ndarray, "n 3"]:
    """Return colors of the vertices by labels of faces, the same whichever labels of the examples occur."""
    every = np.unique(np.concatenate([shape.labels for shape in examples]))
    return part_colors(mesh, np.searchsorted(every, labels))


def label_rows(
    target: TriangleMesh, found: LabelTransfer, names: Sequence[str]
) -> list[dict[str, Any]]:
    """Return for each labeled part its label, its name, how reliable they are, its area and a vertex."""
    areas = np.bincount(found.parts, weights=face_areas(target))
    return [
        {
            "part": number,
            "label": int(label),
            "name": names[label] if 0 <= label < len(names) else "",
            "confidence": float(found.part_confidence[number]),
            "area_share": float(areas[number] / areas.sum()),
            "vertex": int(found.part_vertices[number]),
            "position": target.vertices[found.part_vertices[number]].tolist(),
        }
        for number, label in enumerate(found.part_labels)
    ]


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
