"""Read all descriptors that a store holds of one recipe."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from eigenshape._errors import StoreError
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, kind_of
from eigenshape.retrieval.store import files as store
from eigenshape.retrieval.store.catalog import Catalog, DescriptorRow, ShapeRow


class Entry(NamedTuple):
    """A row of the catalog of descriptors, and the shape that it describes."""

    shape: ShapeRow
    row: DescriptorRow


@dataclass(frozen=True)
class StoredDescriptors:
    """All descriptors of a recipe, sorted by name and view.

    Attributes
    ----------
    recipe : HeatRecipe or PatchRecipe
    catalog : Catalog
        From which details are read, one descriptor at a time.
    entries : list of Entry
    rows : list of (m, q) arrays
        The rows of each entry.
    """

    recipe: AnyRecipe
    catalog: Catalog
    entries: list[Entry]
    rows: list[np.ndarray]

    def descriptor(self, place: int) -> Descriptor:
        """Return a descriptor, with its details, by its place among the entries."""
        details = self.catalog.details(self.entries[place].row)
        restored: Descriptor = kind_of(self.recipe).restore(self.rows[place], details, self.recipe)
        return restored


def read_descriptors(folder: Path, catalog: Catalog, recipe: AnyRecipe) -> StoredDescriptors:
    """Read all rows of a recipe.

    Raises
    ------
    StoreError
        If there are none, or a file is damaged.
    """
    number = catalog.recipe_id(recipe)
    shapes = {shape.id: shape for shape in catalog.shapes}
    entries = [Entry(shapes[row.shape], row) for row in catalog.descriptors if row.recipe == number]
    if number is None or not entries:
        used = {row.recipe for row in catalog.descriptors}
        names = sorted(str(other.name) for number, other in catalog.recipes() if number in used)
        raise StoreError(
            f"An index must hold descriptors of the requested recipe; {folder} holds "
            f"{', '.join(names) or 'no shape'}, and {recipe} was requested."
        )
    entries.sort(key=lambda entry: (entry.shape.name, entry.row.view))
    path = store.rows_path(folder, number)
    data = memoryview(path.read_bytes() if path.exists() else b"")
    row_type = kind_of(recipe).row_type
    rows = [store.read_rows(data, entry.row, row_type, path) for entry in entries]
    return StoredDescriptors(recipe, catalog, entries, rows)
