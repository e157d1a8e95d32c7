"""What an index must know of each kind of descriptor: how it is made, kept, compared and paired."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.heat.describe import N_VIEWS, describe_mesh, describe_views
from eigenshape.retrieval.heat.descriptor import Recipe, ShapeDescriptor
from eigenshape.retrieval.heat.score import match_features, matching_scores
from eigenshape.retrieval.patches.codebook import read_codebook, write_codebook
from eigenshape.retrieval.patches.descriptor import (
    PatchDescriptor,
    PatchRecipe,
    describe_by_patches,
)
from eigenshape.retrieval.patches.matching import match_patches
from eigenshape.retrieval.patches.packing import pack_points, unpack_points
from eigenshape.retrieval.patches.patches import N_VIEWS as N_PATCH_VIEWS
from eigenshape.retrieval.patches.verification import verified_scores, word_distances

AnyRecipe = Recipe | PatchRecipe
Descriptor = ShapeDescriptor | PatchDescriptor
Scores = Float[np.ndarray, " k"]
VERTEX = np.dtype("<i8")


@dataclass(frozen=True)
class Kind:
    """How descriptors of one kind are made, kept, compared and paired.

    Attributes
    ----------
    name : str
    n_views : int
        Sides from which a closed shape is described, unless said otherwise.
    to_ask : callable
        From a mesh and a recipe to the descriptor of a query.
    to_keep : callable
        From a mesh, a recipe and a number of views to the descriptors that an index keeps.
    row : dtype
        Of the numbers that are compared with every shape.
    rows : callable
        From a descriptor, and the name of its shape for errors, to its (m, q) numbers of that type.
    details : callable
        From a descriptor to the bytes that only the nearest need.
    restored : callable
        From rows, details and a recipe to the descriptor.
    scored : callable
        From a query and the rows of k descriptors to their scores.
    verified : callable
        From a query, what returns the descriptor of a number below k, and k scores to better scores.
    paired : callable
        From two descriptors to the (p, 2) features or points that correspond.
    """

    name: str
    n_views: int
    to_ask: Callable[[TriangleMesh, Any], Descriptor]
    to_keep: Callable[[TriangleMesh, Any, int], list[Descriptor]]
    row: "np.dtype[Any]"
    rows: Callable[[Any, str], np.ndarray]
    details: Callable[[Any], bytes]
    restored: Callable[[np.ndarray, bytes, Any], Descriptor]
    scored: Callable[[Any, Sequence[np.ndarray]], Scores]
    verified: Callable[[Any, Callable[[int], Any], Scores], Scores]
    paired: Callable[[Any, Any], Int[np.ndarray, "p 2"]]


def _heat_rows(descriptor: ShapeDescriptor, name: str) -> np.ndarray:
    rows = descriptor.vectors
    with np.errstate(over="ignore"):
        single = rows.astype("<f4")
    bad = np.argwhere(~np.isfinite(single))
    if bad.size or not rows.size:
        where = f"entry {bad[0].tolist()} is {rows[tuple(bad[0])]}" if bad.size else "it has none"
        raise InvalidParameterError(
            f"A descriptor must hold finite single-precision numbers; of {name!r} {where}."
        )
    if descriptor.vertices.shape != rows.shape[:1]:
        raise InvalidParameterError(
            f"A descriptor must name one vertex a feature; of {name!r} {len(rows)} features have vertices of shape "
            f"{descriptor.vertices.shape}."
        )
    return single


def _heat_scored(query: ShapeDescriptor, rows: Sequence[np.ndarray]) -> Scores:
    starts = np.cumsum([0, *(len(each) for each in rows)])[:-1]
    return matching_scores(
        query.vectors, np.concatenate(rows).astype(np.float64), starts, query.recipe
    )[0]


HEAT = Kind(
    name="heat",
    n_views=N_VIEWS,
    to_ask=lambda mesh, recipe: describe_mesh(mesh, recipe).descriptor,
    to_keep=lambda mesh, recipe, n: [
        describe_mesh(mesh, recipe).descriptor,
        *describe_views(mesh, recipe, n_views=n),
    ],
    row=np.dtype("<f4"),
    rows=_heat_rows,
    details=lambda descriptor: descriptor.vertices.astype(VERTEX).tobytes(),
    restored=lambda rows, details, recipe: ShapeDescriptor(
        rows.astype(np.float64), np.frombuffer(details, VERTEX), recipe
    ),
    scored=_heat_scored,
    verified=lambda query, others, scores: scores,
    paired=match_features,
)


def _codes(rows: np.ndarray, recipe: PatchRecipe) -> np.ndarray:
    return rows.reshape(-1, *recipe.codebook.code_shape)


PATCHES = Kind(
    name="patches",
    n_views=N_PATCH_VIEWS,
    to_ask=describe_by_patches,
    to_keep=lambda mesh, recipe, n: [describe_by_patches(mesh, recipe, n_views=n)],
    row=np.dtype("i1"),
    rows=lambda descriptor, name: descriptor.codes.reshape(-1, descriptor.codes.shape[-1]),
    details=lambda descriptor: pack_points(descriptor.points),
    restored=lambda rows, details, recipe: PatchDescriptor(
        _codes(rows, recipe), unpack_points(details), recipe
    ),
    scored=lambda query, rows: word_distances(
        query.codes, [_codes(each, query.recipe) for each in rows]
    ),
    verified=verified_scores,
    paired=lambda first, second: match_patches(first.points[0], second.points[0]).points,
)


def kind_of(recipe: AnyRecipe) -> Kind:
    """Return the kind of the descriptors that a recipe makes."""
    return PATCHES if isinstance(recipe, PatchRecipe) else HEAT


def describe_shape(mesh: MeshLike, recipe: AnyRecipe) -> Descriptor:
    """Describe a surface by any recipe, to ask an index for its like.

    Parameters
    ----------
    mesh : MeshLike
    recipe : Recipe or PatchRecipe

    Returns
    -------
    ShapeDescriptor or PatchDescriptor

    Raises
    ------
    InvalidShapeError
        As `describe_mesh` or `seen_patches`.
    """
    mesh = as_mesh(mesh)
    require_type(recipe, AnyRecipe, "recipe")
    return kind_of(recipe).to_ask(mesh, recipe)


def describe_to_keep(
    mesh: MeshLike, recipe: AnyRecipe, *, n_views: int | None = None
) -> list[Descriptor]:
    """Describe a surface as an index keeps it: with what single viewpoints see of it if it is closed.

    Parameters
    ----------
    mesh : MeshLike
    recipe : Recipe or PatchRecipe
    n_views : int, optional
        Viewpoints, spread evenly around the shape: by patches 6 and by heat 4 unless given.

    Returns
    -------
    list of ShapeDescriptor or PatchDescriptor
        For `ShapeIndex.add`.

    Raises
    ------
    InvalidShapeError
        As `describe_mesh` or `seen_patches`.
    """
    mesh = as_mesh(mesh)
    require_type(recipe, AnyRecipe, "recipe")
    kind = kind_of(recipe)
    return kind.to_keep(mesh, recipe, kind.n_views if n_views is None else n_views)


def written(recipe: AnyRecipe) -> tuple[str, bytes | None]:
    """Return a recipe as text, and what does not fit into text."""
    if isinstance(recipe, PatchRecipe):
        fields = {"kind": PATCHES.name, "codebook": recipe.codebook.digest}
        return json.dumps(fields, sort_keys=True), write_codebook(recipe.codebook)
    fields = {"kind": HEAT.name, **asdict(recipe)}
    return json.dumps(fields, sort_keys=True, default=np.generic.item), None


def read(text: str, words: bytes | None) -> AnyRecipe:
    """Return a recipe from what `written` made of it.

    Raises
    ------
    ValueError, TypeError
        If there is no such recipe.
    """
    fields = json.loads(text)
    kind = fields.pop("kind")
    if kind == PATCHES.name and words is not None:
        return PatchRecipe(read_codebook(words))
    if kind == HEAT.name:
        return Recipe(**{key: _tuples(value) for key, value in fields.items()})
    raise ValueError(f"there is no kind {kind!r}")


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
