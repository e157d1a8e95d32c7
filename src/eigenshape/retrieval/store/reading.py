"""All that a store holds of one recipe."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from eigenshape._errors import StoreError
from eigenshape.retrieval.store import files as store
from eigenshape.retrieval.store.catalog import Catalog, DescriptorRow, ShapeRow
from eigenshape.retrieval.store.kinds import AnyRecipe, Descriptor, kind_of


class Entry(NamedTuple):
    """A descriptor, but for its details, and its shape."""

    shape: ShapeRow
    kept: DescriptorRow


@dataclass(frozen=True)
class Held:
    """All descriptors of a recipe, by name and view."""

    recipe: AnyRecipe
    catalog: Catalog
    entries: list[Entry]
    rows: list[np.ndarray]

    def restored(self, place: int) -> Descriptor:
        """Return a descriptor with its details."""
        details = self.catalog.details(self.entries[place].kept)
        return kind_of(self.recipe).restored(self.rows[place], details, self.recipe)


def held_by(folder: Path, catalog: Catalog, recipe: AnyRecipe) -> Held:
    """Read all rows of a recipe.

    Raises
    ------
    StoreError
        If there are none, or a file is damaged.
    """
    number = catalog.recipe_id(recipe)
    shapes = {shape.id: shape for shape in catalog.shapes}
    entries = [
        Entry(shapes[kept.shape], kept) for kept in catalog.descriptors if kept.recipe == number
    ]
    if number is None or not entries:
        used = {kept.recipe for kept in catalog.descriptors}
        there = sorted(str(other.name) for number, other in catalog.recipes() if number in used)
        raise StoreError(
            f"An index answers in the recipes it holds; {folder} holds {', '.join(there) or 'no shape'} and "
            f"was asked in {recipe}."
        )
    entries.sort(key=lambda entry: (entry.shape.name, entry.kept.view))
    path = store.rows_path(folder, number)
    data = memoryview(path.read_bytes() if path.exists() else b"")
    row = kind_of(recipe).row
    return Held(
        recipe,
        catalog,
        entries,
        [store.read_rows(data, entry.kept, row, path) for entry in entries],
    )
