"""The road from a mesh to its descriptor."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from eigenshape._errors import InvalidShapeError
from eigenshape.features.merge_tree import MergeTree, merge_tree
from eigenshape.features.segmentation import FeaturePoints, Segmentation, segment
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_box
from eigenshape.geometry.sampling import MeshPart, partial_scan, viewpoint
from eigenshape.geometry.topology import boundary_edges, is_closed, vertex_components
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.retrieval.descriptor import SCALE_FREE, Recipe, ShapeDescriptor
from eigenshape.spectral.dirichlet import solve_dirichlet
from eigenshape.spectral.outcome import Progress
from eigenshape.spectral.signature import heat_kernel_signature, reflection_free_signature
from eigenshape.spectral.solver import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

N_VIEWS = 4


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


def describe(
    spectrum: Spectrum, features: FeaturePoints, recipe: Recipe = SCALE_FREE, *, dirichlet: Spectrum | None = None
) -> ShapeDescriptor:
    """Describe feature points by the heat that they keep at the recipe's times (thesis 5.3).

    Parameters
    ----------
    spectrum : Spectrum
        Of the whole shape; in a unit box where `recipe.unit` is "box" (the thesis preset).
    features : FeaturePoints
        Of which the first `recipe.n_features`, the most persistent ones, are described.
    recipe : Recipe
    dirichlet : Spectrum, optional
        Of the same shape with its boundary fixed; cancels the reflections of heat at the boundary.

    Returns
    -------
    ShapeDescriptor
    """
    vertices = features.vertices[: recipe.n_features]
    heat = _time_of_one(spectrum, recipe) * _heat(spectrum, dirichlet, recipe.scales, recipe)[vertices]
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
    require_few_pieces(mesh, recipe)
    mesh = normalize_box(mesh) if recipe.unit == "box" else mesh
    laplacian = cotangent_laplacian(mesh)
    spectrum = solve_spectrum(laplacian, min(recipe.n_modes, mesh.n_vertices), progress=progress)
    dirichlet = None if recipe.reflections else _with_boundary_fixed(mesh, laplacian, recipe, progress)
    heat = _heat(spectrum, dirichlet, (recipe.feature_scale,), recipe)[:, 0]
    tree = merge_tree(mesh, heat)
    parts = segment(tree, n_regions=recipe.n_features)
    descriptor = describe(spectrum, parts.features, recipe, dirichlet=dirichlet)
    return DescribedShape(mesh, spectrum, heat, tree, parts, descriptor)


def describe_views(mesh: TriangleMesh, recipe: Recipe = SCALE_FREE, *, n_views: int = N_VIEWS) -> list[ShapeDescriptor]:
    """Describe what single viewpoints see of a closed shape, as partial scans of it will be.

    Parameters
    ----------
    mesh : TriangleMesh
    recipe : Recipe
    n_views : int
        Viewpoints, spread evenly around the shape.

    Returns
    -------
    list of ShapeDescriptor
        With features at vertices of the whole shape; empty for an open one, which is a part already.
    """
    views = [described_view(mesh, recipe, view) for view in range(n_views if is_closed(mesh) else 0)]
    return [replace(seen.descriptor, vertices=part.source_vertices[seen.descriptor.vertices]) for part, seen in views]


def described_view(mesh: TriangleMesh, recipe: Recipe, view: int) -> tuple[MeshPart, DescribedShape]:
    """Return what one of the viewpoints of `describe_views` sees, and its description."""
    part = partial_scan(mesh, viewpoint(view))
    return part, describe_mesh(part.mesh, recipe)


def _with_boundary_fixed(
    mesh: TriangleMesh, laplacian: Laplacian, recipe: Recipe, progress: Progress | None
) -> Spectrum | None:
    """Return the Dirichlet spectrum, None where there is no boundary or nothing inside it."""
    boundary = np.unique(boundary_edges(mesh))
    n_free = mesh.n_vertices - len(boundary)
    if not boundary.size or not n_free:
        return None
    return solve_dirichlet(laplacian, min(recipe.n_modes, n_free), boundary, progress=progress)


def _heat(
    spectrum: Spectrum, dirichlet: Spectrum | None, scales: tuple[float, ...], recipe: Recipe
) -> Float[np.ndarray, "n q"]:
    times = _time_of_one(spectrum, recipe) * recipe.time_unit * np.array(scales)
    if dirichlet is None:
        return heat_kernel_signature(spectrum, times)
    return reflection_free_signature(spectrum, dirichlet, times)


def _time_of_one(spectrum: Spectrum, recipe: Recipe) -> float:
    return float(spectrum.mass.sum()) if recipe.unit == "area" else 1.0


def require_few_pieces(mesh: TriangleMesh, recipe: Recipe) -> None:
    """Refuse a mesh of more components than features.

    Raises
    ------
    InvalidShapeError
        With their number.
    """
    count, _ = vertex_components(mesh)
    if count > recipe.n_features:
        raise InvalidShapeError(
            f"A shape must have at most {recipe.n_features} connected components to be described; it has {count}. "
            "Repair with weld where they touch, or with largest_component."
        )
