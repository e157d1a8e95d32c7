"""Feature points of a mesh, and the heat descriptor that they carry."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.progress import Progress
from certeig.kit.threads import map_in_threads
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import vertex_values
from eigenshape.features.merge_tree import merge_tree
from eigenshape.features.region_tree import MergeTree
from eigenshape.features.segmentation import FeaturePoints, Segmentation, segment
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_mesh
from eigenshape.geometry.repairs.repair_steps import fragment_vertices
from eigenshape.geometry.requirements import require_describable
from eigenshape.geometry.topology import boundary_edges, vertex_components
from eigenshape.operators.cotangent import surface_laplacian
from eigenshape.operators.laplacian import Laplacian, dirichlet_laplacian
from eigenshape.retrieval.heat.recipe import SCALE_FREE, HeatRecipe
from eigenshape.retrieval.heat.score import HeatDescriptor
from eigenshape.scans.partial import MeshPart, viewer, views_of
from eigenshape.spectral.signatures.approximate_heat import approximate_heat_signature
from eigenshape.spectral.signatures.heat import heat_kernel_signature, reflection_free_signature
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

# Viewpoints from which a closed shape is described beside the whole. Each costs one more
# description and one more descriptor in the index.
N_VIEWS = 4


@record
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
    return heat_features(mesh, recipe, height, accuracy, progress)


def heat_features(
    mesh: TriangleMesh,
    recipe: HeatRecipe,
    height: Float[np.ndarray, " n"] | None = None,
    accuracy: float | None = None,
    progress: Progress | None = None,
) -> HeatFeatures:
    """Find the features of a mesh, as `find_heat_features` does."""
    require_describable(mesh)
    if recipe.unit == "box":
        mesh = normalize_mesh(mesh, "box")
    laplacian = surface_laplacian(mesh)
    areas = laplacian.mass.diagonal()
    fragments = fragment_vertices(mesh)
    _, labels = vertex_components(mesh)
    n_components = len(np.unique(np.delete(labels, fragments)))
    n_modes = recipe.n_modes + n_components - 1
    # Heat flows with the fragments fixed, and once more with the boundary fixed as well, which
    # cancels its reflections: not if the recipe keeps them, or if there are no interior vertices.
    fixed = [fragments]
    boundary = np.setdiff1d(boundary_edges(mesh), fragments)
    no_interior = len(boundary) + len(fragments) == mesh.n_vertices
    if len(boundary) and not recipe.reflections and not no_interior:
        fixed.append(np.union1d(fragments, boundary))
    area = float(laplacian.mass.sum()) - float(areas[fragments].sum())
    unit, times = _unit_and_times(area, recipe)
    spectrum, error = None, None
    if accuracy is None:
        spectra = []
        for ends in fixed:
            k = min(n_modes, mesh.n_vertices - len(ends))
            spectra.append(solve_spectrum(laplacian, k, fixed=ends, progress=progress))
        spectrum, dirichlet = spectra[0], spectra[1] if len(spectra) > 1 else None
        columns = [_heat(spectrum, dirichlet, each) for each in (times[:1], times[1:])]
        heat = np.concatenate(columns, axis=1)
    else:
        heat, error = _approximate_heat(laplacian, fixed, n_modes, times, accuracy, progress)
    if height is None:
        # The heat on a fragment is constant: 1 over its area.
        height = heat[:, 0].copy()
        height[fragments] = 1 / np.bincount(labels, weights=areas)[labels[fragments]]

    # Cut the shape around the maxima, and put the regions of fragments last.
    tree = merge_tree(mesh, height)
    n_fragments = int(np.isin(tree.maxima, fragments).sum())
    parts = segment(tree, n_regions=recipe.n_features + n_fragments)
    on_fragment = np.isin(parts.features.vertices, fragments)
    order = np.argsort(on_fragment, kind="stable")
    found = parts.features
    points = FeaturePoints(found.vertices[order], found.values[order], found.persistence[order])
    parts = Segmentation(np.argsort(order)[parts.labels], points)

    n_described = min(max(recipe.n_features, n_components), int((~on_fragment).sum()))
    descriptor = _descriptor(heat[:, 1:], parts.features.vertices[:n_described], recipe, unit)
    return HeatFeatures(
        mesh=mesh,
        spectrum=spectrum,
        heat=height,
        error=error,
        tree=tree,
        parts=parts,
        descriptor=descriptor,
        fragments=fragments,
    )


def describe_views(mesh: TriangleMesh, recipe: HeatRecipe, n_views: int) -> list[HeatDescriptor]:
    """Describe what single viewpoints see of a closed shape, with features at its own vertices.

    Return nothing for an open shape, which is a part already.
    """

    def describe_view(part: MeshPart) -> HeatDescriptor:
        descriptor = heat_features(part.mesh, recipe).descriptor
        return replace(descriptor, vertices=part.source_vertices[descriptor.vertices])

    return map_in_threads(describe_view, views_of(mesh, n_views))


def find_view_features(
    mesh: TriangleMesh, recipe: HeatRecipe, view: int
) -> tuple[MeshPart, HeatFeatures]:
    """Return what one of the viewpoints of `describe_views` sees, and its features."""
    part = viewer(mesh)(view)
    return part, heat_features(part.mesh, recipe)


def _approximate_heat(
    laplacian: Laplacian,
    fixed: list[Int[np.ndarray, " _"]],
    n_modes: int,
    times: Float[np.ndarray, " t"],
    accuracy: float,
    progress: Progress | None,
) -> tuple[Float[np.ndarray, "n t"], float]:
    heat, errors = [], []
    for points in fixed:
        inner, free = dirichlet_laplacian(laplacian, points)
        k = min(n_modes, inner.n_points)
        found = approximate_heat_signature(inner, k, times, accuracy=accuracy, progress=progress)
        columns = np.zeros((laplacian.n_points, len(times)))
        columns[free] = found.values
        heat.append(columns)
        errors.append(float(found.errors[0]))
    return np.mean(heat, axis=0), max(errors)


def _heat(
    spectrum: Spectrum, dirichlet: Spectrum | None, times: Float[np.ndarray, " q"]
) -> Float[np.ndarray, "n q"]:
    if dirichlet is None:
        return heat_kernel_signature(spectrum, times)
    return reflection_free_signature(spectrum, dirichlet, times)


def _unit_and_times(area: float, recipe: HeatRecipe) -> tuple[float, Float[np.ndarray, " t"]]:
    """Return what a time of 1 means, and the times: first that of the features. All in length²."""
    unit = area if recipe.unit == "area" else 1.0
    return unit, unit * recipe.time_unit * np.array([recipe.feature_scale, *recipe.scales])


def _descriptor(
    heat: Float[np.ndarray, "n q"],
    vertices: Int[np.ndarray, " m"],
    recipe: HeatRecipe,
    unit: float,
) -> HeatDescriptor:
    kept = unit * heat[vertices]
    return HeatDescriptor(np.log(kept) if recipe.logarithmic else kept, vertices, recipe)
