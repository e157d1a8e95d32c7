"""The one file of an index: its tables, their checksums, and transactions on them.

Each row has a checksum, and `seal` holds, for each table, the number of its rows and the sum of their
checksums. Triggers keep these up to date, so a change costs the same at any size, and whoever reads a
whole table notices each row that was changed, lost or doubled.
"""

import json
import os
import secrets
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
from jaxtyping import Int64

from eigenshape._errors import StoreError
from eigenshape.retrieval.kinds import AnyRecipe, recipe_from_text
from eigenshape.retrieval.store.damage import Damage

DATABASE = "index.sqlite"
APPLICATION = 0x65696773  # "eigs", by which SQLite files tell whose they are
FORMAT = 9  # of the tables; raised by every change
# Of 4, 8, 16 and 64 KB, pages of 64 KB return 1,600 shapes at random in 11 ms of CPU time, 16 KB in 18,
# and 4 KB in 26. But a shape takes 57 KB in pages of 16 KB, and 66 in pages of 64 KB, which hold one each.
PAGE = 16_384  # bytes
MAPPED = 2**31 - 65_536  # bytes that SQLite maps of a file, at most; a mapped page is not copied
CACHED = 16_000  # KB of pages that a connection keeps, so that inner pages are read once
LONGEST_WAIT = 5.0  # seconds for another writer to end; adding a shape takes milliseconds
ROWS_AT_ONCE = 20_000  # rows of integers in memory at a time, as Python objects: 10 MB
# The number of changes, as text. SQLite ignores all of its log that follows a damaged bit; by this
# file a reader notices that changes are lost. It may be deleted at any time.
CHANGES = "changes.txt"
# Errors that a damaged file causes: SQLite quotes bytes of it in messages, which may be no text.
DAMAGE = (sqlite3.Error, UnicodeError)
BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
NO_SPACE = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)
NOT_WRITABLE = (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM)
WRITE_AHEAD = "PRAGMA journal_mode = WAL"

TABLES = ("recipe", "shape", "picture", "descriptor")
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
SCHEMA = (
    """CREATE TABLE recipe (
    id INTEGER PRIMARY KEY, fields TEXT NOT NULL UNIQUE, n_columns INTEGER NOT NULL,
    codebook BLOB NOT NULL, checksum INTEGER NOT NULL)""",
    """CREATE TABLE shape (
    id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL UNIQUE, label TEXT, source TEXT,
    digest TEXT, tags TEXT NOT NULL, attributes TEXT NOT NULL, n_descriptors INTEGER NOT NULL,
    n_pictures INTEGER NOT NULL, checksum INTEGER NOT NULL)""",
    """CREATE TABLE picture (
    id INTEGER PRIMARY KEY, data BLOB NOT NULL, checksum INTEGER NOT NULL)""",
    """CREATE TABLE descriptor (
    id INTEGER PRIMARY KEY AUTOINCREMENT, shape INTEGER NOT NULL, recipe INTEGER NOT NULL,
    view INTEGER NOT NULL, n_rows INTEGER NOT NULL, n_columns INTEGER NOT NULL,
    rows_checksum INTEGER NOT NULL, details_checksum INTEGER NOT NULL, checksum INTEGER NOT NULL,
    rows BLOB NOT NULL, details BLOB NOT NULL, UNIQUE (shape, recipe, view))""",
    """CREATE INDEX integers ON descriptor (
    id, shape, recipe, view, n_rows, n_columns, rows_checksum, details_checksum, checksum)""",
    """CREATE TABLE seal (
    name TEXT PRIMARY KEY, n_rows INTEGER NOT NULL, total INTEGER NOT NULL,
    n_changes INTEGER NOT NULL, guard INTEGER NOT NULL)""",
)
# `guard` is a sum of the other numbers of a seal by which a change of one of them is noticed.
PER_ROW, PER_CHANGE = 1_000_003, 31
TRIGGER = """CREATE TRIGGER {table}_{event} AFTER {event} ON {table} BEGIN
    UPDATE seal SET n_rows = n_rows + {rows}, total = total + {sum}, n_changes = n_changes + 1,
        guard = guard + {sum} + {rows} * {per_row} + {per_change} WHERE name = '{table}'; END"""
