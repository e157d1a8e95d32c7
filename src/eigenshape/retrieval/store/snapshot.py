"""One state of an index in compact arrays: what readers share, and what search is made from."""

import json
import mmap
import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from jaxtyping import Bool, Int

from eigenshape._errors import StoreError
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, kind_of
from eigenshape.retrieval.store.catalog import (
    CHANGES,
    DATABASE,
    DescriptorRow,
    FileRow,
    RecipeRow,
    Seal,
    ShapeRow,
    read_appended,
    read_recipes,
    read_seals,
    read_table,
    row_text,
)
from eigenshape.retrieval.store.damage import Damage
from eigenshape.retrieval.store.files import reading

# Columns of the table of descriptors, by name
DESCRIPTORS = np.dtype([(name, np.int64) for name in DescriptorRow._fields])
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
        start = int(self.ends[place - 1]) if place else 0
        return ShapeRow(*json.loads(self.texts[start : self.ends[place]]))

    def extended(self, chunks: Iterator[list[ShapeRow]]) -> "Shapes":
        """Return the table with more rows, whose numbers are larger."""
        codes = {label: code for code, label in enumerate(self.labels)}
        ids, ends, label_codes, pictures = (
            [self.ids],
            [self.ends],
            [self.label_codes],
            [self.pictures],
        )
        texts = [self.texts]
        size = len(self.texts)
        for rows in chunks:
            parts = [row_text(row) for row in rows]
            sizes = np.array([len(part) for part in parts], dtype=np.int64)
            texts.append(b"".join(parts))
            ids.append(np.array([row.id for row in rows], dtype=np.int64))
            ends.append(size + np.cumsum(sizes))
            size += len(texts[-1])
            new = [codes.setdefault(row.label, len(codes)) for row in rows]
            label_codes.append(np.array(new, dtype=np.int32))
            where = np.array([row[PICTURE] for row in rows], dtype=np.int64).reshape(-1, 4)
            pictures.append(where)
        return Shapes(
            np.concatenate(ids),
            b"".join(texts),
            np.concatenate(ends),
            tuple(codes),
            np.concatenate(label_codes),
            np.concatenate(pictures),
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

    @cached_property
    def shape_of(self) -> Int[np.ndarray, " d"]:
        """Return the place of the shape of each descriptor."""
        return np.searchsorted(self.shapes.ids, self.descriptors["shape"])

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
        number = self.recipe_id(recipe)
        entries = np.flatnonzero(self.descriptors["recipe"] == (number or 0))
        if number is None or not len(entries):
            used = set(np.unique(self.descriptors["recipe"]).tolist())
            names = sorted(str(other.name) for key, other in self.recipes.items() if key in used)
            raise StoreError(
                f"An index must hold descriptors of the requested recipe; {self.folder} holds "
                f"{', '.join(names) or 'no shape'}, and {recipe} was requested."
            )
        return Snapshot(self, recipe, entries)


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
        object.__setattr__(self, "columns", self.state.descriptors[self.entries])

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

    def rows(self, place: int) -> np.ndarray:
        """Return the (m, q) rows of a place, mapped into memory and not checked."""
        row = self.columns[place]
        n_rows, n_columns = int(row["n_rows"]), int(row["n_columns"])
        whole = self.state.maps[int(row["rows_file"])]
        count, offset = n_rows * n_columns, int(row["rows_offset"])
        return np.frombuffer(whole, self.row_type, count, offset).reshape(n_rows, n_columns)

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


def read_state(folder: Path, before: IndexState | None = None) -> IndexState:
    """Read an index. Of what was read before, only what was added since is read.

    Raises
    ------
    StoreError
        If the folder is not an index of this format, or its database cannot be read at all.
    """
    for _ in range(N_TRIES):
        state = _read_once(folder, before)
        missing = [file for file in state.files.values() if file.id not in state.maps]
        # A file that is missing was compacted since the catalog was read, or is lost.
        if not missing or _n_changes(folder) == state.seals[CHANGES].n_rows:
            break
    return state


def _n_changes(folder: Path) -> int:
    with reading(folder) as (database, _):
        return read_seals(str(folder / DATABASE), database)[CHANGES].n_rows


def _read_once(folder: Path, before: IndexState | None) -> IndexState:
    with reading(folder) as (database, committed):
        seals = read_seals(str(folder / DATABASE), database)
        if before is not None and before.seals == seals:
            return before
        damages: list[Damage] = []
        if committed != seals[CHANGES].n_rows:
            damages += _lost_changes(committed, seals[CHANGES].n_rows)
        rows: list[RecipeRow] = _whole_table(database, seals["recipe"], damages)
        recipes = read_recipes(str(folder / DATABASE), database, rows, damages)
        files = {file.id: file for file in _whole_table(database, seals["file"], damages)}
        tables = _appended(database, before, seals, files) or _all_rows(database, seals, damages)
    shapes, descriptors = tables
    maps = {}
    for file in files.values():
        mapped = _map(folder, file, before)
        if mapped is not None:
            maps[file.id] = mapped
        if mapped is None or len(mapped) < file.size:
            damages.append(_torn(file, mapped))
    state = IndexState(folder, seals, recipes, files, maps, shapes, descriptors, ())
    return _without_torn(state, damages)


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
    return [row for rows in read_table(database, seal, damages) for row in rows]


def _appended(
    database: sqlite3.Connection,
    before: IndexState | None,
    seals: dict[str, Seal],
    files: dict[int, FileRow],
) -> tuple[Shapes, np.ndarray] | None:
    """Return the tables of before with what was added, or None if something else was changed."""
    if before is None or before.damages:
        return None
    generations = {file.id: file.generation for file in files.values()}
    if any(file.generation != generations.get(file.id) for file in before.files.values()):
        return None
    shapes, descriptors = (
        read_appended(database, before.seals[table], seals[table])
        for table in ("shape", "descriptor")
    )
    if shapes is None or descriptors is None:
        return None
    added = _as_columns(descriptors)
    return before.shapes.extended(iter([shapes])), np.concatenate([before.descriptors, added])


def _all_rows(
    database: sqlite3.Connection, seals: dict[str, Seal], damages: list[Damage]
) -> tuple[Shapes, np.ndarray]:
    chunks = read_table(database, seals["shape"], damages)
    shapes = _in_order(NO_SHAPES.extended(chunks))
    parts = [_as_columns(rows) for rows in read_table(database, seals["descriptor"], damages)]
    descriptors = np.concatenate(parts) if parts else _as_columns([])
    return shapes, descriptors[np.argsort(descriptors["id"], kind="stable")]


def _in_order(shapes: Shapes) -> Shapes:
    """Return the shapes by their numbers; some that were salvaged come last otherwise."""
    if (np.diff(shapes.ids) > 0).all():
        return shapes
    order = np.argsort(shapes.ids).tolist()
    return NO_SHAPES.extended(iter([[shapes.row(place) for place in order]]))


def _as_columns(rows: list[DescriptorRow]) -> np.ndarray:
    numbers = np.array(rows, dtype=np.int64).reshape(-1, len(DescriptorRow._fields))
    return numbers.view(DESCRIPTORS).ravel()


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
    known = (state.folder, state.seals, state.recipes, state.files, state.maps, state.shapes)
    return IndexState(*known, rows, tuple(damages))
