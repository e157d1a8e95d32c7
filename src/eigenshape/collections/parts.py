"""The one file of a collection: fits by what they were made of, and the last state that was finished.

A stopped build leaves its fits beside those of the finished state, and goes on with them. The key of
each is a digest of all that it was made of, so a fit is used for nothing else.
"""

import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from certeig.kit.files import remove_leftovers
from eigenshape import _sealed
from eigenshape._errors import StoreError
from eigenshape._sealed import DamagedFileError, insert_row, read_table, reading, writing
from eigenshape.collections.surface_fit import SurfaceFit
from eigenshape.geometry.mesh import TriangleMesh

DATABASE = "collection.sqlite"
SPECIMENS = "specimens"  # folder of those that were given as meshes
EARLIER = "collection.json"  # of release candidates, with a file for each fit
COLLECTION = _sealed.Kind(
    "A collection",
    format=1,
    tables={
        "part": """CREATE TABLE part (
    key TEXT PRIMARY KEY, kind TEXT NOT NULL, name TEXT NOT NULL, data BLOB NOT NULL,
    checksum INTEGER NOT NULL)""",
        "state": """CREATE TABLE state (
    id INTEGER PRIMARY KEY, facts TEXT NOT NULL, mean BLOB NOT NULL, checksum INTEGER NOT NULL)""",
    },
    rescue="Build it again in the same folder: fits that are whole are used again.",
    renew="build it again in another folder",
    changes=_sealed.CHANGES,
)


def read_fits(folder: Path) -> tuple[dict[str, SurfaceFit], str | None]:
    """Return all fits that a folder keeps, by key, and the template of its finished state.

    The file is made if it is missing, and mended if it is damaged.

    Raise StoreError if the file is not one of a collection, another process is writing, or the disk
    is full.
    """
    path = folder / DATABASE
    with suppress(FileExistsError):
        _sealed.create(COLLECTION, path)
    try:
        return _whole_fits(path)
    except DamagedFileError:
        _sealed.mend(COLLECTION, path)
        return _whole_fits(path)


def _whole_fits(path: Path) -> tuple[dict[str, SurfaceFit], str | None]:
    with writing(COLLECTION, path) as database:
        for place in (path.parent, path.parent / SPECIMENS):
            remove_leftovers(place)
        states = read_table(COLLECTION, path, database, "state")
        parts = read_table(COLLECTION, path, database, "part")
    fits = {key: SurfaceFit(**_unpack(data)) for key, _, _, data, _ in parts}
    return fits, json.loads(states[0][1])["template"] if states else None


def keep_fit(folder: Path, key: str, kind: str, name: str, fit: SurfaceFit) -> None:
    """Keep a fit of a kind, which is the round that made it."""
    with writing(COLLECTION, folder / DATABASE) as database:
        insert_row(database, "part", key, kind, name, _pack(**asdict(fit)))


def write_state(
    folder: Path,
    facts: dict[str, Any],
    mean: TriangleMesh,
    fits: Sequence[SurfaceFit],
    used: Iterable[str],
) -> None:
    """Make a state the finished one, in one transaction that also deletes what is not used.

    Parameters
    ----------
    folder : Path
    facts : dict
        As JSON has it; `specimens` have the `name` of each, and the `key` of its fit.
    mean : TriangleMesh
    fits : sequence of SurfaceFit
        Of the specimens, in their order.
    used : iterable of str
        Keys of all fits that the next build may begin with.
    """
    with writing(COLLECTION, folder / DATABASE) as database:
        kept = {key for (key,) in database.execute("SELECT key FROM part NOT INDEXED")}
        for row, fit in zip(facts["specimens"], fits, strict=True):
            if row["key"] not in kept:  # another build, which ended meanwhile, did not use it
                insert_row(database, "part", row["key"], "last", row["name"], _pack(**asdict(fit)))
        unused = "DELETE FROM part WHERE key NOT IN (SELECT value FROM json_each(?))"
        database.execute(unused, (json.dumps([*used]),))
        database.execute("DELETE FROM state")
        packed = _pack(vertices=mean.vertices, faces=mean.faces)
        insert_row(database, "state", 1, json.dumps(facts), packed)
        database.execute("PRAGMA incremental_vacuum").fetchall()  # gives space back to the disk


@contextmanager
def exporting(folder: Path, facts: dict[str, Any]) -> Iterator[bool]:
    """Say whether a state is the finished one, and keep it so until the end of the block."""
    with writing(COLLECTION, folder / DATABASE) as database:
        rows = database.execute("SELECT facts FROM state").fetchall()
        yield rows == [(json.dumps(facts),)]


def read_state(folder: Path) -> tuple[dict[str, Any], TriangleMesh, list[SurfaceFit]]:
    """Return the facts, the mean and the fits of the finished state.

    Raise StoreError if there is none, or anything in the file is damaged.
    """
    path = folder / DATABASE
    if not path.is_file():
        raise _unfinished(
            f"{folder} holds one of an earlier version ({EARLIER}), which cannot be read. Build it "
            f"again in the same folder; then {EARLIER}, first and fits may be deleted."
            if (folder / EARLIER).exists()
            else f"{path} is not there. Build it, with the same folder as output."
        )
    with reading(COLLECTION, path) as database:
        states = read_table(COLLECTION, path, database, "state")
        parts = read_table(COLLECTION, path, database, "part")
    if not states:
        raise _unfinished(
            f"the build in {folder} was stopped. Build it again in the same folder: what is done is "
            "kept."
        )
    facts = json.loads(states[0][1])
    kept = {key: data for key, _, _, data, _ in parts}
    for row in facts["specimens"]:
        if row["key"] not in kept:
            raise DamagedFileError(
                f"{path} must hold what was written; the fit of {row['name']!r} is lost. "
                f"{COLLECTION.rescue}"
            )
    fits = [SurfaceFit(**_unpack(kept[row["key"]])) for row in facts["specimens"]]
    return facts, TriangleMesh(**_unpack(states[0][2])), fits


def _unfinished(what: str) -> StoreError:
    return StoreError(f"A finished collection must be in the folder; {what}")


def _pack(**arrays: Any) -> bytes:
    file = BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def _unpack(data: bytes) -> dict[str, Any]:
    with np.load(BytesIO(data)) as arrays:
        return {name: array if array.ndim else array.item() for name, array in arrays.items()}
