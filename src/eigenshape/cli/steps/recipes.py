"""The recipe of each method of describing shapes, for an index or a query."""

from dataclasses import replace
from pathlib import Path
from pickle import UnpicklingError
from zipfile import BadZipFile

from certeig.kit.errors import FileFormatError, InvalidParameterError
from eigenshape._errors import StoreError
from eigenshape.cli.console import err
from eigenshape.retrieval.heat.recipe import SCALE_FREE, THESIS, HeatRecipe
from eigenshape.retrieval.index import ShapeIndex
from eigenshape.retrieval.patches.codebook import read_codebook
from eigenshape.retrieval.patches.descriptor import PatchRecipe

PRESETS = {recipe.name: recipe for recipe in (SCALE_FREE, THESIS)}


def index_recipe(
    index: ShapeIndex, name: str, codebook: Path | None, *, in_parts: bool, n_frames: int | None
) -> HeatRecipe | PatchRecipe | None:
    """Return the recipe by which an index describes shapes, or None if it is to learn a codebook."""
    if name != "patches":
        for option, value in (("--codebook", codebook), ("--frames", n_frames)):
            if value is not None:
                raise InvalidParameterError(
                    f"{option} is for --method patches; the method is {name}. Leave one of them out."
                )
        return PRESETS[name]
    kept = _patch_recipe(index)
    if kept is not None and n_frames not in (None, kept.n_frames):
        raise InvalidParameterError(
            f"All shapes of an index are described alike; {index.folder} has {kept.n_frames} frames "
            f"a shape. Leave --frames out, or choose another index."
        )
    if codebook is not None:
        wanted = kept.n_frames if kept else n_frames or 0
        if codebook.is_dir():  # another index
            found = _patch_recipe(ShapeIndex.open(codebook))
            if found is None:
                raise StoreError(
                    f"--codebook takes an index that has a codebook; {codebook} has none."
                )
            asked = replace(found, n_frames=wanted)
        else:
            try:
                asked = PatchRecipe(read_codebook(codebook.read_bytes()), n_frames=wanted)
            except (ValueError, TypeError, BadZipFile, UnpicklingError) as error:
                raise FileFormatError(
                    f"--codebook takes a file of `eigenshape index learn`; {codebook} is none: {error}."
                ) from error
        if kept not in (None, asked):
            raise InvalidParameterError(
                f"An index has one codebook; {index.folder} has another one than {codebook}. "
                "Leave --codebook out, or choose another index."
            )
        return asked
    if kept is None and in_parts:
        err.print(
            "codebook: the one that comes with eigenshape, so that the parts can be merged; "
            "`eigenshape index learn` makes another one"
        )
        return PatchRecipe(n_frames=n_frames or 0)
    return kept


def query_recipe(index: ShapeIndex, name: str | None) -> HeatRecipe | PatchRecipe:
    """Return the recipe of a method by which an index can answer; without a name, its own."""
    if name is None:
        return index.default_recipe()
    if name == "patches":
        recipe: HeatRecipe | PatchRecipe | None = _patch_recipe(index)
    else:
        recipe = PRESETS[name] if PRESETS[name] in index.recipes() else None
    if recipe is None:
        raise StoreError(
            f"An index answers by the methods that it was made with; {index.folder} has no "
            f"descriptions by {name}. Run `eigenshape index add` with --method {name} first."
        )
    return recipe


def _patch_recipe(index: ShapeIndex) -> PatchRecipe | None:
    return next((recipe for recipe in index.recipes() if isinstance(recipe, PatchRecipe)), None)
