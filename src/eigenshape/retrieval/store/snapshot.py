"""One state of an index in compact arrays: what readers share, and what search is made from."""

import json
import mmap
import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from jaxtyping import Bool, Float, Int

from eigenshape._errors import StoreError
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, kind_of
from eigenshape.retrieval.patches.descriptor import PatchRecipe
from eigenshape.retrieval.search.isolations import stored_isolations
from eigenshape.retrieval.store.catalog import (
    CHANGES,
    DAMAGE,
    DATABASE,
    DescriptorRow,
    FileRow,
    RecipeRow,
    Seal,
    ShapeRow,
    WholeRows,
    read_changed,
    read_named,
    read_recipes,
    read_seals,
    read_table,
    read_touched,
)
from eigenshape.retrieval.store.damage import Damage
from eigenshape.retrieval.store.files import reading

# Columns of the table of descriptors, by name
DESCRIPTORS = np.dtype([(name, "<i8") for name in DescriptorRow._fields])
NO_DESCRIPTORS = np.empty(0, DESCRIPTORS)
# Columns of the table of shapes that say where the picture of each is
PICTURE = slice(ShapeRow._fields.index("thumbnail_file"), None)
N_TRIES = 5  # readings of an index whose files are compacted meanwhile


class DamagedEntryError(StoreError):
    """Numbers of a descriptor are not what was written; the message names them."""

    def __init__(self, place: int, damage: Damage) -> None:
        super().__init__(f"An index must hold what was written; {damage}.")
        self.place, self.damage = place, damage


@dataclass(frozen=True, eq=False)
class Shapes:
    """The table of shapes: one text for all, so that no object is kept for each.

    Attributes
    ----------
    ids : (n,) int
        Ascending.
    texts : bytes
        The rows as JSON, one behind the other.
    ends : (n,) int
        Where each ends.
    labels : tuple of str or None
        Without duplicates.
    label_codes : (n,) int
        Which of them each shape has.
    pictures : (n, 4) int
        File, offset, size and checksum of each thumbnail.
    """

    ids: Int[np.ndarray, " n"]
    texts: bytes
    ends: Int[np.ndarray, " n"]
    labels: tuple[str | None, ...]
    label_codes: Int[np.ndarray, " n"]
    pictures: Int[np.ndarray, "n 4"]

    def row(self, place: int) -> ShapeRow:
        """Return the row of a shape."""
        return ShapeRow(*json.loads(self._text(place)))

    def extended(self, chunks: Iterable[WholeRows]) -> "Shapes":
        """Return the table with more rows."""
        codes = {label: code for code, label in enumerate(self.labels)}
        columns = [(self.ids, self.ends, self.label_codes, self.pictures)]
        texts, size = [self.texts], len(self.texts)
        for rows, parts in chunks:
            ends = size + np.cumsum(np.array([len(part) for part in parts], dtype=np.int64))
            texts.append(b"".join(parts))
            size += len(texts[-1])
            ids = np.array([row.id for row in rows], dtype=np.int64)
            new = [codes.setdefault(row.label, len(codes)) for row in rows]
            where = np.array([row[PICTURE] for row in rows], dtype=np.int64).reshape(-1, 4)
            columns.append((ids, ends, np.array(new, dtype=np.int32), where))
        all_ids, all_ends, label_codes, pictures = map(np.concatenate, zip(*columns, strict=True))
        return Shapes(
            all_ids, b"".join(texts), all_ends, tuple(codes), label_codes, pictures
        )._in_order()

    def without(self, ids: list[int]) -> "Shapes":
        """Return the table without some rows."""
        return self._rows_at(np.flatnonzero(~np.isin(self.ids, ids)))

    def texts_of(self, ids: list[int]) -> list[bytes]:
        """Return the rows of some shapes, as far as the table has them, as JSON."""
        return [self._text(place) for place in np.flatnonzero(np.isin(self.ids, ids)).tolist()]

    def _text(self, place: int) -> bytes:
        start = int(self.ends[place - 1]) if place else 0
        return self.texts[start : self.ends[place]]

    def _in_order(self) -> "Shapes":
        """Return the rows by their numbers: those that were salvaged or replaced come last."""
        if (np.diff(self.ids) > 0).all():
            return self
        return self._rows_at(np.argsort(self.ids))

    def _rows_at(self, places: Int[np.ndarray, " k"]) -> "Shapes":
        """Return some rows; texts that follow one another are copied at once."""
        starts = np.concatenate([[0], self.ends[:-1]])
        breaks = np.flatnonzero(np.diff(places) != 1) + 1
        texts = [
            self.texts[starts[run[0]] : self.ends[run[-1]]]
            for run in np.split(places, breaks)
            if len(run)
        ]
        sizes = (self.ends - starts)[places]
        return Shapes(
            self.ids[places],
            b"".join(texts),
            np.cumsum(sizes),
            self.labels,
            self.label_codes[places],
            self.pictures[places],
        )


