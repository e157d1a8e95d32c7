"""The road from a mesh of very many vertices to its descriptor: by approximate heat, without a spectrum."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape.features.merge_tree import MergeTree
from eigenshape.features.segmentation import Segmentation
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.boundary import dirichlet_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.retrieval.describe import clock, parts_and_descriptor, prepared
from eigenshape.retrieval.descriptor import SCALE_FREE, Recipe, ShapeDescriptor
from eigenshape.spectral.large_signature import (
    USUAL_ACCURACY,
    ApproximateSignature,
    approximate_heat_kernel_signature,
)
from eigenshape.spectral.outcome import Progress


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
        One region around each feature point.
    descriptor : ShapeDescriptor
    """

    mesh: TriangleMesh
    heat: Float[np.ndarray, " n"]
    error: float
    tree: MergeTree
    parts: Segmentation
    descriptor: ShapeDescriptor


def describe_large_mesh(
    mesh: TriangleMesh,
    recipe: Recipe = SCALE_FREE,
    *,
    accuracy: float = USUAL_ACCURACY,
    progress: Progress | None = None,
) -> DescribedLargeShape:
    """Walk the road of `describe_mesh` with `approximate_heat_kernel_signature` in place of a spectrum.

    A million vertices take about a minute on one core. Where vertices are few for the recipe's pairs the operator is
    solved as it is, and the result is that of `describe_mesh`.

    Parameters
    ----------
    mesh : TriangleMesh
        A closed or open surface.
    recipe : Recipe
    accuracy : float
        As of `approximate_heat_kernel_signature`.
    progress : callable, optional
        Called as progress(fraction_done, message), twice from 0 to 1 where the boundary is held too.

    Returns
    -------
    DescribedLargeShape

    Raises
    ------
    InvalidShapeError
        If the mesh falls into more pieces than the recipe has features, or has a face without area or a vertex
        without face.
    """
    mesh, laplacian, held = prepared(mesh, recipe)
    unit, times = clock(laplacian.mass, recipe)

    def heat_of(operator: Laplacian) -> ApproximateSignature:
        k = min(recipe.n_modes, operator.n_points)
        return approximate_heat_kernel_signature(operator, k, times, accuracy=accuracy, progress=progress)

    found = heat_of(laplacian)
    columns, error = found.values, float(found.errors[0])
    if len(held):
        inner, free = dirichlet_laplacian(laplacian, held)
        fixed = heat_of(inner)
        columns, error = columns / 2, max(error, float(fixed.errors[0]))
        columns[free] += fixed.values / 2
    heat = columns[:, 0]
    return DescribedLargeShape(mesh, heat, error, *parts_and_descriptor(mesh, heat, columns[:, 1:], recipe, unit))
