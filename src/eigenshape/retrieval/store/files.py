"""The files of an index: rows of numbers, and a SQLite database that says which of them count.

A descriptor is written behind the last row that the database lists, forced to disk, and then
committed by one SQLite transaction. If the writer dies before the commit, its bytes belong to no
descriptor, and the next writer overwrites them. Readers see what is committed and never wait. What
they read is verified: rows by their checksums, the database by `catalog`. SQLite keeps the latest
changes in a log beside the database; a file of its own holds the number of all changes, so that a
lost log is noticed.
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
from eigenshape.retrieval.store.catalog import (
    Catalog,
    DescriptorRow,
    create_tables,
    read_catalog,
    seal,
)

DATABASE = "index.sqlite"
DRAFT = "draft.sqlite"  # the database until it is complete
LOCK = "writer.lock"
WRITER = "writer.txt"  # names the process that writes, for messages
COMMITTED = "committed.txt"  # the number of all changes, twice
LONGEST_WAIT = 5.0  # seconds for another writer to end; adding a shape takes milliseconds
# Errors that a damaged file causes: SQLite quotes bytes of it in messages, which may be no text.
DAMAGE = (sqlite3.Error, UnicodeError)


def create(folder: Path) -> None:
    """Make an empty store. If the process dies meanwhile, the same call can be repeated.

    Raises
    ------
    StoreError
        If the folder holds a store or anything else, or cannot be made.
    """
    with _creating(folder):
        _require_empty(folder)
        _make(folder)


def create_if_missing(folder: Path) -> None:
    """Make an empty store if there is none; of several callers at once, one makes it.

    Raises
    ------
    StoreError
        If the folder holds something else or cannot be made.
    """
    if (folder / DATABASE).is_file():  # without the lock, which needs the right to write
        return
    with _creating(folder):
        if not (folder / DATABASE).is_file():
            _require_empty(folder)
            _make(folder)


@contextmanager
def _creating(folder: Path) -> Iterator[None]:
    """Lock a folder that is new, empty or a store; leave any other folder untouched."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as err:
        raise StoreError(
            f"An index needs a folder; {folder} cannot be made: {err.strerror}. "
            "Choose another folder."
        ) from err
    _require_empty(folder, or_store=True)
    with _lock(folder):
        yield


def _require_empty(folder: Path, *, or_store: bool = False) -> None:
    names = {entry.name for entry in folder.iterdir()} - {LOCK, WRITER, COMMITTED}
    # Looked for after the names, since another process may have made it meanwhile.
    if or_store and (folder / DATABASE).is_file():
        return
    if not all(name.startswith(DRAFT) for name in names):
        raise StoreError(
            f"{folder} must be empty to become an index; it is not. Open it if it is an index, or "
            "choose another folder."
        )


def _make(folder: Path) -> None:
    for left in folder.glob(f"{DRAFT}*"):
        left.unlink()
    with closing(sqlite3.connect(folder / DRAFT, isolation_level=None)) as database:
        database.execute("BEGIN")
        create_tables(database)
        database.execute("COMMIT")
        database.execute("PRAGMA journal_mode = WAL")
    _keep_count(folder, 0)
    (folder / DRAFT).replace(folder / DATABASE)
    _sync(folder)


def _sync(folder: Path) -> None:
    """Force the names of new files to disk, on systems where a folder can be opened for that."""
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _require_database(folder: Path) -> None:
    if not (folder / DATABASE).is_file():
        raise StoreError(
            f"{folder} must be an index; it has no {DATABASE}. Create one with "
            "ShapeIndex.create, or with `eigenshape index` on the command line."
        )


@contextmanager
def reading(folder: Path) -> Iterator[Catalog]:
    """Open the database to read one consistent state, even if the folder is read-only.

    Raises
    ------
    StoreError
        If the folder is not a store of this format, or something in it is damaged.
    """
    _require_database(folder)
    try:
        with closing(_connect_to_read(folder)) as database:
            committed = _read_count(folder)  # before BEGIN, so that the state is not older
            database.execute("BEGIN")
            yield _whole_catalog(folder, database, committed)
    except DAMAGE as err:
        raise StoreError(
            f"{folder / DATABASE} must be a readable index; {err}. Index the shapes again."
        ) from err


def _connect_to_read(folder: Path) -> sqlite3.Connection:
    database = _connect(folder, "mode=ro")
    try:
        database.execute("SELECT count(*) FROM sqlite_master")
    except sqlite3.Error as err:
        database.close()
        if not isinstance(err, sqlite3.OperationalError) or os.access(folder, os.W_OK):
            raise
        log = folder / f"{DATABASE}-wal"
        if log.exists() and log.stat().st_size:
            raise StoreError(
                f"{folder} must be writable to be read as long as {log.name} holds changes. "
                "Read it once with the right to write, or copy it to a writable folder."
            ) from err
        database = _connect(folder, "mode=ro&immutable=1")
    return database


