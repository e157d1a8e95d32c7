"""Rows of numbers beside a SQLite database that says which of them count.

A descriptor is written behind the last row that the database knows of, forced to disk, and then committed by one SQLite
transaction. A writer that dies before the commit leaves bytes that nobody owns; the next writer takes their place.
Readers see what is committed and never wait.
"""

import os
import socket
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from filelock import FileLock, Timeout

from eigenshape._errors import StoreError
from eigenshape.retrieval.kinds import AnyRecipe, read, written

DATABASE = "index.sqlite"
DRAFT = "draft.sqlite"
LOCK = "writer.lock"
HOLDER = "writer.txt"
APPLICATION = 0x65696773  # "eigs"
FORMAT = 2
WAIT = 5.0  # seconds for another writer
SCHEMA = """
CREATE TABLE recipe (id INTEGER PRIMARY KEY, fields TEXT NOT NULL UNIQUE, words BLOB, size INTEGER NOT NULL);
CREATE TABLE shape (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, label TEXT, source TEXT, digest TEXT
);
CREATE TABLE descriptor (
    shape INTEGER NOT NULL REFERENCES shape ON DELETE CASCADE,
    recipe INTEGER NOT NULL REFERENCES recipe,
    view INTEGER NOT NULL,
    offset INTEGER NOT NULL, n_rows INTEGER NOT NULL, n_columns INTEGER NOT NULL, checksum INTEGER NOT NULL,
    details BLOB NOT NULL,
    PRIMARY KEY (shape, recipe, view)
);
"""


