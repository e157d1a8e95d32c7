"""The road from a mesh to its descriptor."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import frozen, vertex_values
from eigenshape._progress import Progress
from eigenshape._typing import ArrayLike
from eigenshape.features.merge_tree import merge_tree
from eigenshape.features.region_tree import MergeTree
from eigenshape.features.segmentation import FeaturePoints, Segmentation, segment
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.fragments import fragment_vertices
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_box
from eigenshape.geometry.requirements import require_describable
from eigenshape.geometry.topology import boundary_edges, vertex_components
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.retrieval.heat.descriptor import SCALE_FREE, Recipe, ShapeDescriptor
from eigenshape.scans.partial import MeshPart, partial_scan, viewpoint, views_of
from eigenshape.spectral.signatures.heat import heat_kernel_signature, reflection_free_signature
from eigenshape.spectral.solve import solve_spectrum
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
        With zeros on fragments, whose pairs are left out.
    heat : (n,) float
        The heat whose maxima are the features, in 1/length², or the function that was given in its place.
    tree : MergeTree
        Of that function; it can be cut elsewhere without computing anything again.
    parts : Segmentation
        One region around each feature point: first those that are described, then one for each fragment.
    descriptor : ShapeDescriptor
    fragments : (c,) int
        Vertices of fragments, which have no features: components with less than a hundredth of the area
        (`fragment_vertices`).
    """

    mesh: TriangleMesh
    spectrum: Spectrum
    heat: Float[np.ndarray, " n"]
    tree: MergeTree
    parts: Segmentation
    descriptor: ShapeDescriptor
    fragments: Int[np.ndarray, " c"]