NO_SHAPES = Shapes(
    np.empty(0, np.int64),
    b"",
    np.empty(0, np.int64),
    (),
    np.empty(0, np.int32),
    np.empty((0, 4), np.int64),
)


@dataclass(frozen=True, eq=False)
class IndexState:
    """All of an index at one moment.

    Attributes
    ----------
    folder : Path
    seals : dict
        By table; equal seals mean equal rows.
    recipes : dict
        By number.
    files : dict
        Rows of the table of files, by number.
    maps : dict
        The bytes of each file, mapped into memory; fewer than the catalog says if it is torn.
    shapes : Shapes
    descriptors : (d,) structured array
        Columns of the table of descriptors.
    n_read : int
        Shapes that were read from the database, or left out, to make this of what was known.
    damages : tuple of Damage
        What was found so far. Numbers of a shape are checked when it is among the best.
    """

    folder: Path
    seals: dict[str, Seal]
    recipes: dict[int, AnyRecipe]
    files: dict[int, FileRow]
    maps: dict[int, memoryview]
    shapes: Shapes
    descriptors: np.ndarray
    n_read: int
    damages: tuple[Damage, ...]

    def piece(self, file: int, offset: int, size: int) -> memoryview:
        """Return bytes of a file; fewer if it is torn."""
        whole = self.maps.get(file)
        return whole[offset : offset + size] if whole is not None else memoryview(b"")

    def row_size(self, recipe: int) -> int:
        """Return the bytes of one number of a row by a recipe."""
        return int(kind_of(self.recipes[recipe]).row_type.itemsize)

    def file_name(self, number: int) -> str:
        """Return the name of a file, for messages."""
        file = self.files.get(number)
        if file is None:
            return f"file {number}"
        return file.name if file.folder is None else f"{file.folder}/{file.name}"

    def recipe_id(self, recipe: AnyRecipe) -> int | None:
        """Return the number of a recipe, or None if it is not stored."""
        return next((number for number, other in self.recipes.items() if other == recipe), None)

    def entries_by(self, recipe: AnyRecipe) -> Int[np.ndarray, " k"]:
        """Return where the descriptors by a recipe stand in the table."""
        # No recipe has the number 0.
        return np.flatnonzero(self.descriptors["recipe"] == (self.recipe_id(recipe) or 0))

    @cached_property
    def shape_of(self) -> Int[np.ndarray, " d"]:
        """Return the place of the shape of each descriptor."""
        return np.searchsorted(self.shapes.ids, self.descriptors["shape"])

    @cached_property
    def _snapshots(self) -> dict[AnyRecipe, "Snapshot"]:
        """Return those that were asked for: each query needs one, and its arrays are large."""
        return {}

    @cached_property
    def names(self) -> dict[str, int]:
        """Return the place of each shape by its name."""
        return {self.shapes.row(place).name: place for place in range(len(self.shapes.ids))}

    def thumbnail(self, place: int) -> bytes | None:
        """Return the picture of a shape, or None if it has none.

        Raises
        ------
        StoreError
            If it is damaged.
        """
        file, offset, size, checksum = self.shapes.pictures[place].tolist()
        if not size:
            return None
        data = bytes(self.piece(file, offset, size))
        if crc32(data) != checksum:
            name = self.shapes.row(place).name
            what = "its picture differs from its checksum"
            damage = Damage(self.file_name(file), what, name, offset, offset + size)
            raise DamagedEntryError(place, damage)
        return data

    def snapshot(self, recipe: AnyRecipe) -> "Snapshot":
        """Return all descriptors by a recipe.

        Raises
        ------
        StoreError
            If there are none.
        """
        known = self._snapshots.get(recipe)
        if known is not None:
            return known
        entries = self.entries_by(recipe)
        if not len(entries):
            used = set(np.unique(self.descriptors["recipe"]).tolist())
            names = sorted(str(other.name) for key, other in self.recipes.items() if key in used)
            raise StoreError(
                f"An index must hold descriptors of the requested recipe; {self.folder} holds "
                f"{', '.join(names) or 'no shape'}, and {recipe} was requested."
            )
        return self._snapshots.setdefault(recipe, Snapshot(self, recipe, entries))