# What each event adds to the rows of a table and to the sum of their checksums
EVENTS = {
    "insert": (1, "NEW.checksum"),
    "delete": (-1, "(-OLD.checksum)"),
    "update": (0, "NEW.checksum - OLD.checksum"),
}
PRIME, FACTOR = (
    2**31 - 1,
    1_000_003,
)  # of checksums of integers, which NumPy makes of all rows at once


class Seal(NamedTuple):
    """What a table holds: the number of its rows, the sum of their checksums, the changes so far."""

    n_rows: int
    total: int
    n_changes: int


class Facts(NamedTuple):
    """A row of `shape`; tags and attributes are JSON.

    By the numbers of its descriptors and pictures, of which there is one or none, it is noticed if a
    row of these is lost.
    """

    id: int
    name: str
    label: str | None
    source: str | None
    digest: str | None
    tags: str
    attributes: str
    n_descriptors: int
    n_pictures: int


# ---- checksums


def checksum(*values: Any) -> int:
    """Return the checksum of the values of a row; bytes come last."""
    texts = [value for value in values if not isinstance(value, bytes)]
    found = crc32(json.dumps(texts, default=repr).encode(errors="surrogatepass"))
    for value in values:
        if isinstance(value, bytes):
            found = crc32(value, found)
    return found


def integer_checksums(rows: Int64[np.ndarray, "k c"]) -> Int64[np.ndarray, " k"]:
    """Return the checksum of each row of integers: the value of a polynomial, modulo a prime."""
    found = np.zeros(len(rows), dtype=np.int64)
    for column in rows.T:
        found = (found * FACTOR + column) % PRIME
    return found


def read_seals(
    place: str, database: sqlite3.Connection, damages: list[Damage] | None = None
) -> dict[str, Seal]:
    """Read the seals of all tables.

    Raise StoreError if one is damaged or missing, and no list is given.

    Parameters
    ----------
    place : str
    database : Connection
    damages : list of Damage, optional
        A seal that is damaged is noted there, and made of the rows that are found.
    """
    seals = {}
    for name, *numbers, guard in database.execute("SELECT * FROM seal NOT INDEXED").fetchall():
        n_rows, total, changes = numbers
        if guard == total + PER_ROW * n_rows + PER_CHANGE * changes:
            seals[name] = Seal(n_rows, total, changes)
    for name in TABLES:
        if name in seals:
            continue
        if damages is None:
            raise StoreError(
                f"{place} must hold what was written; the seal of {name} differs. Merge the index "
                "into a new one to keep what is whole."
            )
        damages.append(Damage(DATABASE, f"the seal of table {name} differs"))
        query = f"SELECT count(*), total(checksum) FROM {name}"
        n_rows, total = database.execute(query).fetchone()
        seals[name] = Seal(n_rows, int(total), 0)
    return seals


# ---- transactions


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
    # The file gets its name when it is whole, so nobody sees half of an index; of several
    # processes that come here at once, the first gives it.
    fresh = folder / f"{DATABASE}.{secrets.token_hex(8)}"
    try:
        with explained(folder):
            _make_tables(fresh)
            _name(fresh, folder / DATABASE)
    except FileExistsError:
        if not exist_ok:
            raise _not_empty(folder) from None
    finally:
        fresh.unlink(missing_ok=True)


