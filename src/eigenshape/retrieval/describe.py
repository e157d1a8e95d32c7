"""The road from a mesh to its descriptor."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._errors import InvalidShapeError
from eigenshape.features.merge_tree import MergeTree, merge_tree
from eigenshape.features.segmentation import FeaturePoints, Segmentation, segment
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_box
from eigenshape.geometry.topology import vertex_components
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.retrieval.descriptor import SCALE_FREE, Recipe, ShapeDescriptor
from eigenshape.spectral.signature import heat_kernel_signature
from eigenshape.spectral.solver import Progress, solve_spectrum
from eigenshape.spectral.spectrum import Spectrum


@dataclass(frozen=True, eq=False)
class DescribedShape:
    """A shape with all that was found on the way to its descriptor.

    Attributes
    ----------
    mesh : TriangleMesh
        As it was described: in a unit box where the recipe says so.
    spectrum : Spectrum
    heat : (n,) float
        The heat whose maxima are the features, in 1/length².
    tree : MergeTree
        Of the heat; it can be cut elsewhere without computing anything again.
    parts : Segmentation
        One region around each feature point.
    descriptor : ShapeDescriptor
    """

    mesh: TriangleMesh
    spectrum: Spectrum
    heat: Float[np.ndarray, " n"]
    tree: MergeTree
    parts: Segmentation
    descriptor: ShapeDescriptor


def describe(spectrum: Spectrum, features: FeaturePoints, recipe: Recipe = SCALE_FREE) -> ShapeDescriptor:
    """Describe feature points by the heat that they keep at the recipe's times (thesis 5.3).

    Parameters
    ----------
    spectrum : Spectrum
        Of the whole shape; in a unit box where `recipe.unit` is "box" (the thesis preset).
    features : FeaturePoints
        Of which the first `recipe.n_features`, the most persistent ones, are described.
    recipe : Recipe

    Returns
    -------
    ShapeDescriptor
    """
    vertices = features.vertices[: recipe.n_features]
    unit = _time_of_one(spectrum, recipe)
    heat = unit * _heat(spectrum, recipe.scales, recipe)[vertices]
    return ShapeDescriptor(np.log(heat) if recipe.logarithmic else heat, vertices, recipe)


def describe_mesh(
    mesh: TriangleMesh, recipe: Recipe = SCALE_FREE, *, progress: Progress | None = None
) -> DescribedShape:
    """Walk the whole road: cotangent Laplacian, spectrum, heat, merge tree, parts, descriptor.

    Parameters
    ----------
    mesh : TriangleMesh
        A closed or open surface.
    recipe : Recipe
    progress : callable, optional
        Told of the eigensolver's progress.

    Returns
    -------
    DescribedShape

    Raises
    ------
    InvalidShapeError
        If the mesh falls into more pieces than the recipe has features, or has a face without area or a vertex
        without face.
    """
    _require_few_pieces(mesh, recipe)
    mesh = normalize_box(mesh) if recipe.unit == "box" else mesh
    spectrum = solve_spectrum(cotangent_laplacian(mesh), min(recipe.n_modes, mesh.n_vertices), progress=progress)
    heat = _heat(spectrum, (recipe.feature_scale,), recipe)[:, 0]
    tree = merge_tree(mesh, heat)
    parts = segment(tree, n_regions=recipe.n_features)
    return DescribedShape(mesh, spectrum, heat, tree, parts, describe(spectrum, parts.features, recipe))


def _heat(spectrum: Spectrum, scales: tuple[float, ...], recipe: Recipe) -> Float[np.ndarray, "n q"]:
    times = _time_of_one(spectrum, recipe) * recipe.time_unit * np.array(scales)
    return heat_kernel_signature(spectrum, times)


def _time_of_one(spectrum: Spectrum, recipe: Recipe) -> float:
    return float(spectrum.mass.sum()) if recipe.unit == "area" else 1.0


def _require_few_pieces(mesh: TriangleMesh, recipe: Recipe) -> None:
    count, _ = vertex_components(mesh)
    if count > recipe.n_features:
        raise InvalidShapeError(
            f"A shape must have at most {recipe.n_features} connected components to be described; it has {count}. "
            "Repair with weld where they touch, or with largest_component."
        )
