"""The methods that are compared, each by the same three verbs: a name, to describe, to measure distances."""

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache, partial
from typing import Any, Protocol, runtime_checkable

import numpy as np
from real_shapes import inner_curvature

import eigenshape as es


class Method(Protocol):
    """A way to tell how far a query is from described shapes; its `repr` tells all that its descriptors depend on."""

    @property
    def name(self) -> str:
        """Return what tables call it."""

    def describe(self, mesh: es.TriangleMesh) -> Any:
        """Return what is known of a shape, fit to be pickled."""

    def distances(self, query: Any, described: Sequence[Any]) -> np.ndarray:
        """Return how far a query is from each of many, (s,) float."""


@runtime_checkable
class Trainable(Protocol):
    """A method that learns from unlabelled complete shapes of the other half before it describes any."""

    def train(self, meshes: Iterable[es.TriangleMesh]) -> Method:
        """Return the method that has learnt; its `repr` must name what it has learnt."""


@lru_cache(maxsize=1)  # methods that share a spectrum describe one shape after the other
def cotangent_spectrum(mesh: es.TriangleMesh) -> es.Spectrum:
    """Return the eigenpairs that the thesis' recipe takes, of the mesh as the draw has scaled it."""
    return es.solve_spectrum(es.cotangent_laplacian(mesh), min(es.THESIS.n_modes, mesh.n_vertices))


def kernel_spectrum(mesh: es.TriangleMesh) -> es.Spectrum:
    """Return those of the mesh Laplacian at the thesis' τ."""
    laplacian = es.mesh_laplacian(mesh, t=es.THESIS.time_unit)
    return es.solve_spectrum(laplacian, min(es.THESIS.n_modes, mesh.n_vertices))


def early_heat(mesh: es.TriangleMesh, spectrum: es.Spectrum) -> np.ndarray:
    """Return the heat whose maxima the thesis takes: at 5 τ."""
    return es.heat_kernel_signature(spectrum, [es.THESIS.feature_scale * es.THESIS.time_unit])[:, 0]


def average_distance(mesh: es.TriangleMesh, spectrum: es.Spectrum) -> np.ndarray:
    """Return the average geodesic distance."""
    return es.average_geodesic_distance(mesh)


def curvature(mesh: es.TriangleMesh, spectrum: es.Spectrum) -> np.ndarray:
    """Return the Gaussian curvature, which has no meaning on a boundary."""
    return inner_curvature(mesh)


def matching_scores(query: es.ShapeDescriptor, described: Sequence[es.ShapeDescriptor]) -> np.ndarray:
    """Return the thesis' score of a query with each of many."""
    return np.array([es.matching_score(query, other) for other in described])


@dataclass(frozen=True)
class ThesisRecipe:
    """Heat vectors of 15 persistent maxima of some function, in the box of the draw (thesis 5.3)."""

    name: str
    function: str = "early_heat"
    spectrum: str = "cotangent_spectrum"

    def describe(self, mesh: es.TriangleMesh) -> es.ShapeDescriptor:
        """Return the heat vectors."""
        spectrum = globals()[self.spectrum](mesh)
        tree = es.merge_tree(mesh, globals()[self.function](mesh, spectrum))
        return es.describe(spectrum, es.segment(tree, n_regions=es.THESIS.n_features).features, es.THESIS)

    def distances(self, query: es.ShapeDescriptor, described: Sequence[es.ShapeDescriptor]) -> np.ndarray:
        """Return matching scores."""
        return matching_scores(query, described)


@dataclass(frozen=True)
class ScaleFree:
    """The default recipe of the library."""

    name: str = "scale-free"

    def describe(self, mesh: es.TriangleMesh) -> es.ShapeDescriptor:
        """Return the heat vectors, without units."""
        return es.describe_mesh(mesh, es.SCALE_FREE).descriptor

    def distances(self, query: es.ShapeDescriptor, described: Sequence[es.ShapeDescriptor]) -> np.ndarray:
        """Return matching scores."""
        return matching_scores(query, described)


@dataclass(frozen=True)
class Global:
    """A descriptor of the whole shape by a function of the library, and a distance of two of them."""

    name: str
    describer: str
    measure: str
    options: tuple[tuple[str, int], ...] = ()

    def describe(self, mesh: es.TriangleMesh) -> Any:
        """Return what the library's function makes of it."""
        return getattr(es, self.describer)(mesh, **dict(self.options))

    def distances(self, query: Any, described: Sequence[Any]) -> np.ndarray:
        """Return its distances."""
        distance: Callable[[Any], float] = partial(getattr(es, self.measure), query)
        return np.array([distance(other) for other in described])


TEACHING_VIEWS = 2


@dataclass(frozen=True)
class Patches:
    """Fisher vectors of patches, in words that the other half or made creatures taught; six views of what is closed.

    If verified, a whole query's views are compared with parts too, and the nearest shapes verified by matched points.
    """

    name: str
    teachers: str
    verified: bool = True
    taught: str = ""
    book: es.PatchCodebook | None = field(default=None, repr=False, compare=False)

    def train(self, meshes: Iterable[es.TriangleMesh]) -> "Patches":
        """Learn words; `taught` is a hash of them."""
        some = meshes if self.teachers == "other half" else creatures()
        book = es.train_codebook([patches for mesh in some for patches in seen(mesh, TEACHING_VIEWS)])
        text = b"".join(getattr(book, each.name).tobytes() for each in fields(book))
        return replace(self, taught=hashlib.sha256(text).hexdigest(), book=book)

    def describe(self, mesh: es.TriangleMesh) -> es.PatchedShape:
        """Return codes and points of the shape and of its views."""
        return es.patched_shape(seen(mesh, 6), self.book)

    def distances(self, query: es.PatchedShape, described: Sequence[es.PatchedShape]) -> np.ndarray:
        """Return distances, in which views count by half, less what matched points agree."""
        wholes, views = np.array([each.codes[0] for each in described]), [each.codes[1:] for each in described]
        of = np.repeat(np.arange(len(described)), [len(each) for each in views])
        measure = partial(es.view_distances, query.codes[0], wholes, np.concatenate(views), of)
        if not self.verified:
            return measure()
        return es.verify_distances(query, described, measure(query_views=query.codes[1:]))


def seen(mesh: es.TriangleMesh, n_views: int) -> list[es.Patches]:
    """Return the patches of a shape and of some views of it."""
    return [es.describe_patches(mesh), *es.describe_patch_views(mesh, n_views=n_views)]


def creatures() -> Iterable[es.TriangleMesh]:
    """Make four of each kind."""
    return (es.make_creature(kind, number, n_vertices=3000) for kind in es.CREATURES for number in range(4))


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        ThesisRecipe("thesis, cotangent"),
        ThesisRecipe("thesis, mesh Laplacian", spectrum="kernel_spectrum"),
        ScaleFree(),
        Global("ShapeDNA", "shape_dna", "shape_dna_distance"),
        Global("EVD", "affinity_eigenvalues", "affinity_distance"),
        Global("LFD", "light_field", "light_field_distance"),
        ThesisRecipe("AGD", "average_distance"),
        ThesisRecipe("GC", "curvature"),
        Patches("patches", "other half"),
        Patches("patches, not verified", "other half", verified=False),
        Patches("patches, made words", "creatures", verified=False),
    )
}
SLOW = ("thesis, mesh Laplacian", "patches, not verified", "patches, made words")  # asked for by name