def _make_tables(path: Path) -> None:
    with closing(_connect(path, "mode=rwc")) as database:
        database.execute(f"PRAGMA page_size = {PAGE}")
        # Free pages can be given back one by one: the file is never written anew.
        database.execute("PRAGMA auto_vacuum = INCREMENTAL")
        database.execute("BEGIN IMMEDIATE")
        for statement in SCHEMA:
            database.execute(statement)
        for table in TABLES:
            database.execute("INSERT INTO seal VALUES (?, 0, 0, 0, 0)", (table,))
            names = {"table": table, "per_row": PER_ROW, "per_change": PER_CHANGE}
            for event, (rows, total) in EVENTS.items():
                database.execute(TRIGGER.format(event=event, rows=rows, sum=total, **names))
        database.execute(f"PRAGMA application_id = {APPLICATION}")
        database.execute(f"PRAGMA user_version = {FORMAT}")
        database.execute("COMMIT")
        database.execute(WRITE_AHEAD)


def _name(fresh: Path, path: Path) -> None:
    """Give a file its name, or raise FileExistsError if that is taken."""
    try:
        os.link(fresh, path)
    except FileExistsError:
        raise
    except OSError:  # a drive without links, where two that come at once are not told apart
        if path.exists():
            raise FileExistsError(path) from None
        fresh.rename(path)


def _not_empty(folder: Path) -> StoreError:
    return StoreError(
        f"{folder} must be empty to become an index; it is not. Open it if it is an index, or "
        "choose another folder."
    )


@contextmanager
def writing(folder: Path) -> Iterator[sqlite3.Connection]:
    """Open an index to change it. At the end of the block all changes are committed, or none.

    Raise StoreError if the folder is not an index of this format, changes were lost, another
    process is writing, or the disk is full.
    """
    require_database(folder)
    with explained(folder), closing(_connect(folder / DATABASE, "mode=rw")) as database:
        place = str(folder / DATABASE)
        require_format(place, database)
        database.execute(WRITE_AHEAD)
        database.execute("PRAGMA synchronous = FULL")
        database.execute(f"PRAGMA cache_size = -{CACHED}")
        # The lock of SQLite: the system takes it from a process that dies.
        database.execute("BEGIN IMMEDIATE")
        before = read_seals(place, database)
        for lost in lost_changes(committed_changes(folder), before):
            raise StoreError(
                f"An index must be whole to be changed; {lost}. Copy all files, or merge the index "
                "into a new one to keep what is whole."
            )
        yield database
        now = n_changes(read_seals(place, database))
        if now != n_changes(before):
            database.execute("COMMIT")  # if the block raises before, closing rolls back
            # Not forced to disk: if power fails, a number that is too low misses a lost log at worst.
            with suppress(OSError):
                (folder / CHANGES).write_text(f"{now}\n")


def open_to_read(folder: Path) -> sqlite3.Connection:
    """Return a connection in a transaction, which sees one state until it is closed.

    SQLite keeps changes in a log (WAL) as long as it is open, so readers and the writer never wait
    for each other, however long a reader holds its state or the writer adds. With a rollback
    journal, a held state would stop every commit, and a merge of many shapes every reader. The
    price: the log grows while a state is held, and processes of several machines must not write to
    one index on a network drive at the same time.

    Raise StoreError if the folder is not an index of this format, or its database cannot be read at
    all.
    """
    require_database(folder)
    with explained(folder):
        # Not mode=ro: whoever closes an index last moves the log into the database.
        database = _connect(folder / DATABASE, "mode=rw")
        try:
            with closed_on_error(database):
                database.execute("SELECT count(*) FROM sqlite_master")
        except sqlite3.OperationalError:
            if os.access(folder, os.W_OK):
                raise
            # SQLite cannot make the files of its log beside a read-only database, which nobody
            # changes then.
            log = folder / f"{DATABASE}-wal"
            if log.exists() and log.stat().st_size:
                raise StoreError(
                    f"{folder} must be writable to be read as long as {log.name} holds changes. "
                    "Read it once with the right to write, or copy it to a writable folder."
                ) from None
            database = _connect(folder / DATABASE, "mode=ro&immutable=1")
        with closed_on_error(database):
            require_format(str(folder / DATABASE), database)
            database.execute("PRAGMA query_only = ON")
            database.execute(f"PRAGMA cache_size = -{CACHED}")
            database.execute(f"PRAGMA mmap_size = {MAPPED}")
            database.execute("BEGIN")
            database.execute("SELECT count(*) FROM recipe").fetchone()  # from here on, one state
        return database


