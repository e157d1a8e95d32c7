"""The rows of the database of an index: read all together, and checked against their digest."""

import json
import sqlite3
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple
from zlib import crc32

from eigenshape._errors import StoreError
from eigenshape.retrieval.kinds import AnyRecipe, recipe_from_text, recipe_to_text

APPLICATION = 0x65696773  # "eigs", by which SQLite files tell whose they are
FORMAT = 4  # of the tables and of the files beside the database; raised by every change
# A blob is the last column of its table, so that the others are read without it. Its checksum is
# part of the row, and the digest in `seal` is of all rows of all tables without their blobs, and of
# the number of changes that have been committed.
SCHEMA = """
CREATE TABLE recipe (
    id INTEGER PRIMARY KEY, fields TEXT NOT NULL UNIQUE, size INTEGER NOT NULL,
    blob_checksum INTEGER NOT NULL, codebook BLOB NOT NULL
);
CREATE TABLE shape (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, label TEXT, source TEXT, digest TEXT
);
CREATE TABLE descriptor (
    id INTEGER PRIMARY KEY,
    shape INTEGER NOT NULL REFERENCES shape ON DELETE CASCADE,
    recipe INTEGER NOT NULL REFERENCES recipe,
    view INTEGER NOT NULL,
    offset INTEGER NOT NULL, n_rows INTEGER NOT NULL, n_columns INTEGER NOT NULL,
    checksum INTEGER NOT NULL,
    blob_checksum INTEGER NOT NULL, details BLOB NOT NULL,
    UNIQUE (shape, recipe, view)
);
CREATE TABLE seal (n_changes INTEGER NOT NULL, digest TEXT NOT NULL);
"""


class RecipeRow(NamedTuple):
    """A recipe, without its codebook; `size` is the number of committed bytes of rows."""

    id: int
    fields: str
    size: int
    blob_checksum: int


class ShapeRow(NamedTuple):
    """A shape."""

    id: int
    name: str
    label: str | None
    source: str | None
    digest: str | None


class DescriptorRow(NamedTuple):
    """A descriptor, without its details; `checksum` is of its rows in the file of its recipe."""

    id: int
    shape: int
    recipe: int
    view: int
    offset: int
    n_rows: int
    n_columns: int
    checksum: int
    blob_checksum: int


@dataclass(frozen=True)
class Catalog:
    """All rows of the database, in the order of their numbers. Blobs are read when needed."""

    path: Path
    database: sqlite3.Connection
    recipe_rows: list[RecipeRow]
    shapes: list[ShapeRow]
    descriptors: list[DescriptorRow]
    n_changes: int

    def recipes(self) -> list[tuple[int, AnyRecipe]]:
        """Return the number of each recipe, and the recipe."""
        return [(row.id, self._recipe(row)) for row in self.recipe_rows]

    def _recipe(self, row: RecipeRow) -> AnyRecipe:
        codebook = self._blob("SELECT codebook FROM recipe WHERE id = ?", row)
        try:
            return recipe_from_text(row.fields, codebook or None)
        except (TypeError, ValueError) as err:
            raise StoreError(
                f"Recipes of an index must be known to this version of eigenshape; {row.fields} is "
                f"not: {err}. Use the version that wrote it, or index the shapes again."
            ) from err

    def recipe_id(self, recipe: AnyRecipe) -> int | None:
        """Return the number of a recipe, or None if it is not stored.

        A field that a stored recipe lacks, since it was introduced later, has its default.
        """
        return next((number for number, other in self.recipes() if other == recipe), None)

    def shape(self, name: str) -> ShapeRow | None:
        """Return the shape of a name, or None if there is none."""
        return next((shape for shape in self.shapes if shape.name == name), None)

    def without(self, shape: ShapeRow) -> "Catalog":
        """Delete a shape and its descriptors, and return the catalog of the rest."""
        self.database.execute("DELETE FROM shape WHERE id = ?", (shape.id,))
        shapes = [other for other in self.shapes if other != shape]
        descriptors = [row for row in self.descriptors if row.shape != shape.id]
        return replace(self, shapes=shapes, descriptors=descriptors)

    def details(self, row: DescriptorRow) -> bytes:
        """Return the details of a descriptor."""
        return self._blob("SELECT details FROM descriptor WHERE id = ?", row)

    def _blob(self, query: str, row: RecipeRow | DescriptorRow) -> bytes:
        found = self.database.execute(query, (row.id,)).fetchone()
        blob = found[0] if found else None
        if not isinstance(blob, bytes) or crc32(blob) != row.blob_checksum:
            kind = type(row).__name__.removesuffix("Row").lower()
            raise StoreError(
                f"{self.path} must hold what was written; the bytes of {kind} {row.id} differ. "
                "Index the shapes again."
            )
        return blob