@dataclass(frozen=True, eq=False)
class Snapshot:
    """All descriptors of an index by one recipe, at one moment; any number of threads may use it.

    A place is the number of a descriptor among them, in the order in which they were added. Shapes
    that are described by patches have one place each.

    Attributes
    ----------
    state : IndexState
    recipe : HeatRecipe or PatchRecipe
    entries : (k,) int
        Where each place stands in the table of descriptors.
    """

    state: IndexState
    recipe: AnyRecipe
    entries: Int[np.ndarray, " k"]
    row_type: "np.dtype[Any]" = field(init=False)
    columns: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "row_type", kind_of(self.recipe).row_type)
        columns = self.state.descriptors
        if len(self.entries) < len(columns):  # else no copy of 104 bytes a shape
            columns = columns[self.entries]
        object.__setattr__(self, "columns", columns)

    @property
    def n_shapes(self) -> int:
        """Return the number of places."""
        return len(self.entries)

    @cached_property
    def shape_of(self) -> Int[np.ndarray, " k"]:
        """Return which shape of the index each place describes."""
        return self.state.shape_of[self.entries]

    @property
    def label_codes(self) -> Int[np.ndarray, " k"]:
        """Return which of `state.shapes.labels` each place has."""
        return self.state.shapes.label_codes[self.shape_of]

    @property
    def row_checksums(self) -> Int[np.ndarray, " k"]:
        """Return a number for the rows of each place that changes whenever they do."""
        # With that of the details: of a million checksums of rows, a hundred pairs would be equal.
        rows = self.columns["rows_checksum"].astype(np.int64)
        return (rows << 31) ^ self.columns["details_checksum"].astype(np.int64)

    @cached_property
    def isolations(self) -> Float[np.ndarray, " k"]:
        """Return how isolated the shape of each place is; 0 for heat, whose scores are not scaled."""
        if not isinstance(self.recipe, PatchRecipe):
            return np.zeros(len(self.entries))
        return stored_isolations(self, self.recipe, self.columns["rows_checksum"])

    def rows(self, place: int) -> np.ndarray:
        """Return the (m, q) rows of a place, mapped into memory and not checked."""
        return self.rows_of(np.array([place]))[0]

    def rows_of(
        self, places: Int[np.ndarray, " k"], *, read_ahead: bool = False
    ) -> list[np.ndarray]:
        """Return the rows of some places, mapped into memory and not checked.

        With `read_ahead`, the system is told that all of them are needed. Of 1,600 shapes that lie
        apart in a file, none of them in memory, the rows were there after 0.4 s in place of 20. If
        they are in memory, it takes 2 microseconds a shape.
        """
        names = ("rows_file", "rows_offset", "n_rows", "n_columns")
        facts = (self.columns[name][places].tolist() for name in names)
        found = []
        for file, offset, n_rows, n_columns in zip(*facts, strict=True):
            whole, count = self.state.maps[file], n_rows * n_columns
            if read_ahead:
                ask_ahead(whole, offset, count * self.row_type.itemsize)
            rows = np.frombuffer(whole, self.row_type, count, offset)
            found.append(rows.reshape(n_rows, n_columns))
        return found

    def details(self, place: int) -> bytes:
        """Return the details of a place.

        Raises
        ------
        StoreError
            If they are damaged.
        """
        return self._checked(place, "details", int(self.columns[place]["details_size"]))

    def verify(self, place: int) -> None:
        """Check the rows of a place.

        Raises
        ------
        StoreError
            If they are damaged.
        """
        self._checked(place, "rows", self.rows(place).nbytes)

    def _checked(self, place: int, part: str, size: int) -> bytes:
        row = self.columns[place]
        file, offset = int(row[f"{part}_file"]), int(row[f"{part}_offset"])
        data = bytes(self.state.piece(file, offset, size))
        if crc32(data) != row[f"{part}_checksum"]:
            what = f"its {part} differ from their checksum"
            name = self.name(place)
            damage = Damage(self.state.file_name(file), what, name, offset, offset + size)
            raise DamagedEntryError(place, damage)
        return data

    def descriptor(self, place: int) -> Descriptor:
        """Return the descriptor of a place, checked.

        Raises
        ------
        StoreError
            If it is damaged.
        """
        self.verify(place)
        details = self.details(place)
        restored: Descriptor = kind_of(self.recipe).restore(self.rows(place), details, self.recipe)
        return restored

    def shape(self, place: int) -> ShapeRow:
        """Return the shape of a place."""
        return self.state.shapes.row(int(self.shape_of[place]))

    def name(self, place: int) -> str:
        """Return the name of the shape of a place."""
        return self.shape(place).name

    def names(self, places: Sequence[int]) -> list[str]:
        """Return the names of the shapes of some places."""
        return [self.shape(place).name for place in places]

    def labels(self, places: Sequence[int]) -> list[str | None]:
        """Return the labels of the shapes of some places."""
        return [self.shape(place).label for place in places]

    def sources(self, places: Sequence[int]) -> list[str | None]:
        """Return the sources of the shapes of some places."""
        return [self.shape(place).source for place in places]

    def mask(self, shapes: Bool[np.ndarray, " n"]) -> Bool[np.ndarray, " k"]:
        """Return which places describe one of the chosen shapes."""
        return shapes[self.shape_of]

    def beside(self, name: str) -> Path:
        """Return the path of a file of search that can be made again from the rows."""
        return self.state.folder / name


