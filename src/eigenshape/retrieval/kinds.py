"""What an index must know of the two kinds of descriptors: heat and patches.

An index stores the rows of a descriptor, which are compared with every query, apart from its
details, which only the nearest shapes need. Of heat, each feature has a row, and each view a
descriptor of its own. Of patches, each code has a row, packed, and one descriptor holds a shape with
all its views.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import freeze
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.heat.features import N_VIEWS, describe_views, heat_features
from eigenshape.retrieval.heat.recipe import HeatRecipe
from eigenshape.retrieval.heat.score import HeatDescriptor, match_features, matching_scores
from eigenshape.retrieval.patches.codebook import read_codebook, write_codebook
from eigenshape.retrieval.patches.descriptor import PatchDescriptor, PatchRecipe, patch_descriptor
from eigenshape.retrieval.patches.distance import packed_distances, scale_distances
from eigenshape.retrieval.patches.matching import match_patches, pack_points, unpack_points
from eigenshape.retrieval.patches.packing import pack_codes, unpack_codes
from eigenshape.retrieval.patches.patches import N_VIEWS as N_PATCH_VIEWS
from eigenshape.retrieval.patches.patches import mesh_patches
from eigenshape.retrieval.patches.verification import verified_scores
from eigenshape.scans.partial import view_number

AnyRecipe = HeatRecipe | PatchRecipe
Descriptor = HeatDescriptor | PatchDescriptor
VERTEX = np.dtype("<i8")  # how a vertex is stored


def describe(mesh: MeshLike, recipe: AnyRecipe | None = None) -> Descriptor:
    """Describe a mesh, to search an index for similar shapes or to compare it with another.

    `ShapeIndex.query` describes a mesh by itself; describe it here to ask several indexes, or by a
    recipe of your choice. `ShapeIndex.add` describes a mesh that is to be found.

    Parameters
    ----------
    mesh : MeshLike
        A closed or open surface, of any size and in any pose. Patches of a surface of more than
        30,000 vertices are those of one that is thinned out to fewer, patches of a coarse one those of one
        whose long edges are split (`extract_patches`).
    recipe : HeatRecipe or PatchRecipe, optional
        By default patches with the codebook that comes with the library, ``PatchRecipe()``. The
        presets of heat are ``SCALE_FREE`` and ``THESIS``.

    Returns
    -------
    HeatDescriptor or PatchDescriptor

    Raises
    ------
    InvalidShapeError
        If a face has no area or occurs twice, a vertex has no face, or the mesh is a soup (faces
        lie edge on edge without sharing vertices).

    See Also
    --------
    ShapeIndex, matching_score, patch_scores, find_heat_features, extract_patches

    Examples
    --------
    >>> import eigenshape as es
    >>> fish = es.make_creature("fish", n_vertices=500)
    >>> es.describe(fish).codes.shape  # the whole and six views of it
    (7, 3, 3, 1280)
    >>> es.describe(fish, es.retrieval.SCALE_FREE).vectors.shape  # 15 feature points
    (15, 15)
    """
    require_type(recipe, AnyRecipe | None, "recipe")
    return describe_mesh(as_mesh(mesh), recipe or PatchRecipe())


def describe_mesh(mesh: TriangleMesh, recipe: AnyRecipe) -> Descriptor:
    """Describe a mesh, as `describe` does."""
    if isinstance(recipe, HeatRecipe):
        return heat_features(mesh, recipe).descriptor
    return patch_descriptor(mesh_patches(mesh), recipe)


def describe_query(shape: MeshLike | Descriptor, recipe: AnyRecipe) -> Descriptor:
    """Return what an index is asked by: a descriptor as it is, or that of a mesh."""
    if isinstance(shape, Descriptor):
        return shape
    return describe_mesh(as_mesh(shape, "shape"), recipe)


def describe_to_store(
    mesh: TriangleMesh, recipe: AnyRecipe, n_views: Integer | None = None
) -> list[Descriptor]:
    """Describe a mesh as an index keeps it: the whole, and what viewpoints see if it is closed."""
    usual = N_VIEWS if isinstance(recipe, HeatRecipe) else N_PATCH_VIEWS
    count = usual if n_views is None else view_number(n_views, "n_views")
    if isinstance(recipe, HeatRecipe):
        return [describe_mesh(mesh, recipe), *describe_views(mesh, recipe, count)]
    patches = mesh_patches(mesh, n_views=count, n_frames=recipe.n_frames)
    return [patch_descriptor(patches, recipe)]


def row_type(recipe: AnyRecipe) -> "np.dtype[Any]":
    """Return the type of one number of a row."""
    return np.dtype("<f4" if isinstance(recipe, HeatRecipe) else "u1")


def rows_of(descriptor: Descriptor, name: str) -> np.ndarray:
    """Return the (m, q) numbers that are stored as rows; `name` is for error messages."""
    if isinstance(descriptor, PatchDescriptor):
        return pack_codes(descriptor.codes)
    vectors = descriptor.vectors
    with np.errstate(over="ignore"):
        rows = vectors.astype(row_type(descriptor.recipe))
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


def details_of(descriptor: Descriptor) -> bytes:
    """Return the rest of a descriptor as bytes."""
    if isinstance(descriptor, PatchDescriptor):
        return pack_points(descriptor.points[0])
    return descriptor.vertices.astype(VERTEX).tobytes()


def restore(rows: np.ndarray, details: bytes, recipe: AnyRecipe) -> Descriptor:
    """Return the descriptor of stored rows and details."""
    if isinstance(recipe, HeatRecipe):
        return HeatDescriptor(rows.astype(np.float64), np.frombuffer(details, VERTEX), recipe)
    codes = unpack_codes(rows).reshape(-1, *recipe.codebook.code_shape)
    return PatchDescriptor(freeze(codes), (unpack_points(details),), recipe)


def as_stored(descriptor: Descriptor) -> Descriptor:
    """Return a descriptor whose numbers are rounded as those of an index are."""
    if isinstance(descriptor, PatchDescriptor):  # rounded when it was made
        return descriptor
    return restore(rows_of(descriptor, "the query"), details_of(descriptor), descriptor.recipe)


def score_rows(
    query: Descriptor, rows: Sequence[np.ndarray], isolations: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " k"]:
    """Score a query against the rows and the isolations of k descriptors."""
    if isinstance(query, PatchDescriptor):
        return scale_distances(query.codes, packed_distances(query.codes, rows), isolations)
    starts = np.cumsum([0, *(len(each) for each in rows)])[:-1]
    vectors = np.concatenate(rows).astype(np.float64)
    return matching_scores(query.vectors, vectors, starts, query.recipe)[0]


def verify_scores(
    query: Descriptor, other: Callable[[int], Any], scores: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " k"]:
    """Improve scores with details; `other` returns the descriptor of a number below k."""
    if isinstance(query, PatchDescriptor):
        return verified_scores(query, other, scores)
    return scores  # of all features already


def pair_points(first: Descriptor, second: Any) -> Int[np.ndarray, "p 2"]:
    """Pair the features or patches of two descriptors by one recipe, surest pairs first."""
    if isinstance(first, PatchDescriptor):
        return match_patches(first.points[0], second.points[0]).points
    return match_features(first, second)


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
