"""The tables of an index: every row has a checksum, and every table a seal.

The seal of a table holds the number of its rows and the sum of their checksums, which does not
depend on the order of the rows. So a writer updates it at the cost of the rows that it adds or
deletes, and a reader notices each row that was changed, lost or doubled.
"""

import json
import sqlite3
import struct
from collections.abc import Iterator
from contextlib import closing
from functools import lru_cache
from typing import Any, NamedTuple
from zlib import crc32

from eigenshape._errors import StoreError
from eigenshape.retrieval.kinds import AnyRecipe, recipe_from_text, recipe_to_text
from eigenshape.retrieval.store.damage import Damage

DATABASE = "index.sqlite"
APPLICATION = 0x65696773  # "eigs", by which SQLite files tell whose they are
FORMAT = 8  # of the tables and of the files beside the database; raised by every change
MODULUS = 2**63  # of sums of checksums, so that SQLite stores them as integers
ROWS_AT_ONCE = 20_000  # rows of a table in memory at a time: 10 MB
# Errors that a damaged file causes: SQLite quotes bytes of it in messages, which may be no text.
DAMAGE = (sqlite3.Error, UnicodeError)
# The number of a row is never used twice: `seal` has the last one of each table. `touched` lists
# the shapes that were removed or replaced, 12 bytes each: a reader reads these alone, not the
# tables.
SCHEMA = """
CREATE TABLE recipe (
    id INTEGER PRIMARY KEY, fields TEXT NOT NULL UNIQUE, n_columns INTEGER NOT NULL,
    codebook_checksum INTEGER NOT NULL, checksum INTEGER NOT NULL
);
CREATE TABLE codebook (id INTEGER PRIMARY KEY, data BLOB NOT NULL);
CREATE TABLE file (
    id INTEGER PRIMARY KEY, folder TEXT, content TEXT NOT NULL, generation INTEGER NOT NULL,
    size INTEGER NOT NULL, checksum INTEGER NOT NULL
);
CREATE TABLE shape (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, label TEXT, source TEXT, digest TEXT,
    tags TEXT NOT NULL, attributes TEXT NOT NULL,
    thumbnail_file INTEGER NOT NULL, thumbnail_offset INTEGER NOT NULL,
    thumbnail_size INTEGER NOT NULL, thumbnail_checksum INTEGER NOT NULL,
    checksum INTEGER NOT NULL
);
CREATE TABLE descriptor (
    id INTEGER PRIMARY KEY, shape INTEGER NOT NULL, recipe INTEGER NOT NULL, view INTEGER NOT NULL,
    rows_file INTEGER NOT NULL, rows_offset INTEGER NOT NULL,
    n_rows INTEGER NOT NULL, n_columns INTEGER NOT NULL, rows_checksum INTEGER NOT NULL,
    details_file INTEGER NOT NULL, details_offset INTEGER NOT NULL,
    details_size INTEGER NOT NULL, details_checksum INTEGER NOT NULL,
    checksum INTEGER NOT NULL,
    UNIQUE (shape, recipe, view)
);
CREATE TABLE touched (id INTEGER PRIMARY KEY, shape INTEGER NOT NULL);
CREATE TABLE seal (
    id TEXT PRIMARY KEY, n_rows INTEGER NOT NULL, total INTEGER NOT NULL, last INTEGER NOT NULL,
    checksum INTEGER NOT NULL
);
"""
# The default is for a value whose type was damaged. Rows are flat: none is inside itself.
ENCODER = json.JSONEncoder(default=repr, check_circular=False)
DESCRIPTOR = struct.Struct("<13q")  # the numbers of a row of that table, for its checksum
Piece = tuple[int, int, int, int]  # file, offset, size and checksum of some bytes
# The row of `seal` that counts committed changes; its last number is that of the table `touched`.
CHANGES = "changes"


class RecipeRow(NamedTuple):
    """A recipe, without its codebook; `n_columns` is 0 until something is described by it."""

    id: int
    fields: str
    n_columns: int
    codebook_checksum: int


class FileRow(NamedTuple):
    """A file of numbers: `folder` is that of another index, relative to this one, or None.

    The first `size` bytes are committed. A compacted file is of the next generation.
    """

    id: int
    folder: str | None
    content: str
    generation: int
    size: int

    @property
    def name(self) -> str:
        """Return the name of the file in its folder."""
        return f"{self.content}.{self.generation}.bin" if self.generation else f"{self.content}.bin"


