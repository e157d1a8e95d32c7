"""The methods of describing shapes that the command line knows by name."""

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

HeatMethodOption = Annotated[
    str, typer.Option("--method", help=f"How shapes are described: {' or '.join(PRESETS)}.")
]
MethodOption = Annotated[
    str,
    typer.Option(
        "--method",
        help=f"How shapes are described: {', '.join(EVERY)}. patches is best for partial scans.",
    ),
]
StoredMethodOption = Annotated[
    str | None,
    typer.Option(
        "--method",
        help=(
            f"Which descriptions to compare: {', '.join(EVERY)}. By default the index's "
            "own, or patches if it has several."
        ),
    ),
]


def heat_recipe(name: str) -> Recipe:
    """Return the recipe of a heat method."""
    require_method(name, tuple(PRESETS))
    return PRESETS[name]


def require_method(name: str, names: Sequence[str] = EVERY) -> None:
    """Raise an error if the name is not one of the allowed names."""
    if name not in names:
        raise InvalidParameterError(f"--method takes {', '.join(names)}; it is {name!r}.")


def recipe_to_fill(
    shelf: ShapeIndex, name: str, items: Sequence[Item], repairs: tuple[str, ...], workers: Workers
) -> AnyRecipe:
    """Return the recipe of a method for an index. For patches it has a codebook, learned if the index has none."""
    if name != PATCHES:
        return PRESETS[name]
    held = _patch_recipe(shelf)
    if held is None:
        with progress_bar("codebook") as progress:
            book = learn_words(
                items,
                partial(teach, repairs=repairs),
                workers=workers,
                told=batch_reporter(progress),
            )
        err.print(
            "codebook: the one that comes with eigenshape, because there are too few shapes to learn from"
            if book == made_codebook()
            else "codebook: learned from the shapes of this index"
        )
        held = PatchRecipe(book)
        shelf.keep_recipe(held)
        held = (
            _patch_recipe(shelf) or held
        )  # if several processes start an index, all use the first one's codebook
    return held


def teach(path: Path, *, repairs: tuple[str, ...]) -> list[Patches]:
    """Return the patches of a file's mesh and of two views of it."""
    return seen_patches(read_repaired(path, repairs), n_views=TEACHING_VIEWS)


def recipe_to_ask(shelf: ShapeIndex, name: str | None) -> AnyRecipe:
    """Return the recipe of a method that an index can answer; without a name, the index's own."""
    patches = _patch_recipe(shelf)
    if name == PATCHES and patches is None:
        raise StoreError(
            f"An index answers by the methods that it was made with; {shelf.folder} has no patches. "
            "Run `eigenshape index` with --method patches first."
        )
    if patches is not None and name in (None, PATCHES):
        return patches
    return PRESETS[name] if name else next(iter(shelf.recipes()), SCALE_FREE)


def _patch_recipe(shelf: ShapeIndex) -> PatchRecipe | None:
    return next((recipe for recipe in shelf.recipes() if isinstance(recipe, PatchRecipe)), None)