def ask_ahead(whole: memoryview, offset: int, size: int) -> None:
    """Tell the system that bytes of a mapped file are needed soon, and do not wait for them."""
    mapped = whole.obj
    if size and isinstance(mapped, mmap.mmap) and hasattr(mapped, "madvise"):  # not on Windows
        start = offset - offset % mmap.PAGESIZE
        mapped.madvise(mmap.MADV_WILLNEED, start, offset + size - start)


def read_state(
    folder: Path, before: IndexState | None = None, kept: IndexState | None = None
) -> IndexState:
    """Read an index.

    Parameters
    ----------
    folder : Path
    before : IndexState, optional
        Of the same index at an earlier moment: only what has changed since is read. It is returned
        if nothing has.
    kept : IndexState, optional
        As `before`, but its tables and files alone are known.

    Raises
    ------
    StoreError
        If the folder is not an index of this format, or its database cannot be read at all.
    """
    for _ in range(N_TRIES):
        state = _read_once(folder, before, kept)
        missing = [file for file in state.files.values() if file.id not in state.maps]
        # A file that is missing was compacted since the catalog was read, or is lost.
        if not missing or _n_changes(folder) == state.seals[CHANGES].n_rows:
            break
    return state


def _n_changes(folder: Path) -> int:
    with reading(folder) as (database, _):
        return read_seals(str(folder / DATABASE), database)[CHANGES].n_rows


