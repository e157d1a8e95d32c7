"""Work that is kept in one file: a database of SQLite whose tables are sealed.

Each row has a checksum, and `seal` holds, for each table, the number of its rows and the sum of their
checksums. Triggers keep these up to date, so a change costs the same at any size, and whoever reads a
whole table notices each row that was changed, lost or doubled. What a transaction has committed is
kept, also if the process is killed; readers see one state until they open the file anew.
"""

import errno
import json
import os
import secrets
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from shutil import disk_usage
from typing import Any, NamedTuple
from zlib import crc32

from certeig.kit.files import remove_leftovers
from eigenshape._errors import StoreError

APPLICATION = 0x65696773  # "eigs", by which SQLite files tell whose they are
# Of 4, 8, 16 and 64 KB, pages of 64 KB return 1,600 shapes of an index at random in 11 ms of CPU time,
# 16 KB in 18, and 4 KB in 26. But a shape takes 57 KB in pages of 16 KB, and 66 in pages of 64 KB.
PAGE = 16_384  # bytes
MAPPED = 2**31 - 65_536  # bytes that SQLite maps of a file, at most; a mapped page is not copied
CACHED = 16_000  # KB of pages that a connection keeps, so that inner pages are read once
LONGEST_WAIT = 5.0  # seconds for another writer to end; a change takes milliseconds
LONG_LOG = 2**19  # bytes of the log, which a few changes make
SHARED_BYTES = 65_536  # that a reader takes beside a file and its log, at most
# Errors that a damaged file causes: SQLite quotes bytes of it in messages, which may be no text.
DAMAGE = (sqlite3.Error, UnicodeError)
BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
NO_SPACE = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)
NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)  # the same of files that are written beside
NOT_WRITABLE = (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM)
WRITE_AHEAD = "PRAGMA journal_mode = WAL"
# The number of changes, as text. SQLite ignores all of its log that follows a damaged bit; by this
# file a reader notices that changes are lost. It may be deleted at any time.
CHANGES = "changes.txt"

SEALS = """CREATE TABLE seal (
    name TEXT PRIMARY KEY, n_rows INTEGER NOT NULL, total INTEGER NOT NULL,
    n_changes INTEGER NOT NULL, guard INTEGER NOT NULL)"""
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


class StoreWarning(UserWarning):
    """A part of an index on disk is damaged; the rest is served.

    See Also
    --------
    ShapeIndex.verify : List all damage.

    Examples
    --------
    >>> import eigenshape as es
    >>> issubclass(es.retrieval.StoreWarning, UserWarning)
    True
    """


@dataclass(frozen=True)
class Kind:
    """A kind of sealed file, and the words of its errors.

    Attributes
    ----------
    noun : str
        What the file is, such as "An index".
    format : int
        Of the tables; raised by every change.
    tables : dict of str to str
        The statement that creates each table, whose last column is `checksum`.
    more : tuple of str
        Further statements, such as indexes.
    missing, rescue, renew, room : str
        What to do where there is no such file, where it is damaged, where it cannot be read, and
        where its disk is full.
    reserve : int
        Bytes of a file beside it that are given up on a full disk, so that rows can be removed.
    changes : str
        Name of a file beside it that holds the number of its changes; empty for none.
    """

    noun: str
    format: int
    tables: dict[str, str]
    more: tuple[str, ...] = ()
    missing: str = ""
    rescue: str = ""
    renew: str = ""
    room: str = "free some space"
    reserve: int = 0
    changes: str = ""

    @property
    def a_noun(self) -> str:
        """The noun within a sentence."""
        return self.noun[0].lower() + self.noun[1:]


class DamagedFileError(StoreError):
    """A file does not hold what was written."""


class Seal(NamedTuple):
    """What a table holds: the number of its rows, the sum of their checksums, the changes so far."""

    n_rows: int
    total: int
    n_changes: int


