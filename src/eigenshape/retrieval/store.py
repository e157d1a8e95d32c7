"""Rows of float32 beside a SQLite database that says which of them count.

A descriptor is written behind the last row that the database knows of, forced to disk, and then committed by one SQLite
transaction. A writer that dies before the commit leaves bytes that nobody owns; the next writer takes their place.
Readers see what is committed and never wait.
"""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from os import fsync
from pathlib import Path
from zlib import crc32

import numpy as np
from filelock import FileLock, Timeout
from jaxtyping import Float32

from eigenshape._errors import StoreError

DATABASE = "index.sqlite"
LOCK = "writer.lock"
APPLICATION = 0x65696773  # "eigs"
FORMAT = 1
WAIT = 5.0  # seconds for another writer
ROW = np.dtype("<f4")
SCHEMA = """
CREATE TABLE recipe (id INTEGER PRIMARY KEY, fields TEXT NOT NULL UNIQUE, size INTEGER NOT NULL);
CREATE TABLE shape (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, label TEXT, source TEXT, digest TEXT
);
CREATE TABLE descriptor (
    shape INTEGER NOT NULL REFERENCES shape ON DELETE CASCADE,
    recipe INTEGER NOT NULL REFERENCES recipe,
    view INTEGER NOT NULL,
    offset INTEGER NOT NULL, n_rows INTEGER NOT NULL, n_columns INTEGER NOT NULL, checksum INTEGER NOT NULL,
    vertices BLOB NOT NULL,
    PRIMARY KEY (shape, recipe, view)
);
"""


def create(folder: Path) -> None:
    """Make an empty store.

    Raises
    ------
    StoreError
        If there is one already, or the folder holds something else.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if any(entry.name != LOCK for entry in folder.iterdir()):
        raise StoreError(f"{folder} must be empty to become an index; it is not. Open it, or choose another folder.")
    with _lock(folder), closing(sqlite3.connect(folder / DATABASE, isolation_level=None)) as database:
        database.execute("PRAGMA journal_mode = WAL")
        database.executescript(
            f"BEGIN IMMEDIATE; {SCHEMA} PRAGMA application_id = {APPLICATION}; PRAGMA user_version = {FORMAT}; COMMIT;"
        )


def require(folder: Path) -> None:
    """Refuse a folder that is not a store of this format.

    Raises
    ------
    StoreError
        Saying what is there instead.
    """
    if not (folder / DATABASE).is_file():
        raise StoreError(f"{folder} must be an index; it has no {DATABASE}.")
    with reading(folder) as database:
        application = database.execute("PRAGMA application_id").fetchone()[0]
        version = database.execute("PRAGMA user_version").fetchone()[0]
    if application != APPLICATION:
        raise StoreError(f"{folder} must be an index of eigenshape; its {DATABASE} belongs to another program.")
    if version != FORMAT:
        raise StoreError(
            f"{folder} must be an index of format {FORMAT}; it is of format {version}. "
            "Use the version of eigenshape that made it, or index the shapes again."
        )


@contextmanager
def reading(folder: Path) -> Iterator[sqlite3.Connection]:
    """Open the database to read one consistent state, also where the folder cannot be written."""
    try:
        with closing(_connect_to_read(folder)) as database:
            database.execute("BEGIN")
            yield database
    except sqlite3.Error as err:
        raise StoreError(f"{folder / DATABASE} must be a readable index; {err}.") from err


def _connect_to_read(folder: Path) -> sqlite3.Connection:
    uri = (folder / DATABASE).absolute().as_uri()
    database = sqlite3.connect(f"{uri}?mode=ro", uri=True, isolation_level=None)
    try:
        database.execute("SELECT count(*) FROM sqlite_master")
    except sqlite3.OperationalError:  # nobody may write here, so nobody does
        database.close()
        database = sqlite3.connect(f"{uri}?mode=ro&immutable=1", uri=True, isolation_level=None)
    return database


@contextmanager
def writing(folder: Path) -> Iterator[sqlite3.Connection]:
    """Open the database as its one writer; what the block did is committed whole at its end, or not at all."""
    try:
        with _lock(folder), closing(sqlite3.connect(folder / DATABASE, isolation_level=None)) as database:
            database.execute("PRAGMA foreign_keys = ON")
            database.execute("PRAGMA synchronous = FULL")
            database.execute("BEGIN IMMEDIATE")
            try:
                yield database
                database.execute("COMMIT")
            except BaseException:
                database.execute("ROLLBACK")
                raise
    except sqlite3.Error as err:
        raise StoreError(f"{folder / DATABASE} must be a writable index; {err}.") from err


@contextmanager
def _lock(folder: Path) -> Iterator[None]:
    try:
        with FileLock(folder / LOCK, timeout=WAIT):
            yield
    except Timeout as err:
        raise StoreError(
            f"An index has one writer; another has held {folder / LOCK} for more than {WAIT:g} s. Wait for it to end."
        ) from err


def recipe_id(database: sqlite3.Connection, fields: str) -> int | None:
    """Return the number of a recipe, None where no descriptor was made by it."""
    row = database.execute("SELECT id FROM recipe WHERE fields = ?", (fields,)).fetchone()
    return None if row is None else int(row[0])


def rows_path(folder: Path, recipe: int) -> Path:
    """Return the file that holds the rows of a recipe."""
    return folder / f"rows-{recipe}.f32"


def append_rows(folder: Path, database: sqlite3.Connection, recipe: int, rows: Float32[np.ndarray, "m q"]) -> int:
    """Write rows behind the last committed ones and force them to disk; the byte at which they begin."""
    offset = int(database.execute("SELECT size FROM recipe WHERE id = ?", (recipe,)).fetchone()[0])
    data = rows.astype(ROW).tobytes()
    path = rows_path(folder, recipe)
    path.touch()
    with path.open("r+b") as file:
        file.seek(offset)
        file.write(data)
        file.truncate()
        file.flush()
        fsync(file.fileno())
    database.execute("UPDATE recipe SET size = ? WHERE id = ?", (offset + len(data), recipe))
    return offset


def read_rows(data: memoryview, entry: "tuple[int, int, int, int]", path: Path) -> Float32[np.ndarray, "m q"]:
    """Return the rows that (offset, n_rows, n_columns, checksum) speaks of.

    Raises
    ------
    StoreError
        If they are not there, or not what was written.
    """
    offset, n_rows, n_columns, checksum = entry
    end = offset + n_rows * n_columns * ROW.itemsize
    if end > len(data):
        raise StoreError(f"{path} must hold {end} bytes; it holds {len(data)}. Index the shapes again.")
    if crc32(data[offset:end]) != checksum:
        raise StoreError(f"{path} must hold what was written; bytes {offset} to {end} differ. Index the shapes again.")
    return np.frombuffer(data, ROW, n_rows * n_columns, offset).reshape(n_rows, n_columns)
