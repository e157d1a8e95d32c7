"""The one file of an index: its tables, and reading their rows; see `_sealed` for how they are kept."""

import sqlite3
from contextlib import AbstractContextManager, suppress
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Int64

from eigenshape import _sealed
from eigenshape._errors import StoreError
from eigenshape._sealed import DAMAGE, Seal, checksum
from eigenshape.retrieval.kinds import AnyRecipe, recipe_from_text
from eigenshape.retrieval.store.damage import Damage

DATABASE = "index.sqlite"
ROWS_AT_ONCE = 20_000  # rows of integers in memory at a time, as Python objects: 10 MB

# The integers of a descriptor; those that search needs are read for all shapes at once.
INTEGERS = (
    "id",
    "shape",
    "recipe",
    "view",
    "n_rows",
    "n_columns",
    "rows_checksum",
    "details_checksum",
)
COLUMNS = np.dtype([(name, "<i8") for name in (*INTEGERS, "checksum")])
# A row of `descriptor` takes several pages, so its integers are also in an index of SQLite, from which
# they come out in a microsecond a shape. AUTOINCREMENT: no number is used twice.
INDEX = _sealed.Kind(
    "An index",
    format=10,
    tables={
        "recipe": """CREATE TABLE recipe (
    id INTEGER PRIMARY KEY, fields TEXT NOT NULL UNIQUE, n_columns INTEGER NOT NULL,
    codebook BLOB NOT NULL, checksum INTEGER NOT NULL)""",
        "shape": """CREATE TABLE shape (
    id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL UNIQUE, label TEXT, source TEXT,
    digest TEXT, tags TEXT NOT NULL, attributes TEXT NOT NULL, n_descriptors INTEGER NOT NULL,
    n_pictures INTEGER NOT NULL, checksum INTEGER NOT NULL)""",
        "picture": """CREATE TABLE picture (
    id INTEGER PRIMARY KEY, data BLOB NOT NULL, checksum INTEGER NOT NULL)""",
        "descriptor": """CREATE TABLE descriptor (
    id INTEGER PRIMARY KEY AUTOINCREMENT, shape INTEGER NOT NULL, recipe INTEGER NOT NULL,
    view INTEGER NOT NULL, n_rows INTEGER NOT NULL, n_columns INTEGER NOT NULL,
    rows_checksum INTEGER NOT NULL, details_checksum INTEGER NOT NULL, checksum INTEGER NOT NULL,
    rows BLOB NOT NULL, details BLOB NOT NULL, UNIQUE (shape, recipe, view))""",
    },
    more=(
        """CREATE INDEX integers ON descriptor (
    id, shape, recipe, view, n_rows, n_columns, rows_checksum, details_checksum, checksum)""",
    ),
    missing="Create one with ShapeIndex.create, or with `eigenshape index add` on the command line.",
    rescue="Merge the index into a new one to keep what is whole.",
    renew="index the shapes again",
    changes=_sealed.CHANGES,
    room="free some space (remove a few shapes at a time, then compact)",
    reserve=2**20,  # a shape takes 200 KB of the log to be removed, and ten take 1 MB
)
TABLES = tuple(INDEX.tables)
PRIME, FACTOR = (
    2**31 - 1,
    1_000_003,
)  # of checksums of integers, which NumPy makes of all rows at once


def integer_checksums(rows: Int64[np.ndarray, "k c"]) -> Int64[np.ndarray, " k"]:
    """Return the checksum of each row of integers: the value of a polynomial, modulo a prime."""
    found = np.zeros(len(rows), dtype=np.int64)
    for column in rows.T:
        found = (found * FACTOR + column) % PRIME
    return found