def checksum(*values: Any) -> int:
    """Return the checksum of the values of a row; bytes come last."""
    texts = [value for value in values if not isinstance(value, bytes)]
    found = crc32(json.dumps(texts, default=repr).encode(errors="surrogatepass"))
    for value in values:
        if isinstance(value, bytes):
            found = crc32(value, found)
    return found


def read_seals(
    kind: Kind, path: Path, database: sqlite3.Connection, damaged: list[str] | None = None
) -> dict[str, Seal]:
    """Read the seals of all tables.

    Raise StoreError if one is damaged or missing, and no list is given.

    Parameters
    ----------
    kind : Kind
    path : Path
    database : Connection
    damaged : list of str, optional
        The table of a seal that is damaged is noted there, and the seal is made of the rows that are
        found.
    """
    seals = {}
    for name, *numbers, guard in database.execute("SELECT * FROM seal NOT INDEXED").fetchall():
        if not all(isinstance(number, int) for number in numbers):  # the type of one is damaged
            continue
        n_rows, total, changes = numbers
        if guard == total + PER_ROW * n_rows + PER_CHANGE * changes:
            seals[name] = Seal(n_rows, total, changes)
    for name in kind.tables:
        if name in seals:
            continue
        if damaged is None:
            raise DamagedFileError(
                f"{path} must hold what was written; the seal of {name} differs. {kind.rescue}"
            )
        damaged.append(name)
        query = f"SELECT count(*), total(checksum) FROM {name}"
        n_rows, total = database.execute(query).fetchone()
        seals[name] = Seal(n_rows, int(total), 0)
    return seals


def n_changes(seals: dict[str, Seal]) -> int:
    """Return the number of all changes of a file."""
    return sum(seal.n_changes for seal in seals.values())


def committed_changes(kind: Kind, path: Path) -> int:
    """Return the number of changes that a file must hold at least; 0 if it is not known.

    Read it before a transaction begins, so that the state is not older.
    """
    if not kind.changes:
        return 0
    try:
        return int(path.with_name(kind.changes).read_text())
    except (OSError, ValueError):
        return 0


def lost_changes(committed: int, seals: dict[str, Seal]) -> str | None:
    """Say how many changes a file lacks of those that were committed; None if it has all."""
    found = n_changes(seals)
    if committed <= found:  # it is less if a writer was stopped just after it committed
        return None
    return (
        f"{committed - found} of {committed} changes that were committed are lost: the file is "
        "damaged, or was not copied with the others"
    )


def require_changes(
    kind: Kind, path: Path, use: str, committed: int, seals: dict[str, Seal]
) -> None:
    """Raise DamagedFileError if changes that were committed are lost from a file to be read or changed."""
    lost = lost_changes(committed, seals)
    if lost is not None:
        raise DamagedFileError(
            f"{kind.noun} must be whole to be {use}; {path.name}-wal in {path.parent}: {lost}. If it "
            f"is a copy, copy all files. {kind.rescue}"
        )


def whole_rows(
    database: sqlite3.Connection, table: str, numbers: Iterable[int] | None = None
) -> Iterator[tuple[Any, ...]]:
    """Yield those rows of a table, by default of all, that agree with their checksums, which stand last."""
    if numbers is None:
        found: list[int] = []
        with suppress(*DAMAGE):  # rows behind a page that cannot be read are lost
            for (number,) in database.execute(f"SELECT rowid FROM {table} NOT INDEXED"):
                found.append(number)
        numbers = found
    for number in numbers:
        with suppress(*DAMAGE):
            query = f"SELECT * FROM {table} WHERE rowid = ?"
            row = database.execute(query, (number,)).fetchone()
            if row is not None and checksum(*row[:-1]) == row[-1]:
                yield row


def read_table(
    kind: Kind,
    path: Path,
    database: sqlite3.Connection,
    table: str,
    n_columns: int | None = None,
) -> list[tuple[Any, ...]]:
    """Return all rows of a table, or their first columns; raise DamagedFileError if one is damaged or lost."""
    rows, total = [], 0
    for row in whole_rows(database, table):
        rows.append(row[:n_columns])
        total += row[-1]
    seal = read_seals(kind, path, database)[table]
    if (len(rows), total) != seal[:2]:
        raise DamagedFileError(
            f"{path} must hold what was written; of {seal.n_rows} rows of table {table} {len(rows)} "
            f"do. {kind.rescue}"
        )
    return rows