class ShapeRow(NamedTuple):
    """A shape; tags and attributes are JSON. `thumbnail_size` is 0 if there is no picture."""

    id: int
    name: str
    label: str | None
    source: str | None
    digest: str | None
    tags: str
    attributes: str
    thumbnail_file: int
    thumbnail_offset: int
    thumbnail_size: int
    thumbnail_checksum: int


class DescriptorRow(NamedTuple):
    """Where the numbers of a descriptor are, and their checksums."""

    id: int
    shape: int
    recipe: int
    view: int
    rows_file: int
    rows_offset: int
    n_rows: int
    n_columns: int
    rows_checksum: int
    details_file: int
    details_offset: int
    details_size: int
    details_checksum: int

    def pieces(self, number_size: int) -> dict[str, Piece]:
        """Return where the rows, of numbers of some bytes each, and the details are."""
        size = self.n_rows * self.n_columns * number_size
        return {
            "rows": (self.rows_file, self.rows_offset, size, self.rows_checksum),
            "details": (
                self.details_file,
                self.details_offset,
                self.details_size,
                self.details_checksum,
            ),
        }


class Seal(NamedTuple):
    """What a table holds: the number of rows, the sum of their checksums, and the last number."""

    id: str
    n_rows: int
    total: int
    last: int


class WholeRows(NamedTuple):
    """Values of rows that agree with their checksums, and the bytes that these are of."""

    rows: list[Any]
    texts: list[bytes]


TABLES: dict[str, Any] = {
    "recipe": RecipeRow,
    "file": FileRow,
    "shape": ShapeRow,
    "descriptor": DescriptorRow,
}


def row_text(values: tuple[Any, ...]) -> bytes:
    """Return the values of a row as bytes, the same in every version of Python."""
    return ENCODER.encode(values).encode()


def row_bytes(table: str, values: tuple[Any, ...]) -> bytes:
    """Return the bytes of a row of a table of which its checksum is."""
    if table != "descriptor":
        return row_text(values)
    try:  # integers alone, and as many as there are shapes: 8 times as fast
        return DESCRIPTOR.pack(*values)
    except struct.error:  # the type of a value was damaged
        return row_text(values)


def row_checksum(table: str, values: tuple[Any, ...]) -> int:
    """Return the checksum of the values of a row of a table."""
    return crc32(row_bytes(table, values))


def create_tables(database: sqlite3.Connection) -> None:
    """Make the tables of an empty index, in the open transaction."""
    for statement in SCHEMA.split(";"):
        database.execute(statement)
    database.execute(f"PRAGMA application_id = {APPLICATION}")
    database.execute(f"PRAGMA user_version = {FORMAT}")
    for name in (CHANGES, *TABLES):
        keep_seal(database, Seal(name, 0, 0, 0))


def keep_seal(database: sqlite3.Connection, seal: Seal) -> None:
    """Store a seal."""
    values = (*seal, row_checksum("seal", seal))
    database.execute("INSERT OR REPLACE INTO seal VALUES (?, ?, ?, ?, ?)", values)


def require_format(place: str, database: sqlite3.Connection) -> None:
    """Raise an error if a database is not an index of this format."""
    (application,) = database.execute("PRAGMA application_id").fetchone()
    (version,) = database.execute("PRAGMA user_version").fetchone()
    if application != APPLICATION:
        raise StoreError(
            f"{place} must be an index of eigenshape; it belongs to another program. Choose "
            "another folder."
        )
    if version != FORMAT:
        age = "an older" if version < FORMAT else "a newer"
        raise StoreError(
            f"{place} must be an index of format {FORMAT}; it is of format {version}, by {age} "
            "version of eigenshape. Index the shapes again, into another folder: `eigenshape "
            "index add NEW_FOLDER MESHES`."
        )


