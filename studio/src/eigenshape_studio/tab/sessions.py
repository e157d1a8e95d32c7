"""Sessions on disk: one file for each tab, so that nothing is lost when the server ends.

A file is a database of SQLite: a change is written as a whole or not at all, also if the server is
killed meanwhile. The files lie in a folder of the user's cache, which nobody else may read.
"""

import json
import sqlite3
import threading
from collections.abc import Collection, Iterable
from contextlib import suppress
from pathlib import Path
from time import time
from typing import Any

import numpy as np
import platformdirs

import eigenshape as es
from eigenshape.deformation.edits import edits_from_json, edits_to_json

VERSION = 1  # of the tables; a file of another version is put aside
MOST_BYTES = 2 << 30  # of all files; the oldest are removed
MOST_DAYS = 30  # without a change, after which a file is removed
YOUNG = 3600.0  # seconds since the last change within which a file is not removed for its size
TABLES = """
create table if not exists fact (name text primary key, value text);
create table if not exists shape
    (number integer primary key, name text, path text, digest text, message blob, attributes blob);
create table if not exists pose
    (number integer primary key, shape integer, parent integer, n_edits integer, edits text,
     vertices blob);
create table if not exists moment
    (number integer primary key, text text, shape integer, pose integer, regions blob,
     selected integer, landmarks text, beside integer, pairs blob);
"""

Row = tuple[Any, ...]


def sessions_folder() -> Path:
    """Return the folder of the sessions of this user."""
    return platformdirs.user_cache_path("eigenshape") / "studio"


class SessionFile:
    """The file of one tab; it appears with the first change.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._database: sqlite3.Connection | None = None
        self._lock = threading.Lock()

    def close(self) -> None:
        """Let go of the file; the next call opens it again."""
        with self._lock:
            if self._database is not None:
                self._database.close()
            self._database = None

    def read(self) -> dict[str, list[Row]] | None:
        """Return the rows of each table, without what is large; None if there is no session.

        A file that cannot be read is put aside, with the suffix ".broken".
        """
        if not self.path.exists():
            return None
        try:
            return self._read_all()
        except sqlite3.DatabaseError:
            self.close()
            self.path.replace(self.path.with_suffix(".broken"))
            return None

    def _read_all(self) -> dict[str, list[Row]]:
        with self._lock, self._open() as database:
            (version,) = database.execute("pragma user_version").fetchone()
            if version != VERSION:
                raise sqlite3.DatabaseError(f"Version {version} is not {VERSION}.")
            wanted = {
                "fact": "name, value",
                "shape": "number, name, path, digest",
                "pose": "number, shape, parent, n_edits",
                "moment": "number, text, shape, pose, regions, selected, landmarks, beside, pairs",
            }
            return {
                table: database.execute(f"select {columns} from {table} order by rowid").fetchall()
                for table, columns in wanted.items()
            }

    def write(
        self,
        facts: dict[str, Any],
        shapes: Iterable[Row],
        poses: Iterable[Row],
        moments: Iterable[Row],
        kept: tuple[int, int],
    ) -> None:
        """Write what is new, at once; moments in the file stay from the first to the last number `kept`."""
        with self._lock, self._open() as database:
            database.executemany("insert or replace into fact values (?, ?)", facts.items())
            database.executemany("insert or replace into shape values (?, ?, ?, ?, ?, ?)", shapes)
            database.executemany("insert or replace into pose values (?, ?, ?, ?, ?, ?)", poses)
            database.execute("delete from moment where not number between ? and ?", kept)
            holes = ", ".join("?" * 9)
            database.executemany(f"insert or replace into moment values ({holes})", moments)
            # Nothing returns to these poses, but later ones count on their edits.
            database.execute(
                "update pose set vertices = null "
                "where vertices is not null and number not in (select pose from moment)"
            )

    def shape(self, number: int) -> Row:
        """Return the message of a mesh and the attributes of its file, as they were written."""
        return self._one("select message, attributes from shape", number)

    def vertices(self, number: int) -> np.ndarray:
        """Return the vertices of a pose."""
        (data,) = self._one("select vertices from pose", number)
        return np.frombuffer(data, "<f8").reshape(-1, 3)

    def edits(self, number: int, mesh: es.TriangleMesh) -> tuple[es.deformation.Edit, ...]:
        """Return the edits of a mesh that lead to a pose from the one before."""
        (text,) = self._one("select edits from pose", number)
        return tuple(edits_from_json(json.loads(text), mesh))

    def _one(self, query: str, number: int) -> Row:
        with self._lock, self._open() as database:
            row: Row = database.execute(f"{query} where number = ?", (number,)).fetchone()
            return row

    def _open(self) -> sqlite3.Connection:
        """Return the database, whose block is one transaction."""
        if self._database is None:
            self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            new = not self.path.exists()
            self._database = sqlite3.connect(self.path, check_same_thread=False)
            # A killed process loses nothing so; only a machine without power does.
            self._database.execute("pragma synchronous = off")
            if new:
                self.path.chmod(0o600)
                self._database.executescript(TABLES)
                self._database.execute(f"pragma user_version = {VERSION}")
        return self._database


def edits_text(edits: tuple[es.deformation.Edit, ...], mesh: es.TriangleMesh) -> str:
    """Return edits as a file holds them."""
    return json.dumps(edits_to_json(edits, mesh))


def remove_old(folder: Path, in_use: Collection[Path] = ()) -> None:
    """Remove sessions that are too old, and the oldest of those that take too much space."""
    found = []
    for path in folder.glob("*.sqlite"):
        with suppress(OSError):  # another server may remove it
            stat = path.stat()
            found.append((time() - stat.st_mtime, stat.st_size, path))
    total = 0
    for age, size, path in sorted(found):
        total += size
        large = total > MOST_BYTES and age > YOUNG
        if path not in in_use and (large or age > MOST_DAYS * 86400):
            with suppress(OSError):
                path.unlink()
