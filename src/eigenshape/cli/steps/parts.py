"""What the verbs that cut a mesh compute and print of its parts."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Int

from certeig.kit.progress import Progress
from eigenshape.cli.console import print_table
from eigenshape.cli.steps.recipes import PRESETS
from eigenshape.deformation.region_patches import regions_of_patches
from eigenshape.features.boundaries import smooth_boundaries
from eigenshape.features.contrast import PART_CONTRAST
from eigenshape.features.parts import find_parts
from eigenshape.features.region_tree import MergeTree, PartTree
from eigenshape.features.segmentation import Segmentation
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_closed_outward
from eigenshape.retrieval.heat.features import HeatFeatures, find_heat_features
from eigenshape.retrieval.heat.recipe import HeatRecipe
from eigenshape.spectral.signatures.approximate_heat import LARGE, USUAL_ACCURACY

__all__ = ["regions_of_patches"]  # for the verbs, as it is, beside what is defined here


def find_features(
    mesh: TriangleMesh, recipe: HeatRecipe, accuracy: float | None, progress: Progress
) -> HeatFeatures:
    """Find the features of a mesh. Without an accuracy, heat is approximate on large meshes only."""
    if accuracy is None and mesh.n_vertices > LARGE:
        accuracy = USUAL_ACCURACY
    return find_heat_features(mesh, recipe, accuracy=accuracy, progress=progress)


def count_fragments(shape: HeatFeatures) -> int:
    """Return how many parts are fragments, which have no feature point and are not counted as parts."""
    return int(np.isin(shape.tree.maxima, shape.fragments).sum())


def find_tree(
    surface: TriangleMesh, method: str, progress: Progress
) -> tuple[MergeTree | PartTree, dict[str, Any], Callable[[Segmentation], Segmentation]]:
    """Return the tree of a method, its default cut, and the function that smooths boundaries.

    Fragments are not counted as parts. Boundaries follow creases whichever way the faces of a
    closed mesh are turned.
    """
    if method == "parts":
        found = find_parts(surface, progress=progress)
        return found.tree, {"persistence": PART_CONTRAST}, found.smooth
    shape = find_heat_features(surface, PRESETS[method], progress=progress)
    default = {"n_regions": PRESETS[method].n_features + count_fragments(shape)}
    return shape.tree, default, partial(smooth_boundaries, orient_closed_outward(surface))


def area_shares(mesh: TriangleMesh, labels: Int[np.ndarray, " f"]) -> list[float]:
    """Return the share of the area that each label has."""
    areas = np.bincount(labels, weights=face_areas(mesh))
    return (areas / areas.sum()).tolist()


def part_rows(mesh: TriangleMesh, parts: Segmentation) -> list[dict[str, Any]]:
    """Return for each part its feature point, where that lies, its share of the area and its persistence."""
    shares = area_shares(mesh, parts.labels)
    return [
        {
            "vertex": int(vertex),
            "position": mesh.vertices[vertex].tolist(),
            "area_share": shares[number],
            "persistence": float(parts.features.persistence[number]),
        }
        for number, vertex in enumerate(parts.features.vertices)
    ]


def print_rows(title: str, columns: dict[str, str], rows: list[dict[str, Any]]) -> None:
    """Print rows as a table: under each heading the entry that it names."""
    texts = [[_shown(key, row[key]) for key in columns.values()] for row in rows]
    print_table(title, list(columns), texts)


def _shown(key: str, value: Any) -> str:
    if key == "area_share":
        return f"{100 * value:.1f} %"
    if key == "confidence":
        return f"{100 * value:.0f} %"
    if key == "persistence" and np.isinf(value):
        return "never merges"
    if isinstance(value, list):
        return "  ".join(f"{coordinate:.4g}" for coordinate in value)
    if value is None:
        return "none"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
