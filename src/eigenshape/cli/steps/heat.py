"""Heat and its features, for the verbs that show them or cut by them."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from eigenshape._progress import Progress
from eigenshape.cli.steps.parts import save_colors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.plot.fields import value_colors
from eigenshape.retrieval.heat.features import HeatFeatures, find_heat_features
from eigenshape.retrieval.heat.recipe import HeatRecipe
from eigenshape.spectral.signatures.approximate_heat import LARGE, USUAL_ACCURACY


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


def save_heat(mesh: TriangleMesh, heat: Float[np.ndarray, " n"], path: Path) -> None:
    """Write a mesh, colored by the logarithm of its heat."""
    smallest = np.finfo(np.float64).tiny
    save_colors(mesh, value_colors(np.log(np.maximum(heat, smallest))), path)