def create(folder: Path, *, exist_ok: bool = False) -> None:
    """Make an empty index. If the process dies meanwhile, the same call can be repeated.

    Raise StoreError if the folder holds anything, an index also unless `exist_ok`, or cannot be
    made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as err:
        raise StoreError(
            f"An index needs a folder; {folder} cannot be made: {err.strerror}. "
            "Choose another folder."
        ) from err
    # Before the database is looked for: what another process writes beside it comes after it.
    others = [path for path in folder.iterdir() if not path.name.startswith(DATABASE)]
    if exist_ok and (folder / DATABASE).is_file():  # whoever opens it sees whether it is an index
        return
    if others:
        raise _not_empty(folder)
    try:
        _sealed.create(INDEX, folder / DATABASE)
    except FileExistsError:
        if not exist_ok:
            raise _not_empty(folder) from None


def _not_empty(folder: Path) -> StoreError:
    return StoreError(
        f"{folder} must be empty to become an index; it is not. Open it if it is an index, or "
        "choose another folder."
    )


def writing(folder: Path, *, frees: bool = False) -> AbstractContextManager[sqlite3.Connection]:
    """Open an index to change it. At the end of the block all changes are committed, or none.

    Raise StoreError if the folder is not an index of this format, changes were lost, another
    process is writing, or the disk is full.
    """
    return _sealed.writing(INDEX, folder / DATABASE, frees=frees)


def open_to_read(folder: Path) -> sqlite3.Connection:
    """Return a connection in a transaction, which sees one state until it is closed."""
    return _sealed.open_to_read(INDEX, folder / DATABASE)


def read_seals(
    folder: Path, database: sqlite3.Connection, damages: list[Damage] | None = None
) -> dict[str, Seal]:
    """Read the seals of all tables; damage is noted in a list.

    Raise StoreError if one is damaged or missing, and no list is given.
    """
    damaged = None if damages is None else list[str]()
    seals = _sealed.read_seals(INDEX, folder / DATABASE, database, damaged)
    if damages is not None and damaged:
        damages += [Damage(DATABASE, f"the seal of table {name} differs") for name in damaged]
    return seals


def lost_changes(committed: int, seals: dict[str, Seal]) -> list[Damage]:
    """Return a damage if an index holds fewer changes than were committed."""
    lost = _sealed.lost_changes(committed, seals)
    return [] if lost is None else [Damage(f"{DATABASE}-wal", lost)]


def read_integers(
    database: sqlite3.Connection,
    seal: Seal,
    damages: list[Damage],
    before: np.ndarray | None,
) -> np.ndarray:
    """Return the integers of all descriptors, by their numbers; damage is appended to a list.

    If rows were added alone since `before`, only these are read.
    """
    if before is not None:
        last = int(before["id"][-1]) if len(before) else 0
        found = np.concatenate([before, _whole_integers(database, "INDEXED BY integers", last)])
        if (len(found), int(found["checksum"].sum())) == seal[:2]:
            return found
    found = np.empty(0, COLUMNS)
    # The index of SQLite first, and the table if a bit of that is damaged, which reads all pages.
    for source in ("INDEXED BY integers", "NOT INDEXED"):
        found = np.concatenate([found, _whole_integers(database, source, 0)])
        found = found[np.unique(found["id"], return_index=True)[1]]
        if (len(found), int(found["checksum"].sum())) == seal[:2]:
            return found
    what = f"{seal.n_rows - len(found)} of {seal.n_rows} rows of table descriptor are lost"
    damages.append(Damage(DATABASE, what))
    return found


def _whole_integers(database: sqlite3.Connection, source: str, last: int) -> np.ndarray:
    """Return the rows that agree with their checksums, up to the first that SQLite cannot read."""
    query = (
        f"SELECT {', '.join(COLUMNS.names or ())} FROM descriptor {source} WHERE id > ? ORDER BY id"
    )
    n_columns = len(INTEGERS) + 1
    chunks = [np.empty((0, n_columns), dtype=np.int64)]
    with suppress(*DAMAGE):
        cursor = database.execute(query, (last,))
        while rows := cursor.fetchmany(ROWS_AT_ONCE):
            try:
                chunks.append(np.array(rows, dtype=np.int64))
            except (TypeError, ValueError):  # the type of a value is damaged
                some = [row for row in rows if all(isinstance(each, int) for each in row)]
                chunks.append(np.array(some, dtype=np.int64).reshape(-1, n_columns))
    table = np.concatenate(chunks)
    whole = integer_checksums(table[:, :-1]) == table[:, -1]
    return np.ascontiguousarray(table[whole]).view(COLUMNS).reshape(-1)


def read_recipes(
    place: str, database: sqlite3.Connection, damages: list[Damage]
) -> dict[int, AnyRecipe]:
    """Return each recipe by its number; damage is appended to a list.

    Raise StoreError if a recipe is not known to this version.
    """
    recipes = {}
    query = "SELECT id, fields, n_columns, codebook, checksum FROM recipe NOT INDEXED"
    for *values, expected in database.execute(query).fetchall():
        if checksum(*values) == expected:
            recipes[values[0]] = _known_recipe(place, values[1], values[3])
        else:
            damages.append(Damage(DATABASE, f"recipe {values[0]} differs from its checksum"))
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