def create(folder: Path) -> None:
    """Make an empty store; whoever dies on the way leaves a folder in which it can be made.

    Raises
    ------
    StoreError
        If there is one already, or the folder holds something else or cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as err:
        raise StoreError(f"An index needs a folder; {folder} cannot be made: {err.strerror}.") from err
    _require_empty(folder)  # before the lock leaves its file in a folder that is not ours
    with _lock(folder):
        _require_empty(folder)
        for left in folder.glob(f"{DRAFT}*"):
            left.unlink()
        with closing(sqlite3.connect(folder / DRAFT, isolation_level=None)) as database:
            database.executescript(
                f"BEGIN; {SCHEMA} PRAGMA application_id = {APPLICATION}; PRAGMA user_version = {FORMAT}; COMMIT;"
                "PRAGMA journal_mode = WAL;"
            )
        (folder / DRAFT).replace(folder / DATABASE)
        _sync(folder)


def _require_empty(folder: Path) -> None:
    if any(entry.name not in (LOCK, HOLDER) and not entry.name.startswith(DRAFT) for entry in folder.iterdir()):
        raise StoreError(f"{folder} must be empty to become an index; it is not. Open it, or choose another folder.")


def _sync(folder: Path) -> None:
    """Force the names of new files to disk, where a folder can be opened for that."""
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        os.fsync(handle)
        os.close(handle)


def require(folder: Path) -> None:
    """Refuse a folder that is not a store of this format.

    Raises
    ------
    StoreError
        Saying what is there instead.
    """
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


def _require_database(folder: Path) -> None:
    if not (folder / DATABASE).is_file():
        raise StoreError(f"{folder} must be an index; it has no {DATABASE}.")


@contextmanager
def reading(folder: Path) -> Iterator[sqlite3.Connection]:
    """Open the database to read one consistent state, also where the folder cannot be written."""
    _require_database(folder)
    try:
        with closing(_connect_to_read(folder)) as database:
            database.execute("BEGIN")
            yield database
    except sqlite3.Error as err:
        raise StoreError(f"{folder / DATABASE} must be a readable index; {err}.") from err


def _connect_to_read(folder: Path) -> sqlite3.Connection:
    database = _connect(folder, "mode=ro")
    try:
        database.execute("SELECT count(*) FROM sqlite_master")
    except sqlite3.OperationalError as err:
        database.close()
        if os.access(folder, os.W_OK):
            raise
        log = folder / f"{DATABASE}-wal"
        if log.exists() and log.stat().st_size:
            raise StoreError(
                f"{folder} must be writable to be read as long as {log.name} holds changes. "
                "Read it once from where it can be written, or copy it to such a place."
            ) from err
        database = _connect(folder, "mode=ro&immutable=1")
    return database


def _connect(folder: Path, mode: str) -> sqlite3.Connection:
    uri = f"{(folder / DATABASE).absolute().as_uri()}?{mode}"
    return sqlite3.connect(uri, uri=True, isolation_level=None)


@contextmanager
def writing(folder: Path) -> Iterator[sqlite3.Connection]:
    """Open the database as its one writer; what the block did is committed whole at its end, or not at all."""
    _require_database(folder)
    try:
        with _lock(folder), closing(_connect(folder, "mode=rw")) as database:
            database.execute("PRAGMA foreign_keys = ON")
            database.execute("PRAGMA synchronous = FULL")
            database.execute("BEGIN IMMEDIATE")
            yield database
            database.execute("COMMIT")  # whatever ends the block before, closing rolls back
    except sqlite3.Error as err:
        raise StoreError(f"{folder / DATABASE} must be a writable index; {err}.") from err


@contextmanager
def _lock(folder: Path) -> Iterator[None]:
    lock = FileLock(folder / LOCK, timeout=WAIT)
    holder = folder / HOLDER
    try:
        lock.acquire()
    except Timeout as err:
        who = holder.read_text() if holder.exists() else "another process"
        raise StoreError(
            f"An index has one writer; {who} has held {folder / LOCK} for more than {WAIT:g} s. Wait for it to end."
        ) from err
    except OSError as err:
        raise StoreError(f"An index changes only where one may write; of {folder}: {err.strerror}.") from err
    try:
        holder.write_text(f"process {os.getpid()} on {socket.gethostname()}")
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def recipe_id(database: sqlite3.Connection, recipe: AnyRecipe) -> int | None:
    """Return the number of a recipe, None where no descriptor was made by it.

    A field that a stored recipe lacks, since it is younger, counts as its default.
    """
    return next((number for number, other in recipes(database) if other == recipe), None)


def recipes(database: sqlite3.Connection) -> Iterator[tuple[int, AnyRecipe]]:
    """Yield the number of each recipe, and it."""
    for number, fields, words in database.execute("SELECT id, fields, words FROM recipe ORDER BY id").fetchall():
        yield int(number), read_recipe(fields, words)


def keep_recipe(database: sqlite3.Connection, recipe: AnyRecipe) -> int:
    """Return the number of a recipe, a new one where it is new."""
    number = recipe_id(database, recipe)
    if number is not None:
        return number
    row = database.execute("INSERT INTO recipe (fields, words, size) VALUES (?, ?, 0)", written(recipe))
    return int(row.lastrowid or 0)


def read_recipe(fields: str, words: bytes | None) -> AnyRecipe:
    """Return a recipe from its stored fields.

    Raises
    ------
    StoreError
        If this version of eigenshape knows no such recipe.
    """
    try:
        return read(fields, words)
    except (TypeError, ValueError) as err:
        raise StoreError(
            f"Recipes of an index must be known to this version of eigenshape; {fields} is not: {err}. "
            "Use the version that wrote it, or index the shapes again."
        ) from err


def rows_path(folder: Path, recipe: int) -> Path:
    """Return the file that holds the rows of a recipe."""
    return folder / f"rows-{recipe}.bin"


def append_rows(folder: Path, database: sqlite3.Connection, recipe: int, rows: np.ndarray) -> int:
    """Write rows behind the last committed ones and force them to disk; the byte at which they begin."""
    offset = int(database.execute("SELECT size FROM recipe WHERE id = ?", (recipe,)).fetchone()[0])
    data = rows.tobytes()
    path = rows_path(folder, recipe)
    if not path.exists():
        path.touch()
        _sync(folder)
    with path.open("r+b") as file:
        file.seek(offset)
        file.write(data)
        file.truncate()
        file.flush()
        os.fsync(file.fileno())
    database.execute("UPDATE recipe SET size = ? WHERE id = ?", (offset + len(data), recipe))
    return offset


def read_rows(data: memoryview, entry: "tuple[int, int, int, int]", row: "np.dtype[Any]", path: Path) -> np.ndarray:
    """Return the rows, of a type, that (offset, n_rows, n_columns, checksum) speaks of.

    Raises
    ------
    StoreError
        If they are not there, or not what was written.
    """
    offset, n_rows, n_columns, checksum = entry
    end = offset + n_rows * n_columns * row.itemsize
    if end > len(data):
        raise StoreError(f"{path} must hold {end} bytes; it holds {len(data)}. Index the shapes again.")
    if crc32(data[offset:end]) != checksum:
        raise StoreError(f"{path} must hold what was written; bytes {offset} to {end} differ. Index the shapes again.")
    return np.frombuffer(data, row, n_rows * n_columns, offset).reshape(n_rows, n_columns)
