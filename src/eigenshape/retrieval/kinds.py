"""The kinds of descriptors: how each is computed, stored, compared and paired."""

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any, Generic, TypeVar

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arrays import freeze
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.heat.features import N_VIEWS, describe_views, find_heat_features
from eigenshape.retrieval.heat.recipe import HeatRecipe
from eigenshape.retrieval.heat.score import HeatDescriptor, match_features, matching_scores
from eigenshape.retrieval.patches.codebook import read_codebook, write_codebook
from eigenshape.retrieval.patches.descriptor import PatchDescriptor, PatchRecipe, patch_descriptor
from eigenshape.retrieval.patches.distance import packed_distances, scale_distances
from eigenshape.retrieval.patches.matching import match_patches
from eigenshape.retrieval.patches.packing import (
    pack_codes,
    pack_points,
    unpack_codes,
    unpack_points,
)
from eigenshape.retrieval.patches.patches import N_VIEWS as N_PATCH_VIEWS
from eigenshape.retrieval.patches.patches import extract_patches
from eigenshape.retrieval.patches.verification import verified_scores

AnyRecipe = HeatRecipe | PatchRecipe
Descriptor = HeatDescriptor | PatchDescriptor
VERTEX = np.dtype("<i8")  # how a vertex is stored

R = TypeVar("R", HeatRecipe, PatchRecipe)
D = TypeVar("D", HeatDescriptor, PatchDescriptor)


class Kind(ABC, Generic[R, D]):
    """What an index must know of one kind of descriptor.

    An index stores the `rows` of a descriptor, which are compared with every query, apart from its
    `details`, which only the nearest shapes need.

    Attributes
    ----------
    name : str
        Written with each recipe of this kind.
    n_views : int
        Viewpoints from which a closed shape is described for an index by default.
    row_type : dtype
        Of one number of a row.
    """

    name: str
    n_views: int
    row_type: "np.dtype[Any]"

    @abstractmethod
    def describe_query(self, mesh: TriangleMesh, recipe: R) -> D:
        """Return the descriptor of a mesh that is searched for."""

    @abstractmethod
    def describe_to_store(self, mesh: TriangleMesh, recipe: R, n_views: int) -> list[D]:
        """Return the descriptors of a mesh that an index keeps: of the whole, and of its views."""

    @abstractmethod
    def rows(self, descriptor: D, name: str) -> np.ndarray:
        """Return the (m, q) numbers that are stored as rows; `name` is for error messages."""

    @abstractmethod
    def details(self, descriptor: D) -> bytes:
        """Return the rest of a descriptor as bytes."""

    @abstractmethod
    def restore(self, rows: np.ndarray, details: bytes, recipe: R) -> D:
        """Return the descriptor of stored rows and details."""

    @abstractmethod
    def as_stored(self, descriptor: D) -> D:
        """Return a descriptor whose numbers are rounded as those of an index are."""

    @abstractmethod
    def scores(
        self, query: D, rows: Sequence[np.ndarray], isolations: Float[np.ndarray, " k"]
    ) -> Float[np.ndarray, " k"]:
        """Score a query against the rows and the isolations of k descriptors."""

    @abstractmethod
    def verify(
        self, query: D, other: Callable[[int], D], scores: Float[np.ndarray, " k"]
    ) -> Float[np.ndarray, " k"]:
        """Improve scores with details; `other` returns the descriptor of a number below k."""

    @abstractmethod
    def correspondences(self, first: D, second: D) -> Int[np.ndarray, "p 2"]:
        """Pair the features or patches of two descriptors, surest pairs first."""

    @abstractmethod
    def write_recipe(self, recipe: R) -> tuple[dict[str, Any], bytes | None]:
        """Return the fields of a recipe as JSON takes them, and the bytes of its codebook."""

    @abstractmethod
    def read_recipe(self, fields: dict[str, Any], codebook: bytes | None) -> R:
        """Return the recipe of `write_recipe`; raise TypeError or ValueError if there is none."""


class _HeatKind(Kind[HeatRecipe, HeatDescriptor]):
    """Feature points with heat vectors: one row for each feature, one descriptor for each view."""

    name = "heat"
    n_views = N_VIEWS
    row_type = np.dtype("<f4")

    def describe_query(self, mesh: TriangleMesh, recipe: HeatRecipe) -> HeatDescriptor:
        return find_heat_features(mesh, recipe).descriptor

    def describe_to_store(
        self, mesh: TriangleMesh, recipe: HeatRecipe, n_views: int
    ) -> list[HeatDescriptor]:
        return [self.describe_query(mesh, recipe), *describe_views(mesh, recipe, n_views)]

    def rows(self, descriptor: HeatDescriptor, name: str) -> np.ndarray:
        vectors = descriptor.vectors
        with np.errstate(over="ignore"):
            rows = vectors.astype(self.row_type)
        bad = np.argwhere(~np.isfinite(rows))
        if bad.size or not vectors.size:
            entry = bad[0].tolist() if bad.size else None
            where = f"entry {entry} is {vectors[tuple(entry)]}" if entry else "it has none"
            raise InvalidParameterError(
                f"A descriptor must hold finite single-precision numbers; of {name!r} {where}."
            )
        if descriptor.vertices.shape != vectors.shape[:1]:
            raise InvalidParameterError(
                f"A descriptor must name one vertex a feature; of {name!r} {len(vectors)} features "
                f"have vertices of shape {descriptor.vertices.shape}."
            )
        return rows

    def details(self, descriptor: HeatDescriptor) -> bytes:
        return descriptor.vertices.astype(VERTEX).tobytes()

    def restore(self, rows: np.ndarray, details: bytes, recipe: HeatRecipe) -> HeatDescriptor:
        return HeatDescriptor(rows.astype(np.float64), np.frombuffer(details, VERTEX), recipe)

    def as_stored(self, descriptor: HeatDescriptor) -> HeatDescriptor:
        rows = self.rows(descriptor, "the query")
        return self.restore(rows, self.details(descriptor), descriptor.recipe)

    def scores(
        self,
        query: HeatDescriptor,
        rows: Sequence[np.ndarray],
        isolations: Float[np.ndarray, " k"],
    ) -> Float[np.ndarray, " k"]:
        starts = np.cumsum([0, *(len(each) for each in rows)])[:-1]
        vectors = np.concatenate(rows).astype(np.float64)
        scores, _ = matching_scores(query.vectors, vectors, starts, query.recipe)
        return scores

    def verify(
        self,
        query: HeatDescriptor,
        other: Callable[[int], HeatDescriptor],
        scores: Float[np.ndarray, " k"],
    ) -> Float[np.ndarray, " k"]:
        return scores  # of all features already

    def correspondences(
        self, first: HeatDescriptor, second: HeatDescriptor
    ) -> Int[np.ndarray, "p 2"]:
        return match_features(first, second)

    def write_recipe(self, recipe: HeatRecipe) -> tuple[dict[str, Any], bytes | None]:
        return asdict(recipe), None

    def read_recipe(self, fields: dict[str, Any], codebook: bytes | None) -> HeatRecipe:
        return HeatRecipe(**{key: _as_tuples(value) for key, value in fields.items()})