def insert_row(database: sqlite3.Connection, table: str, *values: Any) -> None:
    """Write a row with its checksum, unless it is there."""
    marks = ", ".join("?" * (len(values) + 1))
    query = f"INSERT OR IGNORE INTO {table} VALUES ({marks})"
    database.execute(query, (*values, checksum(*values)))


# ---- files


def create(kind: Kind, path: Path) -> None:
    """Make a file without rows, which gets its name when it is whole.

    Raise FileExistsError if the name is taken: of several processes that come at once, the first
    gives it.
    """
    fresh = path.with_name(f"{path.name}.{secrets.token_hex(8)}.tmp")
    try:
        with explained(kind, path):
            with closing(connect(fresh, "mode=rwc")) as database:
                _make_tables(kind, database)
            _name(fresh, path)
    except StoreError:
        if path.exists():  # its first writer has taken ours for what a dead process had left
            raise FileExistsError(path) from None
        raise
    finally:
        fresh.unlink(missing_ok=True)


def _make_tables(kind: Kind, database: sqlite3.Connection) -> None:
    database.execute(f"PRAGMA page_size = {PAGE}")
    # Free pages can be given back one by one: the file is never written anew.
    database.execute("PRAGMA auto_vacuum = INCREMENTAL")
    database.execute("BEGIN IMMEDIATE")
    for statement in (*kind.tables.values(), *kind.more, SEALS):
        database.execute(statement)
    for table in kind.tables:
        database.execute("INSERT INTO seal VALUES (?, 0, 0, 0, 0)", (table,))
        names = {"table": table, "per_row": PER_ROW, "per_change": PER_CHANGE}
        for event, (rows, total) in EVENTS.items():
            database.execute(TRIGGER.format(event=event, rows=rows, sum=total, **names))
    database.execute(f"PRAGMA application_id = {APPLICATION}")
    database.execute(f"PRAGMA user_version = {kind.format}")
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


def mend(kind: Kind, path: Path) -> None:
    """Write a damaged file anew, of the rows that are whole, in one transaction.

    Raise StoreError if it is not of this kind and format, or its first page cannot be read.
    """
    fresh = sqlite3.connect(":memory:", isolation_level=None)
    with explained(kind, path), closing(fresh), closing(connect(path, "mode=rw")) as database:
        require_format(kind, path, database)
        _make_tables(kind, fresh)
        for table in kind.tables:
            for row in whole_rows(database, table):
                insert_row(fresh, table, *row[:-1])
        fresh.backup(database)
    if kind.changes:
        path.with_name(kind.changes).unlink(missing_ok=True)


def require_file(kind: Kind, path: Path) -> None:
    """Raise an error if there is no such file."""
    if not path.is_file():
        more = " and is a file" if path.parent.is_file() else ""
        raise StoreError(
            f"{path.parent} must be {kind.a_noun}; it has no {path.name}{more}. {kind.missing}"
        )


def require_format(kind: Kind, path: Path, database: sqlite3.Connection) -> None:
    """Raise an error if a database is not of this kind and format."""
    (application,) = database.execute("PRAGMA application_id").fetchone()
    (version,) = database.execute("PRAGMA user_version").fetchone()
    if application != APPLICATION:
        raise StoreError(
            f"{path} must be {kind.a_noun} of eigenshape; it belongs to another program. Choose "
            "another folder."
        )
    if version != kind.format:
        age = "an older" if version < kind.format else "a newer"
        raise StoreError(
            f"{path} must be {kind.a_noun} of format {kind.format}; it is of format {version}, by "
            f"{age} version of eigenshape. Install that version, or {kind.renew}."
        )


# ---- transactions