@contextmanager
def closed_on_error(database: sqlite3.Connection) -> Iterator[None]:
    """Close a connection if the block raises: nobody else has it then."""
    try:
        yield
    except BaseException:
        database.close()
        raise


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    uri = f"{path.absolute().as_uri()}?{mode}"
    return sqlite3.connect(
        uri, timeout=LONGEST_WAIT, isolation_level=None, check_same_thread=False, uri=True
    )


def require_database(folder: Path) -> None:
    """Raise an error if a folder is no index."""
    if not (folder / DATABASE).is_file():
        raise StoreError(
            f"{folder} must be an index; it has no {DATABASE}. Create one with "
            "ShapeIndex.create, or with `eigenshape index add` on the command line."
        )


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
            "version of eigenshape. Install that version, or index the shapes again."
        )


@contextmanager
def explained(folder: Path) -> Iterator[None]:
    """Turn errors of SQLite into a StoreError that says what to do."""
    try:
        yield
    except DAMAGE as err:
        code = getattr(err, "sqlite_errorcode", 0) & 0xFF  # the extended code has more bits
        if code in BUSY:
            text = (
                f"An index has one writer at a time; another process has held {folder / DATABASE} "
                f"for more than {LONGEST_WAIT:g} s. Wait for it to end."
            )
        elif code in NO_SPACE:
            text = (
                f"An index needs space on its disk; {folder}: {err}. Nothing was changed: free "
                "some space and repeat the call."
            )
        elif code in NOT_WRITABLE:
            text = (
                f"An index can change only in a writable folder; {folder}: {err}. Copy it to a "
                "writable folder."
            )
        else:
            text = f"{folder / DATABASE} must be a readable index; {err}. Index the shapes again."
        raise StoreError(text) from err


def n_changes(seals: dict[str, Seal]) -> int:
    """Return the number of all changes of an index."""
    return sum(seal.n_changes for seal in seals.values())


def committed_changes(folder: Path) -> int:
    """Return the number of changes that an index must hold at least; 0 if it is not known.

    Read it before a transaction begins, so that the state is not older.
    """
    try:
        return int((folder / CHANGES).read_text())
    except (OSError, ValueError):
        return 0


def lost_changes(committed: int, seals: dict[str, Seal]) -> list[Damage]:
    """Return a damage if an index holds fewer changes than were committed."""
    found = n_changes(seals)
    if committed <= found:  # it is less if a writer was stopped just after it committed
        return []
    what = (
        f"{committed - found} of {committed} changes that were committed are lost: the file is "
        "damaged, or was not copied with the others"
    )
    return [Damage(f"{DATABASE}-wal", what)]


# ---- rows


def read_rows(
    database: sqlite3.Connection, table: str, columns: str, ids: Sequence[int]
) -> dict[int, tuple[Any, ...]]:
    """Return rows of a table by their numbers, as far as SQLite can read them."""
    query = f"SELECT id, {columns} FROM {table} WHERE id IN (SELECT value FROM json_each(?))"
    try:
        return {row[0]: row for row in database.execute(query, (json.dumps(ids),))}
    except DAMAGE:
        if len(ids) == 1:
            return {}
        half = len(ids) // 2
        parts = (read_rows(database, table, columns, some) for some in (ids[:half], ids[half:]))
        return dict(item for part in parts for item in part.items())


def read_integers(
    database: sqlite3.Connection,
    seal: Seal,
    damages: list[Damage],
    before: np.ndarray | None = None,
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
