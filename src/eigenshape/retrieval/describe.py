"""The road from a mesh to its descriptor."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from eigenshape._arrays import vertex_values
from eigenshape._errors import InvalidShapeError
from eigenshape.features.merge_tree import MergeTree, merge_tree
from eigenshape.features.segmentation import FeaturePoints, Segmentation, segment
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_box
from eigenshape.geometry.sampling import MeshPart, partial_scan, viewpoint, views_of
from eigenshape.geometry.topology import boundary_edges, vertex_components
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
        The heat whose maxima are the features, in 1/length², or the function that was given in its place.
    tree : MergeTree
        Of that function; it can be cut elsewhere without computing anything again.
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
    unit, times = clock(spectrum.mass, recipe)
    return _descriptor(_heat(spectrum, dirichlet, times[1:]), features, recipe, unit)


def describe_mesh(
    mesh: TriangleMesh,
    recipe: Recipe = SCALE_FREE,
    *,
    values: ArrayLike | None = None,
    progress: Progress | None = None,
) -> DescribedShape:
    """Walk the whole road: cotangent Laplacian, spectrum, heat, merge tree, parts, descriptor.

    The features are the persistent maxima of heat, or of another function of the vertices; either way they are
    described by the heat that they keep. Thesis table 5.4 tries `average_geodesic_distance` and `gaussian_curvature`.

    Parameters
    ----------
    mesh : TriangleMesh
        A closed or open surface.
    recipe : Recipe
    values : (n,) float, optional
        The function whose maxima are the features, in place of heat; only its order and its differences count.
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
    InvalidParameterError
        If `values` are not one finite number a vertex.
    """
    height = None if values is None else vertex_values(values, "values", mesh.n_vertices)
    mesh, laplacian, held = prepared(mesh, recipe)
    spectrum = solve_spectrum(laplacian, min(recipe.n_modes, mesh.n_vertices), progress=progress)
    n_free = mesh.n_vertices - len(held)
    fixed = solve_dirichlet(laplacian, min(recipe.n_modes, n_free), held, progress=progress) if len(held) else None
    unit, times = clock(laplacian.mass, recipe)
    later = _heat(spectrum, fixed, times[1:])
    if height is None:
        height = _heat(spectrum, fixed, times[:1])[:, 0]
    return DescribedShape(mesh, spectrum, height, *parts_and_descriptor(mesh, height, later, recipe, unit))


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
    seen = [(part, describe_mesh(part.mesh, recipe).descriptor) for part in views_of(mesh, n_views)]
    return [replace(found, vertices=part.source_vertices[found.vertices]) for part, found in seen]


def described_view(mesh: TriangleMesh, recipe: Recipe, view: int) -> tuple[MeshPart, DescribedShape]:
    """Return what one of the viewpoints of `describe_views` sees, and its description."""
    part = partial_scan(mesh, viewpoint(view))
    return part, describe_mesh(part.mesh, recipe)


def _heat(spectrum: Spectrum, dirichlet: Spectrum | None, times: Float[np.ndarray, " q"]) -> Float[np.ndarray, "n q"]:
    if dirichlet is None:
        return heat_kernel_signature(spectrum, times)
    return reflection_free_signature(spectrum, dirichlet, times)


def prepared(mesh: TriangleMesh, recipe: Recipe) -> tuple[TriangleMesh, Laplacian, Int[np.ndarray, " c"]]:
    """Return a mesh as the recipe takes it, its operator, and the boundary of whose reflections to free heat.

    There is none where the recipe lets it throw heat back, or where nothing lies inside.

    Raises
    ------
    InvalidShapeError
        If there are more components than features, with their number.
    """
    count, _ = vertex_components(mesh)
    if count > recipe.n_features:
        raise InvalidShapeError(
            f"A shape must have at most {recipe.n_features} connected components to be described; it has {count}. "
            "Repair with weld where they touch, or with largest_component."
        )
    mesh = normalize_box(mesh) if recipe.unit == "box" else mesh
    boundary = np.unique(boundary_edges(mesh))
    loose = recipe.reflections or len(boundary) == mesh.n_vertices
    return mesh, cotangent_laplacian(mesh), boundary[:0] if loose else boundary


def clock(mass: sp.csr_array, recipe: Recipe) -> tuple[float, Float[np.ndarray, " q"]]:
    """Return what a time of 1 means, and the time of the heat that finds features before those that describe them.

    All in length².
    """
    unit = float(mass.sum()) if recipe.unit == "area" else 1.0
    return unit, unit * recipe.time_unit * np.array([recipe.feature_scale, *recipe.scales])


def parts_and_descriptor(
    mesh: TriangleMesh, heat: Float[np.ndarray, " n"], later: Float[np.ndarray, "n q"], recipe: Recipe, unit: float
) -> tuple[MergeTree, Segmentation, ShapeDescriptor]:
    """Cut a shape around the maxima of heat, and describe them by what they keep later."""
    tree = merge_tree(mesh, heat)
    parts = segment(tree, n_regions=recipe.n_features)
    return tree, parts, _descriptor(later, parts.features, recipe, unit)


def _descriptor(
    heat: Float[np.ndarray, "n q"], features: FeaturePoints, recipe: Recipe, unit: float
) -> ShapeDescriptor:
    vertices = features.vertices[: recipe.n_features]
    kept = unit * heat[vertices]
    return ShapeDescriptor(np.log(kept) if recipe.logarithmic else kept, vertices, recipe)
