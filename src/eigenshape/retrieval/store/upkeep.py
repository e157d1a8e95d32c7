"""Upkeep of an index: give space back, find damage, take descriptors out, make one of several."""

import json
import sqlite3
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from certeig.kit.text import Shown
from eigenshape._errors import StoreError
from eigenshape._sealed import DAMAGE
from eigenshape.retrieval.store.damage import Damage, warn_of_damage
from eigenshape.retrieval.store.database import DATABASE, TABLES, writing
from eigenshape.retrieval.store.state import DamagedEntryError, IndexState, read_state
from eigenshape.retrieval.store.writing import Record, Writer

FIRST_STEP = 8  # pages that a compaction moves; they take 0.3 MB of the log


@dataclass(frozen=True)
class IndexReport(Shown):
    """What `ShapeIndex.verify` found.

    Attributes
    ----------
    n_shapes : int
        Shapes that can be read.
    n_bytes : int
        Bytes that were compared with their checksums.
    damages : tuple of Damage
        Empty if the index holds all that was written.

    See Also
    --------
    ShapeIndex.verify

    Examples
    --------
    >>> import eigenshape as es
    >>> report = es.ShapeIndex.create(None).verify()
    >>> for damage in report.damages:
    ...     print(damage)
    >>> report.n_shapes
    0
    """

    n_shapes: int
    n_bytes: int
    damages: tuple[Damage, ...]


def verify_index(folder: Path) -> IndexReport:
    """Compare everything in an index with its checksums."""
    state = read_state(folder)
    damages = list[Damage]()
    n_shapes, n_bytes = 0, 0
    for facts in state.every():
        n_shapes += 1
        try:
            n_bytes += state.shape(facts).n_bytes
        except DamagedEntryError as err:
            damages += err.damages
    # What search does not read: whole tables beside their seals, and the pages of SQLite.
    for table in TABLES:
        seal, query = state.seals[table], f"SELECT count(*), sum(checksum) FROM {table} NOT INDEXED"
        with suppress(*DAMAGE):
            n_rows, total = state.database.execute(query).fetchone()
            if (n_rows, total or 0) != seal[:2]:
                what = (
                    f"table {table} has {n_rows} rows of {seal.n_rows}, or others than were written"
                )
                damages.append(Damage(DATABASE, what))
    try:
        found = state.database.execute("PRAGMA integrity_check").fetchall()
    except DAMAGE as err:
        found = [(str(err),)]
    damages += [Damage(DATABASE, text) for (text,) in found if text != "ok"]
    return IndexReport(n_shapes, n_bytes, tuple(dict.fromkeys([*state.damages, *damages])))


def find_damaged(folder: Path, names: Sequence[str]) -> set[str]:
    """Return which of some shapes of an index differ from their checksums, or are not there."""
    state, whole = read_state(folder), set[str]()
    for name in names:
        with suppress(DamagedEntryError):
            facts = state.find(name)
            if facts is not None:
                state.shape(facts)
                whole.add(name)
    return set(names) - whole


def compact_index(folder: Path) -> int:
    """Give the free pages of an index back to the disk; return their bytes.

    SQLite moves the last pages into free ones, so it costs as much as was removed.

    Raise StoreError if another process is writing, the disk is full, or pages are damaged.
    """
    with writing(folder, frees=True) as database:

        def number(name: str) -> int:
            return int(database.execute(f"PRAGMA {name}").fetchone()[0])

        before = number("page_count")
        n_pages, is_held = FIRST_STEP, 0
        while number("freelist_count"):
            # A script: `execute` would move one page alone. It commits each step.
            database.executescript(f"PRAGMA incremental_vacuum({n_pages})")
            if not is_held:
                try:
                    is_held = number("wal_checkpoint(TRUNCATE)")
                except sqlite3.OperationalError:  # the file must be shorter first
                    is_held = 1
            # The space that a step gives back is enough for the log of one twice as long. While a
            # reader holds an older state none comes back, so the rest is one step (0).
            n_pages = 0 if is_held else 2 * n_pages
        if is_held:
            number("wal_checkpoint(PASSIVE)")
        return number("page_size") * (before - number("page_count"))


def merge_indexes(folder: Path, others: Sequence[Path], *, replace: bool) -> int:
    """Add the shapes of other indexes in one transaction; return how many were added.

    What is damaged in them is left out, with a warning.
    """
    n_added, damages = 0, list[Damage]()
    with writing(folder) as database:
        writer = Writer(folder, database)
        for other in dict.fromkeys(path.resolve() for path in others):  # each once
            if other == folder.resolve():
                raise StoreError(
                    f"An index is merged with others; {folder} is this one. Leave it out."
                )
            state = read_state(other)
            for recipe in state.recipes.values():
                writer.keep_recipe(recipe)
            for facts in state.every():
                try:
                    shape = state.shape(facts)
                except DamagedEntryError as err:
                    damages += err.damages
                else:
                    n_added += writer.add(shape, replace=replace)
            damages += state.damages
    warn_of_damage(", ".join(map(str, others)), damages)
    return n_added


def export_index(state: IndexState, records: Sequence[Record], folder: Path) -> None:
    """Write records as JSON and descriptors as NPZ into a new folder.

    Raise StoreError if the folder holds anything, or something that is exported is damaged.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        is_empty = not any(folder.iterdir())
    except OSError as err:
        raise StoreError(
            f"An export needs a folder; {folder} cannot be made: {err.strerror}. Choose another folder."
        ) from err
    if not is_empty:
        raise StoreError(
            f"{folder} must be empty to export into; it is not. Choose another folder."
        )
    listing = []
    with zipfile.ZipFile(folder / "descriptors.npz", "w", zipfile.ZIP_STORED) as archive:
        for number, record in enumerate(records):
            facts = {"number": number} | {
                each.name: getattr(record, each.name) for each in fields(Record)
            }
            facts["recipes"] = [recipe.name for recipe in record.recipes]
            listing.append(facts)
            known = state.find(record.name)
            for stored in [] if known is None else state.shape(known).descriptors:
                key = f"{number}/{stored.recipe.name}/{stored.view}"
                for name, array in _arrays(stored.restored(), key):
                    with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                        np.lib.format.write_array(file, array, allow_pickle=False)
    text = json.dumps(listing, indent=1, ensure_ascii=True)
    (folder / "records.json").write_text(text, encoding="utf-8")


def _arrays(value: Any, key: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the arrays of a descriptor, and of values inside it, by name."""
    for each in fields(value):
        found = getattr(value, each.name)
        if isinstance(found, np.ndarray):
            yield f"{key}/{each.name}", found
        elif isinstance(found, tuple):
            for number, inner in enumerate(found):
                if is_dataclass(inner):
                    yield from _arrays(inner, f"{key}/{each.name}/{number}")
