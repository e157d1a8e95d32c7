"""The recipe of each method of describing shapes, for an index or a query."""

from collections.abc import Sequence
from functools import partial

from eigenshape._errors import StoreError
from eigenshape._workers import Item, Workers
from eigenshape.cli.console import batch_reporter, err, progress_bar
from eigenshape.cli.inputs import PATCHES, require_method
from eigenshape.cli.steps.reading import read_repaired
from eigenshape.retrieval.heat.recipe import PRESETS, HeatRecipe
from eigenshape.retrieval.kinds import AnyRecipe
from eigenshape.retrieval.patches.codebook import default_codebook
from eigenshape.retrieval.patches.descriptor import PatchRecipe
from eigenshape.retrieval.store.batch import train_codebook_from_files
from eigenshape.retrieval.store.index import ShapeIndex


def heat_recipe(name: str) -> HeatRecipe:
    """Return the recipe of a heat method."""
    require_method(name, tuple(PRESETS))
    return PRESETS[name]


def index_recipe(
    shelf: ShapeIndex, name: str, items: Sequence[Item], repairs: tuple[str, ...], workers: Workers
) -> AnyRecipe:
    """Return the recipe of a method for an index; for patches, learn a codebook if it has none."""
    if name != PATCHES:
        return PRESETS[name]
    recipe = _patch_recipe(shelf)
    if recipe is None:
        with progress_bar("codebook") as progress:
            codebook = train_codebook_from_files(
                items,
                partial(read_repaired, names=repairs),
                workers=workers,
                callback=batch_reporter(progress),
            )
        err.print(
            "codebook: the one that comes with eigenshape, because there are too few shapes to learn from"
            if codebook == default_codebook()
            else "codebook: learned from the shapes of this index"
        )
        recipe = PatchRecipe(codebook)
        shelf.keep_recipe(recipe)
        # Of several processes that fill a new index, all take the codebook of the first.
        recipe = _patch_recipe(shelf) or recipe
    return recipe


def query_recipe(shelf: ShapeIndex, name: str | None) -> AnyRecipe:
    """Return the recipe of a method by which an index can answer; without a name, its own."""
    if name is None:
        return shelf.default_recipe()
    if name == PATCHES:
        recipe: AnyRecipe | None = _patch_recipe(shelf)
    else:
        recipe = PRESETS[name] if PRESETS[name] in shelf.recipes() else None
    if recipe is None:
        raise StoreError(
            f"An index answers by the methods that it was made with; {shelf.folder} has no "
            f"descriptions by {name}. Run `eigenshape index` with --method {name} first."
        )
    return recipe


def _patch_recipe(shelf: ShapeIndex) -> PatchRecipe | None:
    return next((recipe for recipe in shelf.recipes() if isinstance(recipe, PatchRecipe)), None)
