"""Where sessions are kept, and that one server at a time owns a folder of them."""

import os
import socket
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

import platformdirs

import eigenshape as es
from eigenshape._sealed import BUSY, closed_on_error, connect, error_code, explained
from eigenshape_studio.tab.sessions import SESSION, remove_old


def sessions_folder(port: int) -> Path:
    """Return the folder of the sessions of this user whose pages know a port.

    A browser keeps the name of a tab for the port of its server, so no other server needs them.
    """
    return platformdirs.user_cache_path("eigenshape") / "studio" / str(port)


def own(folder: Path, address: str, patience: float = 2.0) -> sqlite3.Connection:
    """Own a folder of sessions until the returned connection is closed, or the process ends.

    Parameters
    ----------
    folder : Path
    address : str
        Of the server, for the errors of others.
    patience : float
        Seconds to wait for another server that is just ending.

    Raises
    ------
    StoreError
        If another server has the folder, whose name it gives.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    path = folder / "owner"
    database = connect(path, "mode=rwc")
    with explained(SESSION, path), closed_on_error(database):
        database.execute(f"PRAGMA busy_timeout = {1000 * patience:.0f}")
        try:
            database.execute("BEGIN IMMEDIATE")
            database.execute("CREATE TABLE IF NOT EXISTS owner (name TEXT)")
            database.execute("DELETE FROM owner")
            name = f"process {os.getpid()} on {socket.gethostname()}, {address}"
            database.execute("INSERT INTO owner VALUES (?)", (name,))
            database.execute("COMMIT")
            # Others can read the name beside this lock, which the system takes from a process that dies.
            database.execute("BEGIN IMMEDIATE")
        except sqlite3.OperationalError as error:
            if error_code(error) not in BUSY:
                raise
            (owner,) = database.execute("SELECT name FROM owner").fetchone()
            raise es.StoreError(
                f"A folder of sessions must have one server; {folder} has {owner}. End "
                "that server, or choose another port: each has a folder of its own."
            ) from error
    return database


def remove_old_of_others(ours: Path) -> None:
    """Remove old sessions from the folders beside one, as far as no server owns them."""
    for folder in ours.parent.iterdir():
        if folder != ours and folder.is_dir():
            with suppress(es.StoreError, OSError), closing(own(folder, "cleaning up", 0)):
                remove_old(folder)