class _PatchKind(Kind[PatchRecipe, PatchDescriptor]):
    """Patches: one packed row for each code; one descriptor for a shape with all its views."""

    name = "patches"
    n_views = N_PATCH_VIEWS
    row_type = np.dtype("u1")

    def describe_query(self, mesh: TriangleMesh, recipe: PatchRecipe) -> PatchDescriptor:
        return patch_descriptor(extract_patches(mesh), recipe)

    def describe_to_store(
        self, mesh: TriangleMesh, recipe: PatchRecipe, n_views: int
    ) -> list[PatchDescriptor]:
        patches = extract_patches(mesh, n_views=n_views, n_frames=recipe.n_frames)
        return [patch_descriptor(patches, recipe)]

    def rows(self, descriptor: PatchDescriptor, name: str) -> np.ndarray:
        return pack_codes(descriptor.codes.reshape(-1, descriptor.codes.shape[-1]))

    def details(self, descriptor: PatchDescriptor) -> bytes:
        return pack_points(descriptor.points[0])

    def restore(self, rows: np.ndarray, details: bytes, recipe: PatchRecipe) -> PatchDescriptor:
        codes = unpack_codes(rows).reshape(-1, *recipe.codebook.code_shape)
        return PatchDescriptor(freeze(codes), (unpack_points(details),), recipe)

    def as_stored(self, descriptor: PatchDescriptor) -> PatchDescriptor:
        return descriptor  # whose numbers were rounded when it was made

    def scores(
        self,
        query: PatchDescriptor,
        rows: Sequence[np.ndarray],
        isolations: Float[np.ndarray, " k"],
    ) -> Float[np.ndarray, " k"]:
        return scale_distances(query.codes, packed_distances(query.codes, rows), isolations)

    def verify(
        self,
        query: PatchDescriptor,
        other: Callable[[int], PatchDescriptor],
        scores: Float[np.ndarray, " k"],
    ) -> Float[np.ndarray, " k"]:
        return verified_scores(query, other, scores)

    def correspondences(
        self, first: PatchDescriptor, second: PatchDescriptor
    ) -> Int[np.ndarray, "p 2"]:
        return match_patches(first.points[0], second.points[0]).points

    def write_recipe(self, recipe: PatchRecipe) -> tuple[dict[str, Any], bytes | None]:
        fields = {
            "codebook": recipe.codebook.digest,
            "clip": recipe.clip,
            "n_frames": recipe.n_frames,
        }
        return fields, write_codebook(recipe.codebook)

    def read_recipe(self, fields: dict[str, Any], codebook: bytes | None) -> PatchRecipe:
        if codebook is None:
            raise ValueError("its codebook is missing")
        return PatchRecipe(read_codebook(codebook), float(fields["clip"]), fields["n_frames"])


HEAT, PATCHES = _HeatKind(), _PatchKind()


def kind_of(recipe: AnyRecipe) -> Kind[Any, Any]:
    """Return the kind of the descriptors that a recipe makes."""
    return PATCHES if isinstance(recipe, PatchRecipe) else HEAT


def recipe_to_text(recipe: AnyRecipe) -> tuple[str, bytes | None]:
    """Return a recipe as JSON, and the bytes of its codebook if it has one."""
    kind = kind_of(recipe)
    fields, codebook = kind.write_recipe(recipe)
    text = json.dumps({"kind": kind.name, **fields}, sort_keys=True, default=np.generic.item)
    return text, codebook


def recipe_from_text(text: str, codebook: bytes | None) -> AnyRecipe:
    """Return the recipe of `recipe_to_text`.

    Raise ValueError or TypeError if there is no such recipe.
    """
    fields = json.loads(text)
    name = fields.pop("kind")
    for kind in (PATCHES, HEAT):
        if kind.name == name:
            recipe: AnyRecipe = kind.read_recipe(fields, codebook)
            return recipe
    raise ValueError(f"there is no kind {name!r}")


def _as_tuples(value: Any) -> Any:
    """Undo that JSON turns tuples into lists."""
    return tuple(map(_as_tuples, value)) if isinstance(value, list) else value
