"""Feature points of a mesh, and the heat descriptor that they carry."""

from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import ReadOnly, freeze, vertex_values
from eigenshape._progress import Progress
from eigenshape._text import html_repr, short_repr
from eigenshape._threads import map_in_threads
from eigenshape._typing import ArrayLike
from eigenshape.features.merge_tree import merge_tree
from eigenshape.features.region_tree import MergeTree
from eigenshape.features.segmentation import FeaturePoints, Segmentation, segment
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_mesh
from eigenshape.geometry.repairs.fragments import fragment_vertices
from eigenshape.geometry.requirements import require_describable
from eigenshape.geometry.topology import boundary_edges, vertex_components
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian, dirichlet_laplacian
from eigenshape.retrieval.heat.descriptor import HeatDescriptor
from eigenshape.retrieval.heat.recipe import SCALE_FREE, HeatRecipe
from eigenshape.scans.partial import MeshPart, view_of, views_of
from eigenshape.spectral.signatures.approximate_heat import approximate_heat_signature
from eigenshape.spectral.signatures.heat import heat_kernel_signature, reflection_free_signature
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

# Viewpoints from which a closed shape is described beside the whole. Each costs one more
# description and one more descriptor in the index.
N_VIEWS = 4


@dataclass(frozen=True, eq=False)
class HeatFeatures(ReadOnly):
    """Feature points of a mesh, with everything that was computed to find and describe them.

    Attributes
    ----------
    mesh : TriangleMesh
        The mesh that was described: scaled to a unit box if `recipe.unit` is "box".
    spectrum : Spectrum or None
        Certified eigenpairs, zero on fragments; None if heat was approximated.
    heat : (n,) float
        The function whose maxima are the features: heat in 1/length², or the given `values`.
    error : float or None
        Estimated relative error of the heat, root mean square; None if a spectrum was solved.
    tree : MergeTree
        Merge tree of `heat`. Cut it elsewhere with `segment` without computing anything again.
    parts : Segmentation
        One region for each feature point: first those of the descriptor, then one for each
        fragment.
    descriptor : HeatDescriptor
    fragments : (c,) int
        Vertices of components with less than 1 % of the area. They carry no features.

    See Also
    --------
    find_heat_features

    Examples
    --------
    The tree can be cut again, for more or fewer features:

    >>> import eigenshape as es
    >>> found = es.retrieval.find_heat_features(es.make_creature("fish", n_vertices=500))
    >>> found.heat.shape
    (500,)
    >>> len(es.segment(found.tree, n_regions=3).features.vertices)
    3
    """

    mesh: TriangleMesh
    spectrum: Spectrum | None
    heat: Float[np.ndarray, " n"]
    error: float | None
    tree: MergeTree
    parts: Segmentation
    descriptor: HeatDescriptor
    fragments: Int[np.ndarray, " c"]

    __repr__ = short_repr
    _repr_html_ = html_repr


def heat_descriptor(
    spectrum: Spectrum,
    features: FeaturePoints,
    recipe: HeatRecipe = SCALE_FREE,
    *,
    dirichlet: Spectrum | None = None,
) -> HeatDescriptor:
    """Describe given feature points by the heat that they keep at the times of a recipe.

    The vector of a feature point x is h(x, x, t) at the times t of the recipe (thesis 5.3). Use
    this for features that you found yourself; `describe` finds and describes them in one call.

    Parameters
    ----------
    spectrum : Spectrum
        Of the whole shape, scaled to a unit box if `recipe.unit` is "box".
    features : FeaturePoints
        The first `recipe.n_features` of them, the most persistent ones, are described.
    recipe : HeatRecipe
    dirichlet : Spectrum, optional
        Of the same shape with its boundary fixed. The mean of the two heats is used, which cancels
        what the boundary reflects.

    Returns
    -------
    HeatDescriptor

    See Also
    --------
    find_heat_features, describe

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.make_creature("fish", n_vertices=500)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), k=50)
    >>> heat = es.heat_kernel_signature(spectrum, [0.01])
    >>> features = es.segment(es.merge_tree(mesh, heat[:, 0]), n_regions=4).features
    >>> es.retrieval.heat_descriptor(spectrum, features).vectors.shape
    (4, 15)
    """
    require_type(spectrum, Spectrum, "spectrum")
    require_type(features, FeaturePoints, "features")
    require_type(recipe, HeatRecipe, "recipe")
    require_type(dirichlet, Spectrum | None, "dirichlet")
    unit, times = _unit_and_times(float(spectrum.mass.sum()), recipe)
    heat = _heat(spectrum, dirichlet, times[1:])
    return _descriptor(heat, features.vertices[: recipe.n_features], recipe, unit)


