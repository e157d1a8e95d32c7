"""All that a store holds of one recipe."""

import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from eigenshape._errors import StoreError
from eigenshape.retrieval import store
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, kind_of


class Entry(NamedTuple):
    """What the database says of a descriptor, but for its details."""

    name: str
    label: str | None
    source: str | None
    view: int
    shape: int
    offset: int
    n_rows: int
    n_columns: int
    checksum: int


@dataclass(frozen=True)
class Held:
    """All descriptors of a recipe, by name and view."""

    recipe: AnyRecipe
    number: int
    entries: list[Entry]
    rows: list[np.ndarray]

    def restored(self, database: sqlite3.Connection, place: int) -> Descriptor:
        """Return a descriptor with its details."""
        entry = self.entries[place]
        query = "SELECT details FROM descriptor WHERE shape = ? AND recipe = ? AND view = ?"
        (details,) = database.execute(query, (entry.shape, self.number, entry.view)).fetchone()
        return kind_of(self.recipe).restored(self.rows[place], details, self.recipe)

    def descriptors(self, database: sqlite3.Connection) -> Sequence[Descriptor]:
        """Return all descriptors, each restored when it is asked for."""
        return _Restored(self, database)


@dataclass(frozen=True)
class _Restored(Sequence[Descriptor]):
    held: Held
    database: sqlite3.Connection

    def __len__(self) -> int:
        return len(self.held.rows)

    def __getitem__(self, place: Any) -> Any:
        return self.held.restored(self.database, place)


def held_by(folder: Path, database: sqlite3.Connection, recipe: AnyRecipe) -> Held:
    """Read all rows of a recipe.

    Raises
    ------
    StoreError
        If there are none, or a file is damaged.
    """
    number = store.recipe_id(database, recipe) or 0
    query = (
        "SELECT name, label, source, view, shape, offset, n_rows, n_columns, checksum "
        "FROM descriptor JOIN shape ON shape.id = shape WHERE recipe = ? ORDER BY name, view"
    )
    entries = [Entry(*row) for row in database.execute(query, (number,))]
    if not entries:
        used = {recipe for (recipe,) in database.execute("SELECT recipe FROM descriptor")}
        there = sorted(str(other.name) for number, other in store.recipes(database) if number in used)
        raise StoreError(
            f"An index answers in the recipes it holds; {folder} holds {', '.join(there) or 'no shape'} and "
            f"was asked in {recipe}."
        )
    path = store.rows_path(folder, number)
    data = memoryview(path.read_bytes() if path.exists() else b"")
    row = kind_of(recipe).row
    return Held(recipe, number, entries, [store.read_rows(data, entry[-4:], row, path) for entry in entries])
