"""The kinds of descriptors: how each is computed, stored, compared and paired.

An index knows a kind by the functions below. It stores the `rows` of a descriptor, which are
compared with every query, apart from its `details`, which only the nearest shapes need.

- `describe_query`: the descriptor of a mesh that is searched for.
- `describe_to_store`: those of a mesh that an index keeps, of the whole and of its views.
- `rows`: the (m, q) numbers that are stored as rows; `name` is for error messages.
- `details`: the rest of a descriptor, as bytes; `restore` undoes both.
- `as_stored`: a descriptor whose numbers are rounded as those of an index are.
- `scores`: of a query against the rows and the isolations of k descriptors.
- `verify`: scores improved by details; `other` returns the descriptor of a number below k.
- `correspondences`: pairs of features or patches of two descriptors, surest pairs first.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

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


class _HeatKind:
    """Feature points with heat vectors: one row for each feature, one descriptor for each view."""

    n_views = N_VIEWS  # from which a closed shape is described for an index by default
    row_type = np.dtype("<f4")  # of one number of a row

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


class _PatchKind:
    """Patches: one packed row for each code; one descriptor for a shape with all its views."""

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


HEAT, PATCHES = _HeatKind(), _PatchKind()


def kind_of(recipe: AnyRecipe) -> Any:
    """Return the kind of the descriptors that a recipe makes."""
    return PATCHES if isinstance(recipe, PatchRecipe) else HEAT


def recipe_to_text(recipe: AnyRecipe) -> tuple[str, bytes | None]:
    """Return a recipe as JSON, and the bytes of its codebook if it has one."""
    codebook = None
    if isinstance(recipe, HeatRecipe):
        fields = {"kind": "heat", **asdict(recipe)}
    else:
        fields = {"kind": "patches", "clip": recipe.clip, "n_frames": recipe.n_frames}
        fields["codebook"] = recipe.codebook.digest
        codebook = write_codebook(recipe.codebook)
    return json.dumps(fields, sort_keys=True, default=np.generic.item), codebook


def recipe_from_text(text: str, codebook: bytes | None) -> AnyRecipe:
    """Return the recipe of `recipe_to_text`.

    Raise ValueError or TypeError if there is no such recipe.
    """
    fields = json.loads(text)
    kind = fields.pop("kind")
    if kind == "heat":
        return HeatRecipe(**{key: _as_tuples(value) for key, value in fields.items()})
    if kind != "patches":
        raise ValueError(f"there is no kind {kind!r}")
    if codebook is None:
        raise ValueError("its codebook is missing")
    return PatchRecipe(read_codebook(codebook), float(fields["clip"]), fields["n_frames"])


def _as_tuples(value: Any) -> Any:
    """Undo that JSON turns tuples into lists."""
    return tuple(map(_as_tuples, value)) if isinstance(value, list) else value