def _read_once(folder: Path, before: IndexState | None, kept: IndexState | None) -> IndexState:
    with reading(folder) as (database, committed):
        seals = read_seals(str(folder / DATABASE), database)
        if before is not None and before.seals == seals:
            return before
        damages: list[Damage] = []
        if committed != seals[CHANGES].n_rows:
            damages += _lost_changes(committed, seals[CHANGES].n_rows)
        recipes, files = _read_short_tables(folder, database, seals, damages)
        changed = _changed_tables(database, before or kept, seals, files)
        tables = changed or _all_rows(database, seals, damages)
    state = IndexState(folder, seals, recipes, files, {}, *tables, ())
    return _with_files(state, damages, before)


def read_shape(folder: Path, name: str) -> IndexState | None:
    """Read what an index holds of one shape, at a cost that does not grow with the index.

    Returns
    -------
    IndexState or None
        None if there is no such shape or anything is damaged, which reading all of the index tells.

    Raises
    ------
    StoreError
        If the folder is not an index of this format.
    """
    damages: list[Damage] = []
    with reading(folder) as (database, committed):
        seals = read_seals(str(folder / DATABASE), database)
        if committed != seals[CHANGES].n_rows:
            return None
        try:
            recipes, files = _read_short_tables(folder, database, seals, damages)
            found = read_named(database, name)
        except DAMAGE:
            return None
    if found is None:
        return None
    tables = NO_SHAPES.extended([found[0]]), _as_columns(found[1]), 1
    state = _with_files(IndexState(folder, seals, recipes, files, {}, *tables, ()), damages)
    return None if damages else state


def _read_short_tables(
    folder: Path, database: sqlite3.Connection, seals: dict[str, Seal], damages: list[Damage]
) -> tuple[dict[int, AnyRecipe], dict[int, FileRow]]:
    """Return the recipes and the files of an index by their numbers."""
    rows: list[RecipeRow] = _whole_table(database, seals["recipe"], damages)
    recipes = read_recipes(str(folder / DATABASE), database, rows, damages)
    return recipes, {file.id: file for file in _whole_table(database, seals["file"], damages)}


def _with_files(
    state: IndexState, damages: list[Damage], before: IndexState | None = None
) -> IndexState:
    """Return a state with its files mapped into memory, and add their damage to a list."""
    maps = {}
    for file in state.files.values():
        mapped = _map(state.folder, file, before)
        if mapped is not None:
            maps[file.id] = mapped
        if mapped is None or len(mapped) < file.size:
            damages.append(_torn(file, mapped))
    return _without_torn(replace(state, maps=maps), damages)


def _lost_changes(committed: int, n_changes: int) -> list[Damage]:
    if committed < 0:
        return [Damage("committed.txt", "it does not hold a number twice")]
    if committed < n_changes:  # the writer was stopped just after it committed
        return []
    what = (
        f"{committed - n_changes} of {committed} changes that were committed are lost: the file is "
        "damaged, or was not copied with the others"
    )
    return [Damage(f"{DATABASE}-wal", what)]


def _whole_table(database: sqlite3.Connection, seal: Seal, damages: list[Damage]) -> list[Any]:
    return [row for chunk in read_table(database, seal, damages) for row in chunk.rows]


def _changed_tables(
    database: sqlite3.Connection,
    before: IndexState | None,
    seals: dict[str, Seal],
    files: dict[int, FileRow],
) -> tuple[Shapes, np.ndarray, int] | None:
    """Return the tables of before with what was changed, or None if all must be read."""
    if before is None or before.damages:
        return None
    generations = {file.id: file.generation for file in files.values()}
    if any(file.generation != generations.get(file.id) for file in before.files.values()):
        return None
    try:
        touched = read_touched(database, before.seals[CHANGES])
        is_touched = np.isin(before.descriptors["shape"], touched)
        left = {
            "shape": before.shapes.texts_of(touched),
            "descriptor": [row.tobytes() for row in before.descriptors[is_touched]],
        }
        shapes, descriptors = (
            read_changed(database, before.seals[table], seals[table], touched, texts)
            for table, texts in left.items()
        )
    except DAMAGE:
        return None
    if shapes is None or descriptors is None:
        return None
    kept = before.shapes.without(touched) if touched else before.shapes
    columns = np.concatenate([before.descriptors[~is_touched], _as_columns(descriptors)])
    n_read = len(shapes.rows) + len(touched)
    return kept.extended([shapes]), _by_number(columns), n_read


