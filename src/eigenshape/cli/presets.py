"""The ways of describing that the command line knows by name."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from eigenshape._errors import InvalidParameterError, StoreError
from eigenshape.cli.console import batch_reporter, err, progress_bar
from eigenshape.cli.inputs import read_repaired
from eigenshape.retrieval.heat.descriptor import PRESETS, SCALE_FREE, Recipe
from eigenshape.retrieval.patches.codebook import made_codebook
from eigenshape.retrieval.patches.descriptor import PatchRecipe, seen_patches
from eigenshape.retrieval.patches.patches import Patches
from eigenshape.retrieval.store.batch import learn_words
from eigenshape.retrieval.store.index import ShapeIndex
from eigenshape.retrieval.store.kinds import AnyRecipe
from eigenshape.retrieval.store.workers import Item, Workers

PATCHES = "patches"
TEACHING_VIEWS = 2
EVERY = (PATCHES, *PRESETS)

HeatPresetOption = Annotated[
    str, typer.Option("--preset", help=f"How shapes are described: {' or '.join(PRESETS)}.")
]
PresetOption = Annotated[
    str,
    typer.Option(
        "--preset",
        help=f"How shapes are described: {', '.join(EVERY)}; patches are best for partial scans.",
    ),
]
HeldPresetOption = Annotated[
    str | None,
    typer.Option(
        "--preset",
        help=(
            f"Which descriptions to compare: {', '.join(EVERY)}. By default the index's "
            "own, or patches if it has several."
        ),
    ),
]


def heat_preset(name: str) -> Recipe:
    """Look up a recipe of heat by the name that a user typed."""
    require_preset(name, tuple(PRESETS))
    return PRESETS[name]


def require_preset(name: str, names: Sequence[str] = EVERY) -> None:
    """Refuse a name that is none of some."""
    if name not in names:
        raise InvalidParameterError(f"--preset takes {' or '.join(names)}; it was given {name!r}.")


def recipe_to_fill(
    shelf: ShapeIndex, name: str, items: Sequence[Item], repairs: tuple[str, ...], workers: Workers
) -> AnyRecipe:
    """Return the recipe of a preset for an index: for patches with its words, which it learns if it has none yet."""
    if name != PATCHES:
        return PRESETS[name]
    held = _patch_recipe(shelf)
    if held is None:
        with progress_bar("words") as progress:
            book = learn_words(
                items,
                partial(teach, repairs=repairs),
                workers=workers,
                told=batch_reporter(progress),
            )
        err.print(
            "words of patches: those that come with eigenshape, since there are few shapes to learn from"
            if book == made_codebook()
            else "words of patches: learnt from shapes of this index"
        )
        held = PatchRecipe(book)
        shelf.keep_recipe(held)
        held = (
            _patch_recipe(shelf) or held
        )  # of several first writers, the words of the first serve all
    return held


def teach(path: Path, *, repairs: tuple[str, ...]) -> list[Patches]:
    """Return the patches of a file's mesh and of two views of it."""
    return seen_patches(read_repaired(path, repairs), n_views=TEACHING_VIEWS)


def recipe_to_ask(shelf: ShapeIndex, name: str | None) -> AnyRecipe:
    """Return the recipe of a preset in which an index can answer; without name, its own."""
    patches = _patch_recipe(shelf)
    if name == PATCHES and patches is None:
        raise StoreError(
            f"An index answers in the recipes it holds; {shelf.folder} holds no patches."
        )
    if patches is not None and name in (None, PATCHES):
        return patches
    return PRESETS[name] if name else next(iter(shelf.recipes()), SCALE_FREE)


def _patch_recipe(shelf: ShapeIndex) -> PatchRecipe | None:
    return next((recipe for recipe in shelf.recipes() if isinstance(recipe, PatchRecipe)), None)