def _connect(folder: Path, mode: str) -> sqlite3.Connection:
    uri = f"{(folder / DATABASE).absolute().as_uri()}?{mode}"
    return sqlite3.connect(uri, uri=True, isolation_level=None)


def _whole_catalog(folder: Path, database: sqlite3.Connection, committed: bytes) -> Catalog:
    """Read the catalog, and raise an error if it lacks committed changes.

    Changes stay in a log beside the database as long as a process reads, and SQLite ignores all of
    the log that follows a damaged bit.
    """
    catalog = read_catalog(folder / DATABASE, database)
    count, _, again = committed.partition(b" ")
    if count != again or not count.isdigit():
        raise StoreError(
            f"{folder / COMMITTED} must hold a number twice; it holds {committed!r}. "
            "Index the shapes again."
        )
    if catalog.n_changes < int(count):
        raise StoreError(
            f"{folder} must hold all {int(count)} changes that were committed; it holds "
            f"{catalog.n_changes}. Its file {DATABASE}-wal is damaged, or was not copied with the "
            "others. Copy all files, or index the shapes again."
        )
    return catalog


def _read_count(folder: Path) -> bytes:
    path = folder / COMMITTED
    return path.read_bytes() if path.exists() else b""


def _keep_count(folder: Path, n_changes: int) -> None:
    beside = folder / f"{DRAFT}.{COMMITTED}"
    with beside.open("wb") as file:
        file.write(f"{n_changes} {n_changes}".encode())
        file.flush()
        os.fsync(file.fileno())
    beside.replace(folder / COMMITTED)
    _sync(folder)


@contextmanager
def writing(folder: Path) -> Iterator[Catalog]:
    """Open the database to write. At the end of the block all changes are committed, or none.

    The catalog is that from before the block.

    Raises
    ------
    StoreError
        If the folder is not a store of this format, something in it is damaged, or another process
        is writing.
    """
    _require_database(folder)
    try:
        with _lock(folder), closing(_connect(folder, "mode=rw")) as database:
            database.execute("PRAGMA foreign_keys = ON")
            database.execute("PRAGMA synchronous = FULL")
            database.execute("BEGIN IMMEDIATE")
            catalog = _whole_catalog(folder, database, _read_count(folder))
            yield catalog
            seal(database, catalog.n_changes + 1)
            database.execute("COMMIT")  # if the block raises before, closing rolls back
            _keep_count(folder, catalog.n_changes + 1)
    except DAMAGE as err:
        raise StoreError(
            f"{folder / DATABASE} must be a writable index; {err}. Index the shapes again."
        ) from err


@contextmanager
def _lock(folder: Path) -> Iterator[None]:
    lock = FileLock(folder / LOCK, timeout=LONGEST_WAIT)
    holder = folder / WRITER
    try:
        lock.acquire()
    except Timeout as err:
        who = holder.read_text(errors="replace") if holder.exists() else "another process"
        raise StoreError(
            f"An index has one writer at a time; {who} has held {folder / LOCK} for more than "
            f"{LONGEST_WAIT:g} s. Wait for it to end."
        ) from err
    except OSError as err:
        raise StoreError(
            f"An index can change only in a writable folder; {folder}: {err.strerror}. "
            "Copy it to a writable folder."
        ) from err
    try:
        holder.write_text(f"process {os.getpid()} on {socket.gethostname()}")
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def rows_path(folder: Path, recipe: int) -> Path:
    """Return the file that holds the rows of a recipe."""
    return folder / f"rows-{recipe}.bin"


def append_rows(folder: Path, database: sqlite3.Connection, recipe: int, rows: np.ndarray) -> int:
    """Write rows behind the committed ones, force them to disk, and return where they begin."""
    (offset,) = database.execute("SELECT size FROM recipe WHERE id = ?", (recipe,)).fetchone()
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
    return int(offset)


def read_rows(
    data: memoryview, row: DescriptorRow, row_type: "np.dtype[Any]", path: Path
) -> np.ndarray:
    """Return the rows of a descriptor, as numbers of a type.

    Raises
    ------
    StoreError
        If they are not there, or not what was written.
    """
    begin, count = row.offset, row.n_rows * row.n_columns
    end = begin + count * row_type.itemsize
    if end > len(data):
        raise StoreError(
            f"{path} must hold {end} bytes; it holds {len(data)}. Index the shapes again."
        )
    if crc32(data[begin:end]) != row.checksum:
        raise StoreError(
            f"{path} must hold what was written; bytes {begin} to {end} differ. "
            "Index the shapes again."
        )
    return np.frombuffer(data, row_type, count, begin).reshape(row.n_rows, row.n_columns)
