"""Sessions on disk: one sealed file for each tab, so that nothing is lost when the server ends.

The files lie in a folder that nobody else may read, and that one server owns at a time.
"""

import json
import pickle
import shutil
import sqlite3
from collections.abc import Collection, Sequence
from contextlib import suppress
from functools import partial
from hashlib import sha256
from pathlib import Path
from time import time
from typing import Any

import eigenshape as es
from eigenshape import _sealed
from eigenshape._sealed import (
    BUSY,
    NO_SPACE,
    NOT_WRITABLE,
    error_code,
    insert_row,
    read_table,
    reading,
    whole_rows,
)
from eigenshape.deformation.edits import mesh_fingerprint

MOST_BYTES = 2 << 30  # of the files of a folder; the oldest are removed
MOST_DAYS = 30  # without a change, after which a file is removed
YOUNG = 3600.0  # seconds since the last change within which a file is not removed for its size
# Of each row of a table these columns are read with the session; what follows is large.
N_READ = {"places": 5, "shapes": 4, "poses": 4, "steps": 9, "maps": 1}
SESSION = _sealed.Kind(
    noun="A session",
    format=2,
    tables={
        name: f"CREATE TABLE {name} (id INTEGER PRIMARY KEY, {columns}, checksum INTEGER NOT NULL)"
        for name, columns in {
            "places": "place INTEGER, last TEXT, shelf TEXT, collection TEXT",
            "shapes": "name TEXT, path TEXT, digest TEXT, found BLOB",
            "poses": "shape INTEGER, parent INTEGER, edits BLOB, vertices BLOB",
            "steps": "text TEXT, shape INTEGER, pose INTEGER, regions BLOB, selected INTEGER, "
            "landmarks TEXT, beside INTEGER, pairs BLOB",
            "maps": "found BLOB",
        }.items()
    },
    missing="It was removed: save the shape as a file, and open it in a new tab.",
    rescue="Start the studio again: the tab then begins with what is whole.",
    renew="start the studio again: the tab then begins with what is whole",
)
# What needs a row that is lost is lost with it.
DANGLING = (
    """WITH RECURSIVE whole (id) AS (
        SELECT id FROM poses WHERE parent IS NULL UNION
        SELECT poses.id FROM poses JOIN whole ON poses.parent = whole.id)
    DELETE FROM poses WHERE id NOT IN whole OR shape NOT IN (SELECT id FROM shapes)""",
    "DELETE FROM steps WHERE shape NOT IN (SELECT id FROM shapes)",
    "DELETE FROM steps WHERE pose <> 0 AND pose NOT IN (SELECT id FROM poses)",
)
# Nothing returns to these poses, but later ones count on their edits.
LEFT = """SELECT id, shape, parent, edits FROM poses
    WHERE vertices IS NOT NULL AND id NOT IN (SELECT pose FROM steps)"""

Row = tuple[Any, ...]
Rows = dict[int, Row]  # by their numbers


class NotKeptError(es.StoreError):
    """A change could not be written, and was undone."""