def describe(
    spectrum: Spectrum,
    features: FeaturePoints,
    recipe: Recipe = SCALE_FREE,
    *,
    dirichlet: Spectrum | None = None,
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
    require_type(spectrum, Spectrum, "spectrum")
    require_type(features, FeaturePoints, "features")
    require_type(recipe, Recipe, "recipe")
    require_type(dirichlet, Spectrum | None, "dirichlet")
    unit, times = clock(float(spectrum.mass.sum()), recipe)
    return _descriptor(
        _heat(spectrum, dirichlet, times[1:]), features.vertices[: recipe.n_features], recipe, unit
    )


def describe_mesh(
    mesh: MeshLike,
    recipe: Recipe = SCALE_FREE,
    *,
    values: ArrayLike | None = None,
    progress: Progress | None = None,
) -> DescribedShape:
    """Walk the whole road: cotangent Laplacian, spectrum, heat, merge tree, parts, descriptor.

    The features are the persistent maxima of heat, or of another function of the vertices; either way they are
    described by the heat that they keep. Thesis table 5.4 tries `average_geodesic_distance` and `gaussian_curvature`.

    Each component has a feature at least, so there are as many as components where these are more than the recipe's
    features. A fragment of less than a hundredth of the area has none: at the recipe's times it has come to one
    temperature, 1 over its own area, which tells nothing of its form.

    Parameters
    ----------
    mesh : MeshLike
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
        If the mesh has a face without area or twice or a vertex without face, or is a soup, whose faces lie edge on
        edge without sharing vertices.
    InvalidParameterError
        If `values` are not one finite number a vertex.
    """
    mesh = as_mesh(mesh)
    require_type(recipe, Recipe, "recipe")
    height = None if values is None else vertex_values(values, "values", mesh.n_vertices)
    shape = prepare(mesh, recipe)

    def spectrum_without(points: Int[np.ndarray, " c"]) -> Spectrum:
        n_free = shape.mesh.n_vertices - len(points)
        n_modes = min(shape.n_modes, n_free)
        return solve_spectrum(shape.laplacian, n_modes, fixed=points, progress=progress)

    spectrum = spectrum_without(shape.fragments)
    fixed = (
        spectrum_without(np.union1d(shape.fragments, shape.boundary))
        if len(shape.boundary)
        else None
    )
    unit, times = clock(shape.area, recipe)
    later = _heat(spectrum, fixed, times[1:])
    if height is None:
        height = heat_with_fragments(shape, _heat(spectrum, fixed, times[:1])[:, 0])
    found = parts_and_descriptor(shape, height, later, recipe, unit)
    return DescribedShape(shape.mesh, spectrum, height, *found, shape.fragments)


def describe_views(
    mesh: MeshLike, recipe: Recipe = SCALE_FREE, *, n_views: int = N_VIEWS
) -> list[ShapeDescriptor]:
    """Describe what single viewpoints see of a closed shape, as partial scans of it will be.

    Parameters
    ----------
    mesh : MeshLike
    recipe : Recipe
    n_views : int
        Viewpoints, spread evenly around the shape.

    Returns
    -------
    list of ShapeDescriptor
        With features at vertices of the whole shape; empty for an open one, which is a part already.
    """
    mesh = as_mesh(mesh)
    require_type(recipe, Recipe, "recipe")
    seen = [(part, describe_mesh(part.mesh, recipe).descriptor) for part in views_of(mesh, n_views)]
    return [replace(found, vertices=part.source_vertices[found.vertices]) for part, found in seen]


def described_view(
    mesh: TriangleMesh, recipe: Recipe, view: int
) -> tuple[MeshPart, DescribedShape]:
    """Return what one of the viewpoints of `describe_views` sees, and its description."""
    part = partial_scan(mesh, viewpoint(view))
    return part, describe_mesh(part.mesh, recipe)


def _heat(
    spectrum: Spectrum, dirichlet: Spectrum | None, times: Float[np.ndarray, " q"]
) -> Float[np.ndarray, "n q"]:
    if dirichlet is None:
        return heat_kernel_signature(spectrum, times)
    return reflection_free_signature(spectrum, dirichlet, times)


@dataclass(frozen=True, eq=False)
class PreparedShape:
    """A shape as a recipe takes it.

    Attributes
    ----------
    mesh : TriangleMesh
    laplacian : Laplacian
    boundary : (c,) int
        Vertices of the boundary of whose reflections to free heat: none where the recipe lets it throw heat back, or
        where nothing lies inside.
    fragments : (c,) int
        Vertices of `fragment_vertices`.
    n_components : int
        Others than fragments.
    area : float
        Without fragments, in length².
    n_modes : int
        Eigenpairs to take: those of the recipe, and one for each further component.
    """

    mesh: TriangleMesh
    laplacian: Laplacian
    boundary: Int[np.ndarray, " b"]
    fragments: Int[np.ndarray, " c"]
    n_components: int
    area: float
    n_modes: int


def prepare(mesh: TriangleMesh, recipe: Recipe) -> PreparedShape:
    """Put a mesh into the box of its recipe, build its operator, and find its boundary and fragments."""
    require_describable(mesh)
    mesh = normalize_box(mesh) if recipe.unit == "box" else mesh
    laplacian = cotangent_laplacian(mesh)
    fragments = fragment_vertices(mesh)
    _, labels = vertex_components(mesh)
    n_components = len(np.unique(np.delete(labels, fragments)))
    boundary = np.setdiff1d(boundary_edges(mesh), fragments)
    loose = recipe.reflections or len(boundary) + len(fragments) == mesh.n_vertices
    if loose:
        boundary = boundary[:0]
    area = float(laplacian.mass.sum()) - float(laplacian.mass.diagonal()[fragments].sum())
    return PreparedShape(
        mesh, laplacian, boundary, fragments, n_components, area, recipe.n_modes + n_components - 1
    )


def heat_with_fragments(
    shape: PreparedShape, heat: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Give each fragment the heat of a body that has come to one temperature: 1 over its area."""
    if not len(shape.fragments):
        return heat
    _, labels = vertex_components(shape.mesh)
    areas = np.bincount(labels, weights=shape.laplacian.mass.diagonal())
    heat = heat.copy()
    heat[shape.fragments] = 1 / areas[labels[shape.fragments]]
    return heat


def clock(area: float, recipe: Recipe) -> tuple[float, Float[np.ndarray, " q"]]:
    """Return what a time of 1 means, and the time of the heat that finds features before those that describe them.

    All in length².
    """
    unit = area if recipe.unit == "area" else 1.0
    return unit, unit * recipe.time_unit * np.array([recipe.feature_scale, *recipe.scales])


def parts_and_descriptor(
    shape: PreparedShape,
    heat: Float[np.ndarray, " n"],
    later: Float[np.ndarray, "n q"],
    recipe: Recipe,
    unit: float,
) -> tuple[MergeTree, Segmentation, ShapeDescriptor]:
    """Cut a shape around the maxima of heat, and describe those that are not on fragments by what they keep later."""
    tree = merge_tree(shape.mesh, heat)
    on_fragments = int(np.isin(tree.maxima, shape.fragments).sum())
    parts = segment(tree, n_regions=recipe.n_features + on_fragments)
    last = np.isin(parts.features.vertices, shape.fragments)
    parts = _reordered(parts, np.argsort(last, kind="stable"))
    n_described = max(recipe.n_features, shape.n_components)
    described = parts.features.vertices[: min(n_described, int((~last).sum()))]
    return tree, parts, _descriptor(later, described, recipe, unit)


def _reordered(parts: Segmentation, order: Int[np.ndarray, " m"]) -> Segmentation:
    features, number = parts.features, np.argsort(order)
    columns = (features.vertices, features.values, features.persistence)
    return Segmentation(
        frozen(number[parts.labels]), FeaturePoints(*(frozen(column[order]) for column in columns))
    )


def _descriptor(
    heat: Float[np.ndarray, "n q"], vertices: Int[np.ndarray, " m"], recipe: Recipe, unit: float
) -> ShapeDescriptor:
    kept = unit * heat[vertices]
    return ShapeDescriptor(np.log(kept) if recipe.logarithmic else kept, vertices, recipe)
