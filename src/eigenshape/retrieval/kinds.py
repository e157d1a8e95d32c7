"""What an index must know of each kind of descriptor: how it is kept, compared and paired."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.codebook import read_codebook, write_codebook
from eigenshape.retrieval.describe import N_VIEWS, describe_mesh, describe_views
from eigenshape.retrieval.descriptor import Recipe, ShapeDescriptor
from eigenshape.retrieval.patch_descriptor import (
    PatchDescriptor,
    PatchRecipe,
    describe_by_patches,
    describe_views_by_patches,
    unit,
)
from eigenshape.retrieval.patch_score import patch_distances
from eigenshape.retrieval.patches import N_VIEWS as N_PATCH_VIEWS
from eigenshape.retrieval.score import match_features, matching_scores

AnyRecipe = Recipe | PatchRecipe
Descriptor = ShapeDescriptor | PatchDescriptor
Ranking = tuple[Float[np.ndarray, " k"], Int[np.ndarray, " k"]]
VERTEX = np.dtype("<i8")
AT_ONCE = 256  # descriptors whose codes are floats at a time


@dataclass(frozen=True)
class Kind:
    """How descriptors of one kind are kept, compared and paired.

    Attributes
    ----------
    name : str
    n_views : int
        Sides from which a closed shape is described, unless said otherwise.
    describe : callable
        From a mesh and a recipe to a descriptor.
    sides : callable
        From a mesh, a recipe and a number to descriptors of what is seen from so many sides.
    row : dtype
        Of the numbers that are compared with every shape.
    rows : callable
        From a descriptor, and the name of its shape for errors, to its (m, q) numbers of that type.
    details : callable
        From a descriptor to the bytes that only answers need.
    restored : callable
        From rows, details and a recipe to the descriptor.
    ranked : callable
        From a query, the rows of all descriptors, shape after shape, and where each shape begins, to the score of each
        shape and the descriptor meant by it.
    paired : callable
        From two descriptors to the (p, 2) features or points that correspond.
    """

    name: str
    n_views: int
    describe: Callable[[TriangleMesh, Any], Descriptor]
    sides: Callable[[TriangleMesh, Any, int], Sequence[Descriptor]]
    row: "np.dtype[Any]"
    rows: Callable[[Any, str], np.ndarray]
    details: Callable[[Any], bytes]
    restored: Callable[[np.ndarray, bytes, Any], Descriptor]
    ranked: Callable[[Any, Sequence[np.ndarray], Int[np.ndarray, " k"]], Ranking]
    paired: Callable[[Any, Any], Int[np.ndarray, "p 2"]]


def _heat_rows(descriptor: ShapeDescriptor, name: str) -> np.ndarray:
    rows = descriptor.vectors
    with np.errstate(over="ignore"):
        single = rows.astype("<f4")
    bad = np.argwhere(~np.isfinite(single))
    if bad.size or not rows.size:
        where = f"entry {bad[0].tolist()} is {rows[tuple(bad[0])]}" if bad.size else "it has none"
        raise InvalidParameterError(f"A descriptor must hold finite single-precision numbers; of {name!r} {where}.")
    if descriptor.vertices.shape != rows.shape[:1]:
        raise InvalidParameterError(
            f"A descriptor must name one vertex a feature; of {name!r} {len(rows)} features have vertices of shape "
            f"{descriptor.vertices.shape}."
        )
    return single


def _heat_ranked(query: ShapeDescriptor, rows: Sequence[np.ndarray], firsts: Int[np.ndarray, " k"]) -> Ranking:
    """Take the best view of each shape."""
    starts = np.cumsum([0, *(len(each) for each in rows)])[:-1]
    scores, _ = matching_scores(query.vectors, np.concatenate(rows).astype(np.float64), starts, query.recipe)
    return _least(scores, firsts)


def _least(scores: Float[np.ndarray, " w"], firsts: Int[np.ndarray, " k"]) -> Ranking:
    least = np.minimum.reduceat(scores, firsts)
    lasts = np.append(firsts[1:], len(scores))
    places = [first + int(scores[first:last].argmin()) for first, last in zip(firsts, lasts, strict=True)]
    return least, np.array(places)


def _patch_ranked(query: PatchDescriptor, rows: Sequence[np.ndarray], firsts: Int[np.ndarray, " k"]) -> Ranking:
    """Take the mean of the whole shape and of its best view, as `view_distances`."""
    ours = unit(query.codes)
    parts = (np.array(rows[first : first + AT_ONCE]) for first in range(0, len(rows), AT_ONCE))
    distances = np.concatenate([patch_distances(ours, unit(part.reshape(-1, *ours.shape))) for part in parts])
    nearest, places = _least(distances, firsts)
    return (distances[firsts] + nearest) / 2, places


def _patch_restored(rows: np.ndarray, details: bytes, recipe: PatchRecipe) -> PatchDescriptor:
    return PatchDescriptor(rows.reshape(*recipe.codebook.code_shape), np.frombuffer(details, VERTEX), recipe)


HEAT = Kind(
    name="heat",
    n_views=N_VIEWS,
    describe=lambda mesh, recipe: describe_mesh(mesh, recipe).descriptor,
    sides=lambda mesh, recipe, n_views: describe_views(mesh, recipe, n_views=n_views),
    row=np.dtype("<f4"),
    rows=_heat_rows,
    details=lambda descriptor: descriptor.vertices.astype(VERTEX).tobytes(),
    restored=lambda rows, details, recipe: ShapeDescriptor(
        rows.astype(np.float64), np.frombuffer(details, VERTEX), recipe
    ),
    ranked=_heat_ranked,
    paired=match_features,
)
PATCHES = Kind(
    name="patches",
    n_views=N_PATCH_VIEWS,
    describe=describe_by_patches,
    sides=lambda mesh, recipe, n_views: describe_views_by_patches(mesh, recipe, n_views=n_views),
    row=np.dtype("i1"),
    rows=lambda descriptor, name: descriptor.codes.reshape(-1, descriptor.codes.shape[2]),
    details=lambda descriptor: descriptor.vertices.astype(VERTEX).tobytes(),
    restored=_patch_restored,
    ranked=_patch_ranked,
    paired=lambda first, second: np.empty((0, 2), dtype=np.int64),
)


def kind_of(recipe: AnyRecipe) -> Kind:
    """Return the kind of the descriptors that a recipe makes."""
    return PATCHES if isinstance(recipe, PatchRecipe) else HEAT


def describe_shape(mesh: TriangleMesh, recipe: AnyRecipe) -> Descriptor:
    """Describe a surface by any recipe, to ask an index for its like.

    Parameters
    ----------
    mesh : TriangleMesh
    recipe : Recipe or PatchRecipe

    Returns
    -------
    ShapeDescriptor or PatchDescriptor

    Raises
    ------
    InvalidShapeError
        As `describe_mesh` or `describe_patches`.
    """
    return kind_of(recipe).describe(mesh, recipe)


def describe_sides(mesh: TriangleMesh, recipe: AnyRecipe, *, n_views: int | None = None) -> Sequence[Descriptor]:
    """Describe what single viewpoints see of a closed shape, for an index that partial scans will ask.

    Parameters
    ----------
    mesh : TriangleMesh
    recipe : Recipe or PatchRecipe
    n_views : int, optional
        Viewpoints, spread evenly around the shape: by patches 6 and by heat 4 unless given.

    Returns
    -------
    sequence of ShapeDescriptor or PatchDescriptor
        At vertices of the whole shape; empty for an open one, which is a part already.
    """
    kind = kind_of(recipe)
    return kind.sides(mesh, recipe, kind.n_views if n_views is None else n_views)


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