class SessionFile:
    """The file of one tab; it appears with the first change.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    losses : list of str
        What a damaged file has lost, in sentences.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.losses: list[str] = []

    def read(self) -> dict[str, Rows]:
        """Return the rows of each table, without what is large; nothing if there is no session.

        If the file is damaged, it is put aside with the suffix ".broken", and what is whole of it
        becomes the session.

        Raises
        ------
        StoreError
            If the file cannot be read now: the disk is full, or another process is writing.
        """
        if not self.path.exists():
            return {}
        try:
            return self._read_all()
        except es.StoreError as error:
            self._rescue(error)
        return self.read()

    def _read_all(self) -> dict[str, Rows]:
        with reading(SESSION, self.path) as database:
            read = partial(read_table, SESSION, self.path, database)
            return {
                table: {row[0]: row for row in read(table, n_read)}
                for table, n_read in N_READ.items()
            }

    def _rescue(self, damage: es.StoreError) -> None:
        """Put a damaged file aside, and make one of its whole rows."""
        fresh, aside = self.path.with_suffix(".fresh"), self.path.with_suffix(".broken")
        fresh.unlink(missing_ok=True)
        require_damage(damage)
        lost = ["everything"]
        _sealed.create(SESSION, fresh)
        try:
            with reading(SESSION, self.path) as source, _sealed.writing(SESSION, fresh) as database:
                for table in N_READ:
                    for row in whole_rows(source, table):
                        _put(database, table, row[:-1])
                for statement in DANGLING:
                    database.execute(statement)
                before = _sealed.read_seals(SESSION, self.path, source, [])
                after = _sealed.read_seals(SESSION, fresh, database)
                counts = {table: (before[table].n_rows, after[table].n_rows) for table in N_READ}
                lost = [f"{n - m} of {n} {table}" for table, (n, m) in counts.items() if m < n]
        except es.StoreError as error:  # as a whole
            require_damage(error)
        shutil.copyfile(self.path, aside)  # so that there is a session at any time
        for ending in ("-wal", "-shm"):  # what SQLite keeps beside a file is of the damaged one
            with suppress(FileNotFoundError):
                Path(f"{self.path}{ending}").replace(f"{aside}{ending}")
        fresh.replace(self.path)
        self.losses = [
            "The work of this tab was damaged on the disk. Gone: "
            f"{', '.join(lost) or 'nothing'}. The damaged file is kept as "
            f"{aside}. ({damage.__cause__ or damage})"
        ]

    def write(
        self,
        rows: dict[str, list[Row]],
        moments: Sequence[int] | None = None,
        *,
        begin: bool = False,
    ) -> None:
        """Write rows of some tables, at once.

        Parameters
        ----------
        rows : {table: rows}
        moments : sequence of int, optional
            The numbers of all that stay.
        begin : bool
            Whether the file may be made; otherwise one that is missing has been removed.

        Raises
        ------
        NotKeptError
            If they cannot be written; then none of them is.
        """
        try:
            if begin and not self.path.exists():
                self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
                _sealed.create(SESSION, self.path)
                self.path.chmod(0o600)
            with _sealed.writing(SESSION, self.path) as database:
                for table, some in rows.items():
                    for row in some:
                        _put(database, table, row)
                if moments is not None:
                    query = "DELETE FROM steps WHERE id NOT IN (SELECT value FROM json_each(?))"
                    database.execute(query, (json.dumps(moments),))
                for row in database.execute(LEFT).fetchall():
                    _put(database, "poses", (*row, None))
        except (es.StoreError, OSError) as error:
            raise NotKeptError(str(error)) from error

    def row(self, table: str, number: int) -> Row:
        """Return a row of a table, as it was written.

        Raises
        ------
        StoreError
            If it is damaged.
        """
        with reading(SESSION, self.path) as database:
            for row in whole_rows(database, table, [number]):
                return row[:-1]
        raise es.StoreError(
            f"{self.path} must hold what was written; row {number} of {table} differs from its "
            f"checksum. {SESSION.rescue}"
        )


def _put(database: sqlite3.Connection, table: str, row: Row) -> None:
    """Write a row in place of that of its number, if there is one."""
    database.execute(f"DELETE FROM {table} WHERE id = ?", row[:1])
    insert_row(database, table, *row)


def require_damage(error: es.StoreError) -> None:
    """Raise an error again that a later call may not meet: the disk is full, or a file is in use."""
    if error_code(error.__cause__) in (*BUSY, *NO_SPACE, *NOT_WRITABLE):
        raise error


def unpack(packed: bytes) -> Any:
    """Return what was pickled in a file, which only its owner can change.

    Raise StoreError if another version of the library has written it.
    """
    try:
        return pickle.loads(packed)
    except Exception as error:
        raise es.StoreError(
            f"A session must be read by the version of eigenshape that wrote it: {error}. Install "
            "that version."
        ) from error


def map_number(part: es.TriangleMesh, whole: es.TriangleMesh) -> int:
    """Return the number of the row that holds the match of two meshes, and of no others."""
    digests = mesh_fingerprint(part).digest + mesh_fingerprint(whole).digest
    return int(sha256(digests.encode()).hexdigest()[:15], 16)  # SQLite has integers of 63 bits


def remove_old(folder: Path, in_use: Collection[Path] = ()) -> None:
    """Remove sessions that are too old, and the oldest of those that take too much space.

    The caller owns the folder; `in_use` has the files of its own tabs.
    """
    found = []
    for path in folder.iterdir():
        if path.suffix and "-" not in path.suffix:  # what SQLite keeps beside a file goes with it
            with suppress(OSError):  # a file that is being made gets another name
                stat = path.stat()
                found.append((time() - stat.st_mtime, stat.st_size, path))
    total = 0
    for age, size, path in sorted(found):
        total += size
        large = total > MOST_BYTES and age > YOUNG
        if path not in in_use and (large or age > MOST_DAYS * 86400):
            for ending in ("-wal", "-shm", "-journal", ""):
                with suppress(OSError):
                    Path(f"{path}{ending}").unlink()