def read_seals(place: str, database: sqlite3.Connection) -> dict[str, Seal]:
    """Read the seals of all tables.

    Raises
    ------
    StoreError
        If one is damaged or missing.
    """
    rows = database.execute("SELECT * FROM seal NOT INDEXED").fetchall()
    seals = {row[0]: Seal(*row[:-1]) for row in rows if row_checksum("seal", row[:-1]) == row[-1]}
    for name in (CHANGES, *TABLES):
        if name not in seals:
            raise StoreError(
                f"{place} must hold what was written; the seal of {name} differs. Merge the index "
                "into a new one to keep what is whole, or index the shapes again."
            )
    return seals


class Tally:
    """The number of rows that were read of a table, and the sum of their checksums."""

    def __init__(self, n_rows: int = 0, total: int = 0) -> None:
        self.n_rows, self.total = n_rows, total

    def count(self, checksums: list[int]) -> None:
        """Count more rows."""
        self.n_rows += len(checksums)
        self.total = (self.total + sum(checksums)) % MODULUS

    def discount(self, checksums: list[int]) -> None:
        """Count rows no more."""
        self.n_rows -= len(checksums)
        self.total = (self.total - sum(checksums)) % MODULUS

    def agrees(self, seal: Seal) -> bool:
        """Return whether all rows of a seal were counted, and no others."""
        return (self.n_rows, self.total) == (seal.n_rows, seal.total)


def read_table(
    database: sqlite3.Connection, seal: Seal, damages: list[Damage]
) -> Iterator[WholeRows]:
    """Yield the whole rows of a table, some at a time; damage is appended to a list.

    If the table cannot be walked through, or the walk finds too few rows, the missing rows are
    searched for one by one by their number.
    """
    table, tally, found = seal.id, Tally(), set[int]()
    columns = ", ".join(TABLES[table]._fields)
    # NOT INDEXED walks through the table itself: a search by number or by an index of SQLite can
    # silently miss rows if one bit of an inner page is wrong.
    walk = f"SELECT {columns}, checksum FROM {table} NOT INDEXED"
    try:
        with closing(database.execute(walk)) as cursor:
            while chunk := cursor.fetchmany(ROWS_AT_ONCE):
                whole = _whole_rows(table, chunk, found, tally)
                found.update(row[0] for row in whole.rows)
                yield whole
    except DAMAGE:
        pass  # the rest is salvaged
    if tally.agrees(seal):
        return
    yield _whole_rows(table, _salvage(database, seal, found, damages), found, tally)
    if not tally.agrees(seal):
        lost = seal.n_rows - tally.n_rows
        damages.append(Damage(DATABASE, f"{lost} of {seal.n_rows} rows of table {table} are lost"))


def read_changed(
    database: sqlite3.Connection, before: Seal, now: Seal, touched: list[int], left: list[bytes]
) -> WholeRows | None:
    """Return what a table gained, and its rows of some shapes, or None if more has changed.

    Parameters
    ----------
    database : Connection
    before, now : Seal
        Of the table of shapes, or of descriptors.
    touched : list of int
        Shapes that were removed or replaced.
    left : list of bytes
        Of the rows of these shapes as they were before.
    """
    table, tally = now.id, Tally(before.n_rows, before.total)
    tally.discount([crc32(text) for text in left])
    rows = _rows_where(database, table, "id > ?", before.last)
    shape = "id" if table == "shape" else "shape"
    for number in touched:
        rows += _rows_where(database, table, f"{shape} = ? AND id <= ?", number, before.last)
    whole = _whole_rows(table, rows, set(), tally)
    return whole if tally.agrees(now) else None


def read_touched(database: sqlite3.Connection, before: Seal) -> list[int]:
    """Return the shapes that were removed or replaced since a seal of all changes."""
    query = "SELECT DISTINCT shape FROM touched WHERE id > ?"
    return [shape for (shape,) in database.execute(query, (before.last,))]


def read_named(database: sqlite3.Connection, name: str) -> tuple[WholeRows, WholeRows] | None:
    """Return the row of one shape and those of its descriptors, or None if these are in doubt.

    An index of SQLite finds them, which may silently miss rows, or lead to others, if a bit of it
    is wrong. A shape of which nothing is found is in doubt, therefore, and so is one with a
    descriptor beside those that were found: all by one recipe have numbers in a row.
    """
    found = _rows_where(database, "shape", "name = ?", name)
    shapes = _whole_rows("shape", found, set(), Tally())
    if [row.name for row in shapes.rows] != [name]:
        return None
    number = shapes.rows[0].id
    found = _rows_where(database, "descriptor", "shape = ?", number)
    descriptors = _whole_rows("descriptor", found, set(), Tally())
    ids = {row.id for row in descriptors.rows if row.shape == number}
    if not ids or len(ids) < len(found):
        return None
    query = "SELECT shape FROM descriptor NOT INDEXED WHERE id = ?"
    for beside in {each + step for each in ids for step in (-1, 1)} - ids:
        if database.execute(query, (beside,)).fetchone() == (number,):
            return None
    return shapes, descriptors