def find_heat_features(
    mesh: MeshLike,
    recipe: HeatRecipe = SCALE_FREE,
    *,
    values: ArrayLike | None = None,
    accuracy: float | None = None,
    progress: Progress | None = None,
) -> HeatFeatures:
    """Find the persistent maxima of heat on a mesh, and describe them by the heat that they keep.

    The steps are: cotangent Laplacian, spectrum, heat, merge tree, parts, descriptor (thesis 5.3).
    `describe` returns the descriptor alone.

    Each component carries at least one feature, so a mesh with more components than
    `recipe.n_features` has one for each. Fragments (components with less than 1 % of the area)
    carry none: at the times of the recipe their heat is constant, 1 / area, whatever their form.

    Parameters
    ----------
    mesh : MeshLike
        A closed or open surface with n vertices.
    recipe : HeatRecipe
    values : (n,) float, optional
        Take the maxima of this function as features, instead of those of heat. They are still
        described by heat. Thesis table 5.4 tries `average_geodesic_distance` and
        `gaussian_curvature`.
    accuracy : float, optional
        Approximate heat to this relative error, 0.0001 to 0.1, instead of solving a spectrum
        (`approximate_heat_signature`). A million vertices then take about half a minute on one
        core with 0.01. A mesh with few vertices for the eigenpairs of the recipe is solved anyway.
    progress : callable, optional
        Called as progress(fraction_done, message); twice from 0 to 1 for a mesh with a boundary.

    Returns
    -------
    HeatFeatures

    Raises
    ------
    InvalidShapeError
        If a face has no area or occurs twice, a vertex has no face, or the mesh is a soup (faces
        lie edge on edge without sharing vertices).
    InvalidParameterError
        If `values` are not n finite numbers, or `accuracy` is out of range.

    See Also
    --------
    describe, heat_descriptor, find_parts

    Examples
    --------
    >>> import eigenshape as es
    >>> found = es.retrieval.find_heat_features(es.make_creature("fish", n_vertices=500))
    >>> found.descriptor.vectors.shape
    (15, 15)
    >>> bool((found.descriptor.vertices == found.parts.features.vertices).all())
    True
    """
    mesh = as_mesh(mesh)
    require_type(recipe, HeatRecipe, "recipe")
    height = None if values is None else vertex_values(values, "values", mesh.n_vertices)
    shape = _prepare(mesh, recipe)
    unit, times = _unit_and_times(shape.area, recipe)
    if accuracy is None:
        heat = _certified_heat(shape, times, progress)
    else:
        heat = _approximate_heat(shape, times, accuracy, progress)
    if height is None:
        height = _with_heat_of_fragments(shape, heat.first)

    # Cut the shape around the maxima, and put the regions of fragments last.
    tree = merge_tree(shape.mesh, height)
    n_fragments = int(np.isin(tree.maxima, shape.fragments).sum())
    parts = segment(tree, n_regions=recipe.n_features + n_fragments)
    on_fragment = np.isin(parts.features.vertices, shape.fragments)
    parts = _reorder_parts(parts, np.argsort(on_fragment, kind="stable"))

    n_described = min(max(recipe.n_features, shape.n_components), int((~on_fragment).sum()))
    descriptor = _descriptor(heat.later, parts.features.vertices[:n_described], recipe, unit)
    return HeatFeatures(
        mesh=shape.mesh,
        spectrum=heat.spectrum,
        heat=height,
        error=heat.error,
        tree=tree,
        parts=parts,
        descriptor=descriptor,
        fragments=shape.fragments,
    )


def describe_views(mesh: TriangleMesh, recipe: HeatRecipe, n_views: int) -> list[HeatDescriptor]:
    """Describe what single viewpoints see of a closed shape, with features at its own vertices.

    Return nothing for an open shape, which is a part already.
    """
    return map_in_threads(partial(_describe_view, recipe), views_of(mesh, n_views))


def _describe_view(recipe: HeatRecipe, part: MeshPart) -> HeatDescriptor:
    descriptor = find_heat_features(part.mesh, recipe).descriptor
    return replace(descriptor, vertices=part.source_vertices[descriptor.vertices])


def find_view_features(
    mesh: TriangleMesh, recipe: HeatRecipe, view: int
) -> tuple[MeshPart, HeatFeatures]:
    """Return what one of the viewpoints of `describe_views` sees, and its features."""
    part = view_of(mesh, view)
    return part, find_heat_features(part.mesh, recipe)


