"""The ways of describing that the command line knows by name."""

from collections.abc import Sequence
from functools import partial
from typing import Annotated

import typer

from eigenshape._errors import InvalidParameterError, StoreError
from eigenshape.cli.console import err, progress_bar, read_repaired, told_by
from eigenshape.retrieval.heat.descriptor import PRESETS, HeatRecipe
from eigenshape.retrieval.kinds import AnyRecipe
from eigenshape.retrieval.patches.codebook import default_codebook
from eigenshape.retrieval.patches.descriptor import PatchRecipe
from eigenshape.retrieval.store.batch import train_codebook_from_files
from eigenshape.retrieval.store.index import ShapeIndex
from eigenshape.retrieval.store.workers import Item, Workers

PATCHES = "patches"
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


def heat_preset(name: str) -> HeatRecipe:
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
    """Return the recipe of a preset for an index; for patches, learn a codebook if it has none."""
    if name != PATCHES:
        return PRESETS[name]
    recipe = _patch_recipe(shelf)
    if recipe is None:
        with progress_bar("codebook") as progress:
            codebook = train_codebook_from_files(
                items,
                partial(read_repaired, names=repairs),
                workers=workers,
                callback=told_by(progress),
            )
        err.print(
            "codebook of patches: the one of eigenshape, since there are few shapes to learn from"
            if codebook == default_codebook()
            else "codebook of patches: learned from shapes of this index"
        )
        recipe = PatchRecipe(codebook)
        shelf.keep_recipe(recipe)
        # Of several processes that fill a new index, all take the codebook of the first.
        recipe = _patch_recipe(shelf) or recipe
    return recipe


def recipe_to_ask(shelf: ShapeIndex, name: str | None) -> AnyRecipe:
    """Return the recipe of a preset by which an index can answer; without a name, its own."""
    if name is None:
        return shelf.default_recipe()
    if name != PATCHES:
        return PRESETS[name]
    recipe = _patch_recipe(shelf)
    if recipe is None:
        raise StoreError(
            f"An index must hold descriptors of the requested preset; {shelf.folder} holds no "
            "patches."
        )
    return recipe


def _patch_recipe(shelf: ShapeIndex) -> PatchRecipe | None:
    return next((recipe for recipe in shelf.recipes() if isinstance(recipe, PatchRecipe)), None)
