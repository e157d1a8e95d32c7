"""The road from a mesh of very many vertices to its descriptor: by approximate heat, without a spectrum."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape.features.merge_tree import MergeTree, merge_tree
from eigenshape.features.segmentation import Segmentation, segment
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_box
from eigenshape.geometry.topology import boundary_edges
from eigenshape.operators.boundary import dirichlet_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.retrieval.describe import require_few_pieces
from eigenshape.retrieval.descriptor import SCALE_FREE, Recipe, ShapeDescriptor
from eigenshape.spectral.large_signature import approximate_heat_kernel_signature
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
    mesh: TriangleMesh, recipe: Recipe = SCALE_FREE, *, progress: Progress | None = None
) -> DescribedLargeShape:
    """Walk the road of `describe_mesh` with `approximate_heat_kernel_signature` in place of a spectrum.

    A million vertices take about a minute on one core. Up to three times as many vertices as coarse functions the
    operator is solved as it is, and the result is that of `describe_mesh`.

    Parameters
    ----------
    mesh : TriangleMesh
        A closed or open surface.
    recipe : Recipe
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
    require_few_pieces(mesh, recipe)
    mesh = normalize_box(mesh) if recipe.unit == "box" else mesh
    laplacian = cotangent_laplacian(mesh)
    unit = float(laplacian.mass.sum()) if recipe.unit == "area" else 1.0
    times = unit * recipe.time_unit * np.array([recipe.feature_scale, *recipe.scales])
    columns, error = _heat(mesh, laplacian, recipe, times, progress)
    tree = merge_tree(mesh, columns[:, 0])
    parts = segment(tree, n_regions=recipe.n_features)
    vertices = parts.features.vertices[: recipe.n_features]
    kept = unit * columns[vertices, 1:]
    descriptor = ShapeDescriptor(np.log(kept) if recipe.logarithmic else kept, vertices, recipe)
    return DescribedLargeShape(mesh, columns[:, 0], error, tree, parts, descriptor)


def _heat(
    mesh: TriangleMesh,
    laplacian: Laplacian,
    recipe: Recipe,
    times: Float[np.ndarray, " q"],
    progress: Progress | None,
) -> tuple[Float[np.ndarray, "n q"], float]:
    """Return the heat, free of reflections where the recipe says so, and the larger error of the first column."""
    k = min(recipe.n_modes, mesh.n_vertices)
    found = approximate_heat_kernel_signature(laplacian, k, times, progress=progress)
    boundary = np.unique(boundary_edges(mesh))
    if recipe.reflections or not 0 < len(boundary) < mesh.n_vertices:
        return found.values, float(found.errors[0])
    inner, free = dirichlet_laplacian(laplacian, boundary)
    held = approximate_heat_kernel_signature(inner, min(recipe.n_modes, len(free)), times, progress=progress)
    mean = found.values / 2
    mean[free] += held.values / 2
    return mean, float(max(found.errors[0], held.errors[0]))
