"""A copy of the tables of an index in one file of arrays, so that a large index opens quickly.

Reading a row of the database and its checksum takes 15 microseconds, and its place in an array
0.3. The copy has the seals of the tables that it was made of: what has changed since is read from
the database, and only if all adds up to the seals of now is the copy used. It can be deleted at any
time.
"""

import json
import secrets
from contextlib import suppress
from pathlib import Path
from zipfile import BadZipFile, ZipFile

import numpy as np

from eigenshape.retrieval.store.catalog import FORMAT, FileRow, Seal
from eigenshape.retrieval.store.snapshot import IndexState, Shapes, read_state

TABLES_FILE = "tables.npz"
FEWEST_TO_KEEP = 2000  # shapes of an index that has such a file; fewer are read in 30 ms
# Shapes that may have changed since it was written, as a share of all
MOST_CHANGED = 0.05


def open_state(folder: Path) -> IndexState:
    """Read an index, with the help of the copy of its tables; make the copy if it is out of date.

    Raises
    ------
    StoreError
        As `read_state`.
    """
    state = read_state(folder, kept=_read(folder))
    n_shapes = len(state.shapes.ids)
    is_far = state.n_read > MOST_CHANGED * n_shapes
    if n_shapes >= FEWEST_TO_KEEP and is_far and not state.damages:
        # A folder that cannot be written to, as on a read-only disk, is read all the same.
        with suppress(OSError):
            _write(state)
    return state


def _write(state: IndexState) -> None:
    """Write a file whole or not at all."""
    shapes = state.shapes
    facts = [FORMAT, list(state.seals.values()), list(state.files.values()), shapes.labels]
    path = state.folder / TABLES_FILE
    beside = path.with_name(f"{path.name}.{secrets.token_hex(4)}")
    try:
        with beside.open("wb") as file:
            np.savez(
                file,
                facts=_as_bytes(json.dumps(facts).encode()),
                ids=shapes.ids,
                texts=_as_bytes(shapes.texts),
                ends=shapes.ends,
                label_codes=shapes.label_codes,
                pictures=shapes.pictures,
                descriptors=state.descriptors,
            )
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def _as_bytes(data: bytes) -> np.ndarray:
    return np.frombuffer(data, np.uint8)


def _read(folder: Path) -> IndexState | None:
    """Return the copy, or None if it is missing, damaged, or of another format."""
    path = folder / TABLES_FILE
    # Whatever is wrong with the file, the database has all of it.
    problems = (OSError, ValueError, KeyError, EOFError, NotImplementedError, BadZipFile)
    with suppress(*problems), ZipFile(path) as file:
        if file.testzip() is not None:  # before NumPy evaluates a header
            return None
        with np.load(path) as arrays:
            number, seals, files, labels = json.loads(arrays["facts"].tobytes())
            if number != FORMAT:
                return None
            shapes = Shapes(
                arrays["ids"],
                arrays["texts"].tobytes(),
                arrays["ends"],
                tuple(labels),
                arrays["label_codes"],
                arrays["pictures"],
            )
            return IndexState(
                folder,
                {row[0]: Seal(*row) for row in seals},
                {},
                {row[0]: FileRow(*row) for row in files},
                {},
                shapes,
                arrays["descriptors"],
                0,
                (),
            )
    return None