@dataclass(frozen=True, eq=False)
class _PreparedShape:
    """A shape with what a recipe asks of it.

    Attributes
    ----------
    mesh : TriangleMesh
    laplacian : Laplacian
    boundary : (b,) int
        Boundary vertices whose reflections are to be canceled: none if the recipe keeps
        reflections, or if the shape has no interior vertices.
    fragments : (c,) int
        Vertices of `fragment_vertices`.
    n_components : int
        Without fragments.
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


def _prepare(mesh: TriangleMesh, recipe: HeatRecipe) -> _PreparedShape:
    """Scale a mesh as its recipe asks, build its operator, and find its boundary and fragments."""
    require_describable(mesh)
    mesh = normalize_mesh(mesh, "box") if recipe.unit == "box" else mesh
    laplacian = cotangent_laplacian(mesh)
    fragments = fragment_vertices(mesh)
    _, labels = vertex_components(mesh)
    n_components = len(np.unique(np.delete(labels, fragments)))
    boundary = np.setdiff1d(boundary_edges(mesh), fragments)
    if recipe.reflections or len(boundary) + len(fragments) == mesh.n_vertices:
        boundary = boundary[:0]
    area = float(laplacian.mass.sum()) - float(laplacian.mass.diagonal()[fragments].sum())
    n_modes = recipe.n_modes + n_components - 1
    return _PreparedShape(mesh, laplacian, boundary, fragments, n_components, area, n_modes)


class _Heat(NamedTuple):
    """Heat at the time that finds features (n,), at the later times that describe them (n, q)."""

    first: Float[np.ndarray, " n"]
    later: Float[np.ndarray, "n q"]
    spectrum: Spectrum | None
    error: float | None


def _certified_heat(
    shape: _PreparedShape, times: Float[np.ndarray, " t"], progress: Progress | None
) -> _Heat:
    def spectrum_without(points: Int[np.ndarray, " c"]) -> Spectrum:
        n_free = shape.mesh.n_vertices - len(points)
        n_modes = min(shape.n_modes, n_free)
        return solve_spectrum(shape.laplacian, n_modes, fixed=points, progress=progress)

    spectrum = spectrum_without(shape.fragments)
    dirichlet = None
    if len(shape.boundary):
        dirichlet = spectrum_without(np.union1d(shape.fragments, shape.boundary))
    first = _heat(spectrum, dirichlet, times[:1])[:, 0]
    return _Heat(first, _heat(spectrum, dirichlet, times[1:]), spectrum, None)


def _approximate_heat(
    shape: _PreparedShape,
    times: Float[np.ndarray, " t"],
    accuracy: float,
    progress: Progress | None,
) -> _Heat:
    def heat_without(points: Int[np.ndarray, " c"]) -> tuple[Float[np.ndarray, "n t"], float]:
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
    return _Heat(columns[:, 0], columns[:, 1:], None, error)


def _heat(
    spectrum: Spectrum, dirichlet: Spectrum | None, times: Float[np.ndarray, " q"]
) -> Float[np.ndarray, "n q"]:
    if dirichlet is None:
        return heat_kernel_signature(spectrum, times)
    return reflection_free_signature(spectrum, dirichlet, times)


def _with_heat_of_fragments(
    shape: _PreparedShape, heat: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Fill in the heat on fragments, constant on each: 1 over its area."""
    if not len(shape.fragments):
        return heat
    _, labels = vertex_components(shape.mesh)
    areas = np.bincount(labels, weights=shape.laplacian.mass.diagonal())
    heat = heat.copy()
    heat[shape.fragments] = 1 / areas[labels[shape.fragments]]
    return heat


def _unit_and_times(area: float, recipe: HeatRecipe) -> tuple[float, Float[np.ndarray, " t"]]:
    """Return what a time of 1 means, and the times: first that of the features. All in length²."""
    unit = area if recipe.unit == "area" else 1.0
    return unit, unit * recipe.time_unit * np.array([recipe.feature_scale, *recipe.scales])


def _reorder_parts(parts: Segmentation, order: Int[np.ndarray, " m"]) -> Segmentation:
    features, number = parts.features, np.argsort(order)
    columns = (features.vertices, features.values, features.persistence)
    return Segmentation(
        freeze(number[parts.labels]), FeaturePoints(*(freeze(column[order]) for column in columns))
    )


def _descriptor(
    heat: Float[np.ndarray, "n q"],
    vertices: Int[np.ndarray, " m"],
    recipe: HeatRecipe,
    unit: float,
) -> HeatDescriptor:
    kept = unit * heat[vertices]
    return HeatDescriptor(np.log(kept) if recipe.logarithmic else kept, vertices, recipe)