def _all_rows(
    database: sqlite3.Connection, seals: dict[str, Seal], damages: list[Damage]
) -> tuple[Shapes, np.ndarray, int]:
    shapes = NO_SHAPES.extended(read_table(database, seals["shape"], damages))
    parts = [_as_columns(rows) for rows in read_table(database, seals["descriptor"], damages)]
    descriptors = _by_number(np.concatenate([NO_DESCRIPTORS, *parts]))
    return shapes, descriptors, len(shapes.ids)


def _as_columns(rows: WholeRows) -> np.ndarray:
    return np.frombuffer(b"".join(rows.texts), DESCRIPTORS)


def _by_number(descriptors: np.ndarray) -> np.ndarray:
    """Return descriptors by their numbers: those that were salvaged or replaced come last."""
    if (np.diff(descriptors["id"]) > 0).all():
        return descriptors
    return descriptors[np.argsort(descriptors["id"], kind="stable")]


def _map(folder: Path, file: FileRow, before: IndexState | None) -> memoryview | None:
    """Map a file into memory; return None if there is none."""
    if not file.size:
        return memoryview(b"")
    old = before.files.get(file.id) if before else None
    if before is not None and old is not None and old.generation == file.generation:
        known = before.maps.get(file.id)
        if known is not None and len(known) >= file.size:
            return known
    place = folder if file.folder is None else folder / file.folder
    try:
        with (place / file.name).open("rb") as opened:
            return memoryview(mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ))
    except FileNotFoundError:
        return None
    except ValueError:  # the file is empty
        return memoryview(b"")


def _torn(file: FileRow, mapped: memoryview | None) -> Damage:
    name = file.name if file.folder is None else f"{file.folder}/{file.name}"
    if mapped is not None:
        what = f"it must hold {file.size} bytes, and holds {len(mapped)}"
        return Damage(name, what, None, len(mapped), file.size)
    again = "" if file.folder is None else "; merge the indexes again if that one was compacted"
    return Damage(name, f"it is missing{again}", None, 0, file.size)


def _without_torn(state: IndexState, damages: list[Damage]) -> IndexState:
    """Return a state without the descriptors that cannot be read, and name their shapes."""
    rows, ids = state.descriptors, state.shapes.ids
    usable = np.isin(rows["shape"], ids)
    if not usable.all():
        damages.append(
            Damage(DATABASE, f"{(~usable).sum()} descriptors are of shapes that are lost")
        )
    usable &= np.isin(rows["recipe"], list(state.recipes))
    sizes = np.zeros(len(rows), dtype=np.int64)
    for number in state.recipes:
        sizes[rows["recipe"] == number] = state.row_size(number)
    row_ends = rows["rows_offset"] + rows["n_rows"] * rows["n_columns"] * sizes
    details_ends = rows["details_offset"] + rows["details_size"]
    for file, end in ((rows["rows_file"], row_ends), (rows["details_file"], details_ends)):
        for number in np.unique(file).tolist():
            usable &= (file != number) | (end <= len(state.maps.get(number, b"")))
    if damages:
        unusable = np.isin(ids, rows["shape"][~usable]) | ~np.isin(ids, rows["shape"])
        for place in np.flatnonzero(unusable).tolist():
            what = "its descriptors cannot be read"
            damages.append(Damage(DATABASE, what, state.shapes.row(place).name))
    rows = rows[usable]
    return replace(state, descriptors=rows, damages=tuple(damages))