@contextmanager
def writing(kind: Kind, path: Path, *, frees: bool = False) -> Iterator[sqlite3.Connection]:
    """Open a file to change it. At the end of the block all changes are committed, or none.

    Raise StoreError if the file is not of this kind and format, changes were lost, another process
    is writing, or the disk is full. A change that `frees` space has the reserve for its log.
    """
    require_file(kind, path)
    reserve = _beside(path, "reserve")
    if frees:
        with suppress(OSError):  # SQLite will say what does not allow it
            reserve.unlink()
    try:
        with explained(kind, path), closing(connect(path, "mode=rw")) as database:
            require_format(kind, path, database)
            database.execute(WRITE_AHEAD)
            database.execute("PRAGMA synchronous = FULL")
            database.execute(f"PRAGMA cache_size = -{CACHED}")
            database.execute("PRAGMA temp_store = MEMORY")  # the disk of /tmp may be full, too
            database.execute(f"PRAGMA journal_size_limit = {LONG_LOG // 2}")
            if not frees:
                _shorten_log(path, database)  # if the file cannot grow, its log must not either
                database.execute(f"PRAGMA max_page_count = {_most_pages(path, database)}")
            # The lock of SQLite: the system takes it from a process that dies.
            database.execute("BEGIN IMMEDIATE")
            before = read_seals(kind, path, database)
            require_changes(kind, path, "changed", committed_changes(kind, path), before)
            remove_leftovers(path.parent, path.name)  # of a process that died in `create`
            yield database
            now = n_changes(read_seals(kind, path, database))
            if database.in_transaction:  # if the block raises before, closing rolls back
                database.execute("COMMIT")
        if kind.changes and now != n_changes(before):
            # Not forced to disk: if power fails, a number that is too low misses a lost log at worst.
            with suppress(OSError):
                path.with_name(kind.changes).write_text(f"{now}\n")
    finally:
        if _size(reserve) < kind.reserve:
            with suppress(OSError):  # what fits
                # Random bytes: no file system can make them smaller.
                reserve.write_bytes(os.urandom(kind.reserve))


def _beside(path: Path, what: str) -> Path:
    return path.with_name(f"{path.name}-{what}")


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def is_log_long(path: Path) -> bool:
    """Return whether the log of a file should be moved into the file."""
    return _size(_beside(path, "wal")) > LONG_LOG


def _shorten_log(path: Path, database: sqlite3.Connection) -> None:
    """Move a long log into the file, as far as readers allow; the next writer begins it anew."""
    if is_log_long(path):
        database.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()


