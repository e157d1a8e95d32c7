"""The files of an index: append-only numbers, and a SQLite database that says which of them count.

What is added is written behind the committed bytes of its file, forced to disk, and then committed
by one SQLite transaction. If the writer dies before the commit, its bytes belong to no shape, and
the next writer overwrites them. Readers see what is committed and never wait. SQLite keeps the
latest changes in a log beside the database; a file of its own holds the number of all changes, so
that a lost log is noticed.
"""

import errno
import os
import socket
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from eigenshape._errors import StoreError
from eigenshape.retrieval.kinds import AnyRecipe
from eigenshape.retrieval.store.catalog import (
    CHANGES,
    DAMAGE,
    DATABASE,
    create_tables,
    read_recipes,
    read_seals,
    read_table,
    require_format,
)
from eigenshape.retrieval.store.change import Change
from eigenshape.retrieval.store.damage import Damage, warn_of_damage
from eigenshape.retrieval.store.syncing import sync_folder

DRAFT = "draft.sqlite"  # the database until it is complete
LOCK = "writer.lock"
WRITER = "writer.txt"  # names the process that writes, for messages
COMMITTED = "committed.txt"  # the number of all changes, twice
COUNT_DIGITS = 20  # of that number, so that the file keeps its size and needs no more space
LONGEST_WAIT = 5.0  # seconds for another writer to end; adding a shape takes milliseconds
N_TRIES = 3  # readings of the count, which a writer may replace at the same moment
# The primary result codes of SQLite when a disk is full or cannot be written
NO_SPACE = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)


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
    _keep_count(folder, 0, new=True)
    (folder / DRAFT).replace(folder / DATABASE)
    sync_folder(folder)


def require_database(folder: Path) -> None:
    """Raise an error if a folder is no index."""
    if not (folder / DATABASE).is_file():
        raise StoreError(
            f"{folder} must be an index; it has no {DATABASE}. Create one with "
            "ShapeIndex.create, or with `eigenshape index add` on the command line."
        )


@contextmanager
def reading(folder: Path) -> Iterator[tuple[sqlite3.Connection, int]]:
    """Open the database to read one consistent state, even if the folder is read-only.

    Yields
    ------
    database : Connection
        In a transaction.
    committed : int
        The least number of changes that it must hold, or -1 if that number is damaged.

    Raises
    ------
    StoreError
        If the folder is not a store of this format, or its database cannot be read at all.
    """
    require_database(folder)
    try:
        with closing(_connect_to_read(folder)) as database:
            committed = _read_count(folder)  # before BEGIN, so that the state is not older
            database.execute("BEGIN")
            require_format(str(folder / DATABASE), database)
            yield database, committed
    except DAMAGE as err:
        raise _explain(folder, err, "readable") from err


def _explain(folder: Path, err: Exception, kind: str) -> StoreError:
    # The primary code is in the lowest byte of the extended one
    if (getattr(err, "sqlite_errorcode", 0) & 0xFF) in NO_SPACE:
        return _no_space(folder, str(err))
    return StoreError(f"{folder / DATABASE} must be a {kind} index; {err}. Index the shapes again.")


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


def _read_count(folder: Path) -> int:
    for _ in range(N_TRIES):
        try:
            count, _, again = (folder / COMMITTED).read_bytes().strip().partition(b" ")
        except OSError:
            return -1
        if count == again and count.isdigit():
            return int(count)
    return -1


def _keep_count(folder: Path, n_changes: int, *, new: bool = False) -> None:
    """Store the number of changes, twice.

    It is written in place, within one sector, and is not forced to disk: if power fails, a count
    that is too low misses a lost log at worst. For the same reason a failure is no error: the
    change is committed.
    """
    text = f"{n_changes:0{COUNT_DIGITS}} {n_changes:0{COUNT_DIGITS}}\n".encode()
    if new:
        (folder / COMMITTED).write_bytes(text)
        return
    with suppress(OSError), (folder / COMMITTED).open("r+b", buffering=0) as file:
        file.write(text)


@contextmanager
def writing(folder: Path) -> Iterator[Change]:
    """Open the index to write. At the end of the block all changes are committed, or none.

    Raises
    ------
    StoreError
        If the folder is not a store of this format, changes were lost, another process is writing,
        or the disk is full.
    """
    require_database(folder)
    try:
        with _lock(folder), closing(_connect(folder, "mode=rw")) as database:
            database.execute("PRAGMA synchronous = FULL")
            database.execute("BEGIN IMMEDIATE")
            place = str(folder / DATABASE)
            require_format(place, database)
            seals = read_seals(place, database)
            _require_all_changes(folder, seals[CHANGES].n_rows)
            with closing(Change(folder, database, seals)) as change:
                yield change
                if change.keep():
                    database.execute("COMMIT")  # if the block raises before, closing rolls back
                    _keep_count(folder, change.n_changes)
                    change.finish()
    except DAMAGE as err:
        raise _explain(folder, err, "writable") from err
    except OSError as err:
        if err.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO):
            raise
        raise _no_space(folder, str(err.strerror)) from err


def _no_space(folder: Path, reason: str) -> StoreError:
    return StoreError(
        f"An index needs space on its disk; {folder}: {reason}. Nothing was changed: free some "
        "space and repeat the call."
    )


def _require_all_changes(folder: Path, n_changes: int) -> None:
    """Raise an error if the database lacks committed changes.

    Changes stay in a log beside the database as long as a process reads, and SQLite ignores all of
    the log that follows a damaged bit.
    """
    committed = _read_count(folder)
    if committed > n_changes:
        raise StoreError(
            f"{folder} must hold all {committed} changes that were committed; it holds "
            f"{n_changes}. Its file {DATABASE}-wal is damaged, or was not copied with the others. "
            "Copy all files, or merge the index into a new one to keep what is whole."
        )


def read_recipes_of(folder: Path) -> dict[int, AnyRecipe]:
    """Return the recipes of an index by their numbers, without a look at its shapes."""
    damages: list[Damage] = []
    with reading(folder) as (database, _):
        seals = read_seals(str(folder / DATABASE), database)
        chunks = read_table(database, seals["recipe"], damages)
        rows = [row for chunk in chunks for row in chunk.rows]
        recipes = read_recipes(str(folder / DATABASE), database, rows, damages)
    warn_of_damage(str(folder), damages)
    return recipes


def check_database(folder: Path) -> list[str]:
    """Return what SQLite finds wrong with its own pages: its indexes are in no seal."""
    with reading(folder) as (database, _):
        try:
            found = database.execute("PRAGMA integrity_check").fetchall()
        except DAMAGE as err:
            return [str(err)]
    return [text for (text,) in found if text != "ok"]


def vacuum(folder: Path) -> None:
    """Give free pages of the database back; without space for that, leave it as it is."""
    no_space = suppress(sqlite3.OperationalError)
    with _lock(folder), closing(_connect(folder, "mode=rw")) as database, no_space:
        database.execute("VACUUM")


@contextmanager
def _lock(folder: Path) -> Iterator[None]:
    lock = FileLock(folder / LOCK, timeout=LONGEST_WAIT)
    holder = folder / WRITER
    try:
        lock.acquire()
    except Timeout as err:
        named = holder.read_text(errors="replace") if holder.exists() else ""
        who = named or "another process"
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
        with suppress(OSError):  # a full disk; what the block writes tells
            holder.write_text(f"process {os.getpid()} on {socket.gethostname()}")
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()
