"""The road from a mesh of very many vertices to its descriptor: by approximate heat, without a spectrum."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._progress import Progress
from eigenshape.features.region_tree import MergeTree
from eigenshape.features.segmentation import Segmentation
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.boundary import dirichlet_laplacian
from eigenshape.retrieval.heat.describe import (
    clock,
    heat_with_fragments,
    parts_and_descriptor,
    prepare,
)
from eigenshape.retrieval.heat.descriptor import SCALE_FREE, Recipe, ShapeDescriptor
from eigenshape.spectral.signatures.approximate_heat import (
    USUAL_ACCURACY,
    approximate_heat_signature,
)


@dataclass(frozen=True, eq=False)
class DescribedLargeShape:
    """A shape with what was found on the way to its descriptor, by approximate heat.

    Attributes
    ----------
    mesh : TriangleMesh
        As it was described: in a unit box where the recipe says so.
    heat : (n,) float
        The heat whose maxima are the features, in 1/length².
    error : float
        Estimate of what it is off by, root mean square, relative to the heat.
    tree : MergeTree
        Of the heat; it can be cut elsewhere without computing anything again.
    parts : Segmentation
        One region around each feature point: first those that are described, then one for each fragment.
    descriptor : ShapeDescriptor
    fragments : (c,) int
        As of `DescribedShape`.
    """

    mesh: TriangleMesh
    heat: Float[np.ndarray, " n"]
    error: float
    tree: MergeTree
    parts: Segmentation
    descriptor: ShapeDescriptor
    fragments: Int[np.ndarray, " c"]


def describe_large_mesh(
    mesh: MeshLike,
    recipe: Recipe = SCALE_FREE,
    *,
    accuracy: float = USUAL_ACCURACY,
    progress: Progress | None = None,
) -> DescribedLargeShape:
    """Walk the road of `describe_mesh` with `approximate_heat_signature` in place of a spectrum.

    A million vertices take about a minute on one core. Where vertices are few for the recipe's pairs the operator is
    solved as it is, and the result is that of `describe_mesh`.

    Parameters
    ----------
    mesh : MeshLike
        A closed or open surface.
    recipe : Recipe
    accuracy : float
        As of `approximate_heat_signature`.
    progress : callable, optional
        Called as progress(fraction_done, message), twice from 0 to 1 where the boundary is held too.

    Returns
    -------
    DescribedLargeShape

    Raises
    ------
    InvalidShapeError
        As `describe_mesh`.
    """
    mesh = as_mesh(mesh)
    require_type(recipe, Recipe, "recipe")
    shape = prepare(mesh, recipe)
    unit, times = clock(shape.area, recipe)

    def heat_without(points: Int[np.ndarray, " c"]) -> tuple[Float[np.ndarray, "n q"], float]:
        inner, free = dirichlet_laplacian(shape.laplacian, points)
        k = min(shape.n_modes, inner.n_points)
        found = approximate_heat_signature(inner, k, times, accuracy=accuracy, progress=progress)
        columns = np.zeros((shape.mesh.n_vertices, len(times)))
        columns[free] = found.values
        return columns, float(found.errors[0])

    columns, error = heat_without(shape.fragments)
    if len(shape.boundary):
        fixed, fixed_error = heat_without(np.union1d(shape.fragments, shape.boundary))
        columns, error = (columns + fixed) / 2, max(error, fixed_error)
    heat = heat_with_fragments(shape, columns[:, 0])
    found = parts_and_descriptor(shape, heat, columns[:, 1:], recipe, unit)
    return DescribedLargeShape(shape.mesh, heat, error, *found, shape.fragments)
