"""The parts of a mesh by each method of `segment`."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from eigenshape._progress import Progress
from eigenshape.cli.inputs import PARTS
from eigenshape.cli.steps.heat import count_fragments
from eigenshape.cli.steps.parts import part_rows
from eigenshape.features.boundaries import smooth_boundaries
from eigenshape.features.contrast import PART_CONTRAST
from eigenshape.features.parts import find_parts, smooth_cut
from eigenshape.features.segmentation import Segmentation, Tree, merge_targets
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_closed_outward
from eigenshape.retrieval.heat.features import find_heat_features
from eigenshape.retrieval.heat.recipe import PRESETS


def find_tree(
    surface: TriangleMesh, method: str, progress: Progress
) -> tuple[Tree, dict[str, Any], Callable[[Segmentation], Segmentation]]:
    """Return the tree of a method, its default cut, and the function that smooths boundaries.

    Fragments are not counted as parts. Boundaries follow creases whichever way the faces of a
    closed mesh are turned.
    """
    if method == PARTS:
        found = find_parts(surface, progress=progress)
        return found.tree, {"persistence": PART_CONTRAST}, partial(smooth_cut, found)
    shape = find_heat_features(surface, PRESETS[method], progress=progress)
    n_fragments = count_fragments(shape)
    default = {"n_regions": PRESETS[method].n_features + n_fragments}
    return shape.tree, default, partial(smooth_boundaries, orient_closed_outward(surface))


def segment_rows(surface: TriangleMesh, tree: Tree, parts: Segmentation) -> list[dict[str, Any]]:
    """Return for each part the row of `part_rows`, its number of faces, and the part that it splits from."""
    faces, into = np.bincount(parts.labels), merge_targets(tree)
    return [
        {
            "part": number,
            **row,
            "faces": int(faces[number]),
            "splits_from": int(into[number]) if into[number] >= 0 else None,
        }
        for number, row in enumerate(part_rows(surface, parts))
    ]
