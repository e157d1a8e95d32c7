"""The methods that are compared, each by the same three verbs: a name, to describe, to measure distances."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from affinity import affinity_distance, affinity_eigenvalues
from light_fields import light_field, light_field_distance
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
    """A method that learns from unlabeled complete shapes of the other half before it describes any."""

    def train(self, meshes: Iterable[es.TriangleMesh]) -> Method:
        """Return the method that has learnt; its `repr` must name what it has learnt."""


@lru_cache(maxsize=1)  # methods that share a spectrum describe one shape after the other
def cotangent_spectrum(mesh: es.TriangleMesh) -> es.Spectrum:
    """Return the eigenpairs that the thesis' recipe takes, of the mesh as the draw has scaled it."""
    return es.solve_spectrum(
        es.cotangent_laplacian(mesh), min(es.retrieval.THESIS.n_modes, mesh.n_vertices)
    )


def kernel_spectrum(mesh: es.TriangleMesh) -> es.Spectrum:
    """Return those of the mesh Laplacian at the thesis' τ."""
    laplacian = es.mesh_laplacian(mesh, t=es.retrieval.THESIS.time_unit)
    return es.solve_spectrum(laplacian, min(es.retrieval.THESIS.n_modes, mesh.n_vertices))


def early_heat(mesh: es.TriangleMesh, spectrum: es.Spectrum) -> np.ndarray:
    """Return the heat whose maxima the thesis takes: at 5 τ."""
    return es.heat_kernel_signature(
        spectrum, [es.retrieval.THESIS.feature_scale * es.retrieval.THESIS.time_unit]
    )[:, 0]


def average_distance(mesh: es.TriangleMesh, spectrum: es.Spectrum) -> np.ndarray:
    """Return the average geodesic distance."""
    return es.geometry.average_geodesic_distance(mesh)


def curvature(mesh: es.TriangleMesh, spectrum: es.Spectrum) -> np.ndarray:
    """Return the Gaussian curvature, which has no meaning on a boundary."""
    return inner_curvature(mesh)


def matching_scores(
    query: es.retrieval.HeatDescriptor, described: Sequence[es.retrieval.HeatDescriptor]
) -> np.ndarray:
    """Return the thesis' score of a query with each of many."""
    return np.array([es.retrieval.matching_score(query, other) for other in described])


@dataclass(frozen=True)
class ThesisRecipe:
    """Heat vectors of 15 persistent maxima of some function, in the box of the draw (thesis 5.3)."""

    name: str
    function: str = "early_heat"
    spectrum: str = "cotangent_spectrum"

    def describe(self, mesh: es.TriangleMesh) -> es.retrieval.HeatDescriptor:
        """Return the heat vectors."""
        spectrum = globals()[self.spectrum](mesh)
        tree = es.merge_tree(mesh, globals()[self.function](mesh, spectrum))
        return es.retrieval.heat_descriptor(
            spectrum,
            es.segment(tree, n_regions=es.retrieval.THESIS.n_features).features,
            es.retrieval.THESIS,
        )

    def distances(
        self, query: es.retrieval.HeatDescriptor, described: Sequence[es.retrieval.HeatDescriptor]
    ) -> np.ndarray:
        """Return matching scores."""
        return matching_scores(query, described)


@dataclass(frozen=True)
class ScaleFree:
    """The default recipe of the library."""

    name: str = "scale-free"

    def describe(self, mesh: es.TriangleMesh) -> es.retrieval.HeatDescriptor:
        """Return the heat vectors, without units."""
        return es.retrieval.find_heat_features(mesh, es.retrieval.SCALE_FREE).descriptor

    def distances(
        self, query: es.retrieval.HeatDescriptor, described: Sequence[es.retrieval.HeatDescriptor]
    ) -> np.ndarray:
        """Return matching scores."""
        return matching_scores(query, described)


def shape_dna_distance(one: np.ndarray, other: np.ndarray) -> float:
    """Return the Euclidean distance."""
    return float(np.linalg.norm(one - other))


# By name, so that the `repr` of a method tells all that its descriptors depend on.
DESCRIBERS: dict[str, Callable[..., np.ndarray]] = {
    "shape_dna": es.spectral.shape_dna,
    "affinity_eigenvalues": affinity_eigenvalues,
    "light_field": light_field,
}
DISTANCES: dict[str, Callable[[np.ndarray, np.ndarray], float]] = {
    "shape_dna_distance": shape_dna_distance,
    "affinity_distance": affinity_distance,
    "light_field_distance": light_field_distance,
}


@dataclass(frozen=True)
class Global:
    """A descriptor of the whole shape by one of `DESCRIBERS`, and a distance of two of them."""

    name: str
    describer: str
    measure: str
    options: tuple[tuple[str, int], ...] = ()

    def describe(self, mesh: es.TriangleMesh) -> Any:
        """Return what the function makes of it."""
        return DESCRIBERS[self.describer](mesh, **dict(self.options))

    def distances(self, query: Any, described: Sequence[Any]) -> np.ndarray:
        """Return its distances."""
        return np.array([DISTANCES[self.measure](query, other) for other in described])


TEACHING_VIEWS = 2


@dataclass(frozen=True)
class Patches:
    """Patches as an index stores and compares them, with a codebook of the other half or of synthetic creatures."""

    name: str
    teachers: Literal["other half", "synthetic creatures"] = "other half"
    verified: bool = True
    recipe: es.retrieval.PatchRecipe | None = None

    def train(self, meshes: Iterable[es.TriangleMesh]) -> "Patches":
        """Learn a codebook, or take the one that comes with the library."""
        if self.teachers == "synthetic creatures":
            return replace(self, recipe=es.retrieval.PatchRecipe())
        lessons = [
            patches
            for mesh in meshes
            for patches in es.retrieval.extract_patches(mesh, n_views=TEACHING_VIEWS)
        ]
        return replace(self, recipe=es.retrieval.PatchRecipe(es.retrieval.train_codebook(lessons)))

    def describe(self, mesh: es.TriangleMesh) -> Any:
        """Return the descriptor, with six views of what is closed."""
        return es.describe(mesh, self.recipe)

    def distances(self, query: Any, described: Sequence[Any]) -> np.ndarray:
        """Return scores, or distances by codes alone."""
        return es.retrieval.patch_scores(query, described, verify=self.verified)


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Patches("patches"),
        Patches("patches, not verified", verified=False),
        Patches("patches, default codebook", "synthetic creatures"),
        ThesisRecipe("thesis, cotangent"),
        ThesisRecipe("thesis, mesh Laplacian", spectrum="kernel_spectrum"),
        ScaleFree(),
        Global("ShapeDNA", "shape_dna", "shape_dna_distance"),
        Global("EVD", "affinity_eigenvalues", "affinity_distance"),
        Global("LFD", "light_field", "light_field_distance"),
        ThesisRecipe("AGD", "average_distance"),
        ThesisRecipe("GC", "curvature"),
    )
}
SLOW = ("thesis, mesh Laplacian", "patches, not verified")  # asked for by name