def _most_pages(path: Path, database: sqlite3.Connection) -> int:
    """Return how many pages a file can have with its log beside it.

    SQLite commits if the log fits; one that does not fit into the file then would stay for ever.
    """
    (n_pages,) = database.execute("PRAGMA page_count").fetchone()
    (limit,) = database.execute("PRAGMA max_page_count").fetchone()
    room = disk_usage(path.parent).free - LONG_LOG  # for pages that change
    # Each new page is in the log and in the file.
    most = (room + path.stat().st_size + PAGE * n_pages) // 2
    with suppress(ImportError):  # Windows has no limit of files
        import resource  # noqa: PLC0415

        longest, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
        if longest != resource.RLIM_INFINITY:
            most = min(most, longest)
    return min(most // PAGE, int(limit))


def open_to_read(kind: Kind, path: Path) -> sqlite3.Connection:
    """Return a connection in a transaction, which sees one state until it is closed.

    SQLite keeps changes in a log (WAL) as long as it is open, so readers and the writer never wait
    for each other, however long a reader holds its state or the writer adds. With a rollback
    journal, a held state would stop every commit, and a merge of many shapes every reader. The
    price: the log grows while a state is held, and processes of several machines must not write to
    one file on a network drive at the same time.

    Raise StoreError if the file is not of this kind and format, or cannot be read at all.
    """
    require_file(kind, path)
    with explained(kind, path):
        # Not mode=ro: whoever closes a file last moves the log into the database.
        database = connect(path, "mode=rw")
        try:
            with closed_on_error(database):
                database.execute("SELECT count(*) FROM sqlite_master")
        except sqlite3.OperationalError as err:
            log, reserve = _beside(path, "wal"), _beside(path, "reserve")
            if error_code(err) in NO_SPACE and _size(reserve) >= SHARED_BYTES:
                # On a full disk SQLite gets the memory that readers share from the reserve.
                os.truncate(reserve, _size(reserve) - SHARED_BYTES)
                return open_to_read(kind, path)
            if error_code(err) in NO_SPACE:
                # Without that memory, this one reads the log alone, and others wait.
                database = connect(path, "mode=rw")
                database.execute("PRAGMA locking_mode = EXCLUSIVE")
            elif os.access(path.parent, os.W_OK):
                raise
            elif _size(log):
                raise StoreError(
                    f"{path.parent} must be writable to be read as long as {log.name} holds changes. "
                    "Read it once with the right to write, or copy it to a writable folder."
                ) from None
            else:
                # SQLite cannot make the files of its log beside a read-only database, which nobody
                # changes then.
                database = connect(path, "mode=ro&immutable=1")
        with closed_on_error(database):
            require_format(kind, path, database)
            with suppress(sqlite3.OperationalError):  # without space it stays as it is
                _shorten_log(path, database)
            database.execute("PRAGMA query_only = ON")
            database.execute(f"PRAGMA cache_size = -{CACHED}")
            database.execute(f"PRAGMA mmap_size = {MAPPED}")
            database.execute("BEGIN")
            database.execute("SELECT count(*) FROM seal").fetchone()  # from here on, one state
        return database


@contextmanager
def reading(kind: Kind, path: Path) -> Iterator[sqlite3.Connection]:
    """Open a file to read one state of it, all of whose changes are there, where they are counted."""
    committed = committed_changes(kind, path)
    with explained(kind, path), closing(open_to_read(kind, path)) as database:
        if kind.changes:
            require_changes(kind, path, "read", committed, read_seals(kind, path, database))
        yield database


@contextmanager
def closed_on_error(database: sqlite3.Connection) -> Iterator[None]:
    """Close a connection if the block raises: nobody else has it then."""
    try:
        yield
    except BaseException:
        database.close()
        raise


def connect(path: Path, mode: str) -> sqlite3.Connection:
    """Return a connection by a mode of SQLite, which may be passed between threads."""
    uri = f"{path.absolute().as_uri()}?{mode}"
    return sqlite3.connect(
        uri, timeout=LONGEST_WAIT, isolation_level=None, check_same_thread=False, uri=True
    )


@contextmanager
def explained(kind: Kind, path: Path) -> Iterator[None]:
    """Turn errors of SQLite, and of a disk that is full, into a StoreError that says what to do."""
    try:
        yield
    except (*DAMAGE, OSError) as err:
        kind_of_error = StoreError
        code = error_code(err)
        is_full = code in NO_SPACE or getattr(err, "errno", 0) in NO_ROOM
        if isinstance(err, OSError) and not is_full:
            raise
        if code in BUSY:
            text = (
                f"{kind.noun} has one writer at a time; another process has held {path} for more "
                f"than {LONGEST_WAIT:g} s. Wait for it to end."
            )
        elif is_full:
            text = (
                f"{kind.noun} needs space on its disk; {path.parent}: {err}. Nothing was changed: "
                f"{kind.room} and repeat the call."
            )
        elif code in NOT_WRITABLE:
            text = (
                f"{kind.noun} can change only in a writable folder; {path.parent}: {err}. Copy it to a "
                "writable folder."
            )
        else:
            kind_of_error = DamagedFileError
            renew = kind.renew[0].upper() + kind.renew[1:]
            text = f"{path} must be a readable {kind.a_noun.split(' ', 1)[1]}; {err}. {renew}."
        raise kind_of_error(text) from err


def error_code(err: BaseException | None) -> int:
    """Return the code of an error of SQLite; 0 of all else."""
    return getattr(err, "sqlite_errorcode", 0) & 0xFF  # the extended code has more bits


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