def create_tables(database: sqlite3.Connection) -> None:
    """Make the tables of an empty index, in the open transaction."""
    for statement in SCHEMA.split(";"):
        database.execute(statement)
    database.execute(f"PRAGMA application_id = {APPLICATION}")
    database.execute(f"PRAGMA user_version = {FORMAT}")
    database.execute("INSERT INTO seal VALUES (0, '')")
    seal(database, 0)


def read_catalog(path: Path, database: sqlite3.Connection) -> Catalog:
    """Read all rows of an open database, and check that they are as written and none is missing.

    Raises
    ------
    StoreError
        If the database is not an index of this format, or its rows differ from their digest.
    """
    (application,) = database.execute("PRAGMA application_id").fetchone()
    (version,) = database.execute("PRAGMA user_version").fetchone()
    if application != APPLICATION:
        raise StoreError(
            f"{path} must be an index of eigenshape; it belongs to another program. Choose another "
            "folder."
        )
    if version != FORMAT:
        raise StoreError(
            f"{path} must be an index of format {FORMAT}; it is of format {version}. "
            "Use the version of eigenshape that made it, or index the shapes again."
        )
    rows = _all_rows(database)
    sealed = database.execute("SELECT n_changes, digest FROM seal").fetchall()
    if len(sealed) != 1 or sealed[0][1] != _digest(sealed[0][0], rows):
        raise StoreError(
            f"{path} must hold what was written; its rows differ from their digest. "
            "Index the shapes again."
        )
    return Catalog(path, database, *rows, sealed[0][0])


def seal(database: sqlite3.Connection, n_changes: int) -> None:
    """Store the digest of all rows, before a writer commits them."""
    digest = _digest(n_changes, _all_rows(database))
    database.execute("UPDATE seal SET n_changes = ?, digest = ?", (n_changes, digest))


def _all_rows(
    database: sqlite3.Connection,
) -> tuple[list[RecipeRow], list[ShapeRow], list[DescriptorRow]]:
    return (
        _rows_of(database, "recipe", RecipeRow),
        _rows_of(database, "shape", ShapeRow),
        _rows_of(database, "descriptor", DescriptorRow),
    )


def _rows_of(database: sqlite3.Connection, table: str, row: Any) -> list[Any]:
    # NOT INDEXED walks through the table itself: a search by number or by an index of SQLite can
    # silently miss rows if one bit of an inner page is wrong.
    query = f"SELECT {', '.join(row._fields)} FROM {table} NOT INDEXED"
    return [row(*values) for values in database.execute(query).fetchall()]


def _digest(n_changes: Any, rows: tuple[list[Any], ...]) -> str:
    # JSON is the same text in every version of Python; `default` is for a value whose type was
    # damaged.
    return sha256(json.dumps([n_changes, rows], default=repr).encode()).hexdigest()


def keep_recipe(catalog: Catalog, recipe: AnyRecipe) -> int:
    """Return the number of a recipe; store the recipe under a new number if it is new."""
    number = catalog.recipe_id(recipe)
    if number is not None:
        return number
    fields, codebook = recipe_to_text(recipe)
    values = (fields, 0, crc32(codebook or b""), codebook or b"")
    query = "INSERT INTO recipe (fields, size, blob_checksum, codebook) VALUES (?, ?, ?, ?)"
    return int(catalog.database.execute(query, values).lastrowid or 0)