def _rows_where(
    database: sqlite3.Connection, table: str, condition: str, *values: Any
) -> list[Any]:
    columns = ", ".join(TABLES[table]._fields)
    query = f"SELECT {columns}, checksum FROM {table} WHERE {condition} ORDER BY id"
    return database.execute(query, values).fetchall()


def _whole_rows(table: str, rows: list[Any], found: set[int], tally: Tally) -> WholeRows:
    """Return the rows that agree with their checksums and were not found before, and count them."""
    kind, whole, texts, checksums = TABLES[table], [], [], []
    for row in rows:
        values, checksum = row[:-1], row[-1]
        text = row_bytes(table, values)
        if crc32(text) == checksum and row[0] not in found:
            whole.append(kind._make(values))
            texts.append(text)
            checksums.append(checksum)
    tally.count(checksums)
    return WholeRows(whole, texts)


def _salvage(
    database: sqlite3.Connection, seal: Seal, found: set[int], damages: list[Damage]
) -> list[Any]:
    """Return rows of a table that a walk did not find, with their checksums."""
    columns = ", ".join(TABLES[seal.id]._fields)
    query = f"SELECT {columns}, checksum FROM {seal.id} WHERE id = ?"
    text_factory = database.text_factory
    database.text_factory = lambda data: data.decode(errors="surrogateescape")
    salvaged = []
    for number in range(1, seal.last + 1):
        if number in found:
            continue
        try:
            row = database.execute(query, (number,)).fetchone()
        except DAMAGE as err:
            damages.append(Damage(DATABASE, f"row {number} of table {seal.id}: {err}"))
            continue
        if row is None:  # it was deleted, or is lost
            continue
        if row_checksum(seal.id, row[:-1]) == row[-1] and row[0] == number:
            salvaged.append(row)
        else:
            name = row[1] if seal.id == "shape" and isinstance(row[1], str) else None
            what = f"row {number} of table {seal.id} differs from its checksum"
            damages.append(Damage(DATABASE, what, shape=name))
    database.text_factory = text_factory
    return salvaged


def read_recipes(
    place: str, database: sqlite3.Connection, rows: list[RecipeRow], damages: list[Damage]
) -> dict[int, AnyRecipe]:
    """Return each recipe by its number; a damaged codebook is appended to a list.

    Raises
    ------
    StoreError
        If a recipe is not known to this version.
    """
    recipes = {}
    for row in rows:
        try:
            query = "SELECT data FROM codebook WHERE id = ?"
            found = database.execute(query, (row.id,)).fetchone()
        except DAMAGE:
            found = None
        codebook = found[0] if found else None
        if not isinstance(codebook, bytes) or crc32(codebook) != row.codebook_checksum:
            what = f"the codebook of recipe {row.id} differs from its checksum"
            damages.append(Damage(DATABASE, what))
            continue
        recipes[row.id] = _known_recipe(place, row.fields, codebook)
    return recipes


@lru_cache(maxsize=64)  # an index has a few recipes, and a codebook takes 31 KB
def _known_recipe(place: str, fields: str, codebook: bytes) -> AnyRecipe:
    try:
        return recipe_from_text(fields, codebook or None)
    except (KeyError, TypeError, ValueError) as err:
        raise StoreError(
            f"Recipes of an index must be known to this version of eigenshape; {fields} of "
            f"{place} is not: {err}. Use the version that wrote it, or index the shapes again."
        ) from err


def recipe_values(recipe: AnyRecipe) -> tuple[str, int, bytes]:
    """Return the text of a recipe, the checksum of its codebook, and the codebook."""
    fields, codebook = recipe_to_text(recipe)
    return fields, crc32(codebook or b""), codebook or b""
