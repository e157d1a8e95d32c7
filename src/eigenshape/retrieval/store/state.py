"""One state of an index: a transaction that is held, and the integers of all descriptors in arrays."""

import sqlite3
import weakref
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from threading import RLock
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
from jaxtyping import Int

from certeig.kit.arrays import record
from eigenshape._errors import StoreError
from eigenshape._sealed import (
    DAMAGE,
    Seal,
    checksum,
    closed_on_error,
    committed_changes,
    explained,
    read_rows,
)
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, restore, row_type
from eigenshape.retrieval.store.damage import Damage
from eigenshape.retrieval.store.database import (
    DATABASE,
    INDEX,
    INTEGERS,
    integer_checksums,
    lost_changes,
    open_to_read,
    read_integers,
    read_recipes,
    read_seals,
)
from eigenshape.retrieval.store.facts import ShapeRow

SHAPES_AT_ONCE = 20_000  # whose facts are in memory at a time: 10 MB
DESCRIPTOR = ", ".join((*INTEGERS[1:], "checksum", "rows", "details"))


class StoredDescriptor(NamedTuple):
    """A descriptor as it is stored: its recipe, its view, and bytes."""

    recipe: AnyRecipe
    view: int
    n_rows: int
    n_columns: int
    rows: bytes
    details: bytes

    def restored(self) -> Descriptor:
        """Return the descriptor."""
        numbers = np.frombuffer(self.rows, row_type(self.recipe))
        return restore(numbers.reshape(self.n_rows, self.n_columns), self.details, self.recipe)


class StoredShape(NamedTuple):
    """All that an index holds of a shape."""

    row: ShapeRow
    picture: bytes | None
    descriptors: Sequence[StoredDescriptor]

    @property
    def n_bytes(self) -> int:
        """Return the bytes of the numbers and of the picture."""
        numbers = sum(len(each.rows) + len(each.details) for each in self.descriptors)
        return numbers + len(self.picture or b"")


class MissingShapeError(StoreError):
    """An index holds no shape of a name."""

    def __init__(self, name: str, purpose: str) -> None:
        super().__init__(f"A shape must be in the index to {purpose}; {name!r} is not.")


class DamagedEntryError(StoreError):
    """Descriptors are not what was written; the message names the first.

    Attributes
    ----------
    ids : sequence of int
        Numbers of the descriptors.
    damages : sequence of Damage
    """

    def __init__(self, ids: Sequence[int], damages: Sequence[Damage]) -> None:
        super().__init__(f"An index must hold what was written; {damages[0]}.")
        self.ids, self.damages = ids, damages


@dataclass(eq=False)
class IndexState:
    """All of an index at one moment; any number of threads may use it.

    Attributes
    ----------
    folder : Path
    database : Connection
        In a transaction, which ends with the last reference to this state.
    seals : dict
        By table.
    recipes : dict
        By number.
    damages : list of Damage
        What was found so far. Numbers of a shape are checked when it is among the best.
    before : array, optional
        Integers of an earlier state, of which only those that were added are read.
    """

    folder: Path
    database: sqlite3.Connection
    seals: dict[str, Seal]
    recipes: dict[int, AnyRecipe]
    damages: list[Damage]
    before: np.ndarray | None = None
    lock: RLock = field(default_factory=RLock)

    def __len__(self) -> int:
        return self.seals["shape"].n_rows

    @cached_property
    def descriptors(self) -> np.ndarray:
        """Return the integers of all descriptors, by their numbers."""
        with self.lock:
            found = read_integers(
                self.database, self.seals["descriptor"], self.damages, self.before
            )
            self.before = None
            known = np.isin(found["recipe"], list(self.recipes))
            return found if known.all() else found[known]

    @cached_property
    def shape_ids(self) -> Int[np.ndarray, " n"]:
        """Return the numbers of all shapes, ascending."""
        return np.unique(self.descriptors["shape"])

    def leave_out(self, ids: Sequence[int]) -> None:
        """Leave out descriptors that are damaged."""
        with self.lock:
            self.descriptors = self.descriptors[~np.isin(self.descriptors["id"], ids)]
            self.__dict__.pop("shape_ids", None)

    def read(
        self, table: str, columns: str, ids: Int[np.ndarray, " k"] | Sequence[int]
    ) -> dict[int, tuple[Any, ...]]:
        """Return rows of a table by their numbers, as far as they can be read."""
        numbers = np.asarray(ids, dtype=np.int64).tolist()
        with self.lock:
            return read_rows(self.database, table, columns, numbers) if numbers else {}

    def facts(self, ids: Int[np.ndarray, " k"] | Sequence[int]) -> dict[int, ShapeRow]:
        """Return what is known of some shapes, by their numbers.

        Raise DamagedEntryError if some cannot be read, with all that are damaged.
        """
        columns = ", ".join((*ShapeRow._fields[1:], "checksum"))
        found: dict[int, ShapeRow] = {}
        for number, row in self.read("shape", columns, ids).items():
            if checksum(*row[:-1]) == row[-1]:
                found[number] = ShapeRow(*row[:-1])
        lost = sorted(set(np.asarray(ids).tolist()) - set(found))
        if lost:
            what = "row {} of table shape is lost or differs from its checksum"
            damages = [Damage(DATABASE, what.format(number)) for number in lost]
            rows = self.descriptors
            raise DamagedEntryError(rows["id"][np.isin(rows["shape"], lost)].tolist(), damages)
        return found

    def every(self) -> Iterator[ShapeRow]:
        """Yield what is known of all shapes; damage is noted, and the rest comes."""
        for first in range(0, len(self.shape_ids), SHAPES_AT_ONCE):
            some = self.shape_ids[first : first + SHAPES_AT_ONCE]
            try:
                yield from self.facts(some).values()
            except DamagedEntryError as err:
                self.damages += [each for each in err.damages if each not in self.damages]
                damaged = np.isin(self.descriptors["id"], err.ids)
                lost = self.descriptors["shape"][damaged]
                yield from self.facts(some[~np.isin(some, lost)]).values()

    @cached_property
    def labels(self) -> tuple[list[str | None], Int[np.ndarray, " n"]]:
        """Return the labels without duplicates, and which of them each shape has, or -1."""
        codes: dict[str | None, int] = {}
        found = np.full(len(self.shape_ids), -1, dtype=np.int32)
        for facts in self.every():
            place = np.searchsorted(self.shape_ids, facts.id)
            found[place] = codes.setdefault(facts.label, len(codes))
        return list(codes), found

    @cached_property
    def names(self) -> list[str]:
        """Return the names of all shapes, sorted."""
        return sorted(facts.name for facts in self.every())

    def find(self, name: str) -> ShapeRow | None:
        """Return what is known of a shape by its name, or None if there is none.

        Raise DamagedEntryError if it is damaged.
        """
        query = "SELECT id FROM shape {} WHERE name = ?"
        # The list of names of SQLite first; a damaged bit of that may hide a name.
        for source in ("", "NOT INDEXED"):
            with self.lock, explained(INDEX, self.folder / DATABASE):
                row = self.database.execute(query.format(source), (name,)).fetchone()
            if row is not None:
                facts = self.facts(row)[row[0]]
                if facts.name == name:
                    return facts
        return None

    def require(self, name: str, purpose: str) -> ShapeRow:
        """Return what is known of a shape by its name; raise MissingShapeError if there is none."""
        facts = self.find(name)
        if facts is None:
            raise MissingShapeError(name, purpose)
        return facts

    def shape(self, facts: ShapeRow) -> StoredShape:
        """Return all that the index holds of a shape, checked.

        Raise DamagedEntryError if anything of it is damaged.
        """
        descriptors = self.stored(self.descriptor_ids(facts))
        return StoredShape(facts, self.picture(facts), descriptors)

    def is_whole(self, facts: ShapeRow) -> bool:
        """Return whether a shape, its numbers and its picture agree with their checksums."""
        try:
            self.facts([facts.id])
            self.shape(facts)
        except DamagedEntryError:
            return False
        return True

    def descriptor_ids(self, facts: ShapeRow) -> list[int]:
        """Return the numbers of the descriptors of a shape.

        Raise DamagedEntryError if some are lost.
        """
        query = "SELECT id FROM descriptor WHERE shape = ? ORDER BY id"
        ids: list[int] = []
        with self.lock, suppress(*DAMAGE):
            ids = [number for (number,) in self.database.execute(query, (facts.id,))]
        rows = self.read("descriptor", "shape", ids).values()
        # A damaged bit of that index of SQLite may hide descriptors, or lead to others.
        if [shape for _, shape in rows] != [facts.id] * facts.n_descriptors:
            ids = self.descriptors["id"][self.descriptors["shape"] == facts.id].tolist()
        if len(ids) != facts.n_descriptors:
            what = f"{facts.n_descriptors - len(ids)} of its descriptors are lost"
            raise DamagedEntryError(ids, [Damage(DATABASE, what, facts.name)])
        return ids

    def stored(self, ids: Sequence[int]) -> list[StoredDescriptor]:
        """Return descriptors by their numbers, checked.

        Raise DamagedEntryError if one of them is damaged.
        """
        rows = self.read("descriptor", DESCRIPTOR, ids)
        found = []
        for number in ids:
            row = rows.get(number)
            if row is None:
                raise self.damaged([number], "its row cannot be read")
            # id, shape, recipe, view, n_rows, n_columns, two checksums; that of these; the bytes
            integers, expected, rows_bytes, details = row[:8], row[8], row[9], row[10]
            if (
                not all(isinstance(value, int) for value in integers)
                or integer_checksums(np.array([integers], dtype=np.int64))[0] != expected
            ):
                raise self.damaged([number], "its row differs from its checksum")
            if not isinstance(rows_bytes, bytes) or crc32(rows_bytes) != integers[6]:
                raise self.damaged([number], "its rows differ from their checksum")
            if not isinstance(details, bytes) or crc32(details) != integers[7]:
                raise self.damaged([number], "its details differ from their checksum")
            if integers[2] not in self.recipes:
                raise self.damaged([number], "its recipe is lost")
            recipe = self.recipes[integers[2]]
            view, n_rows, n_columns = integers[3:6]
            found.append(StoredDescriptor(recipe, view, n_rows, n_columns, rows_bytes, details))
        return found

    def damaged(self, ids: Sequence[int], what: str) -> DamagedEntryError:
        """Return the error of damaged descriptors, which names their shapes as far as it can."""
        shapes = self.descriptors["shape"][np.isin(self.descriptors["id"], ids)]
        names: dict[int, str] = {}
        with suppress(DamagedEntryError):
            names = {key: facts.name for key, facts in self.facts(np.unique(shapes)).items()}
        damages = [Damage(DATABASE, what, names.get(shape)) for shape in shapes.tolist()]
        return DamagedEntryError(ids, damages or [Damage(DATABASE, what)])

    def picture(self, facts: ShapeRow) -> bytes | None:
        """Return the picture of a shape, or None if it has none.

        Raise DamagedEntryError if it is damaged.
        """
        if not facts.n_pictures:
            return None
        row = self.read("picture", "data, checksum", [facts.id]).get(facts.id)
        if row is None or checksum(*row[:2]) != row[2]:
            what = "its picture is lost or differs from its checksum"
            raise DamagedEntryError([], [Damage(DATABASE, what, facts.name)])
        return bytes(row[1])

    def snapshot(self, recipe: AnyRecipe) -> "Snapshot":
        """Return all descriptors by a recipe; raise StoreError if there are none."""
        rows = self.descriptors
        numbers = [number for number, other in self.recipes.items() if other == recipe]
        mask = np.isin(rows["recipe"], numbers)
        if not mask.any():
            used = set(np.unique(rows["recipe"]).tolist())
            names = sorted(str(self.recipes[number].name) for number in used)
            raise StoreError(
                f"An index must hold descriptors of the requested recipe; {self.folder} holds "
                f"{', '.join(names) or 'no shape'}, and {recipe} was requested."
            )
        columns = rows if mask.all() else rows[mask]
        columns.flags.writeable = False  # any number of threads use it
        return Snapshot(self, recipe, columns)


@record
class Snapshot:
    """All descriptors of an index by one recipe, at one moment; any number of threads may use it.

    A place is the number of a descriptor among them, in the order in which they were added. Shapes
    that are described by patches have one place each.

    Attributes
    ----------
    state : IndexState
    recipe : HeatRecipe or PatchRecipe
    columns : (k,) structured array
        The integers of the descriptors.
    """

    state: IndexState
    recipe: AnyRecipe
    columns: np.ndarray

    @property
    def n_shapes(self) -> int:
        """Return the number of places."""
        return len(self.columns)

    @property
    def shape_of(self) -> Int[np.ndarray, " k"]:
        """Return the number of the shape of each place."""
        return np.asarray(self.columns["shape"])

    @property
    def row_checksums(self) -> Int[np.ndarray, " k"]:
        """Return a number for the rows of each place that changes whenever they do."""
        # With that of the details: of a million checksums of rows, a hundred pairs would be equal.
        return (self.columns["rows_checksum"] << 31) ^ self.columns["details_checksum"]

    def rows_of(self, places: Int[np.ndarray, " k"], *, checked: bool = False) -> list[np.ndarray]:
        """Return the (m, q) rows of some places, compared with their checksums if that is wanted.

        It takes 25 microseconds a shape with views, more than reading them.

        Raise DamagedEntryError if some cannot be read, or are damaged, with all of these.
        """
        kind, columns = row_type(self.recipe), self.columns[places]
        ids = columns["id"].tolist()
        blobs = self.state.read("descriptor", "rows", ids)
        found, lost = [], []
        names = ("id", "n_rows", "n_columns", "rows_checksum")
        for number, n_rows, n_columns, expected in columns[list(names)].tolist():
            blob = blobs[number][1] if number in blobs else b""
            is_whole = isinstance(blob, bytes) and (not checked or crc32(blob) == expected)
            if is_whole and len(blob) == n_rows * n_columns * kind.itemsize:
                found.append(np.frombuffer(blob, kind).reshape(n_rows, n_columns))
            else:
                lost.append(number)
        if lost:
            raise self.state.damaged(lost, "its rows cannot be read")
        return found

    def descriptor(self, place: int) -> Descriptor:
        """Return the descriptor of a place, checked; raise DamagedEntryError if it is damaged."""
        (stored,) = self.state.stored([int(self.columns["id"][place])])
        return stored.restored()

    def facts(self, places: Int[np.ndarray, " k"]) -> list[ShapeRow]:
        """Return what is known of the shapes of some places."""
        shapes = self.columns["shape"][places]
        found = self.state.facts(np.unique(shapes))
        return [found[shape] for shape in shapes.tolist()]

    def beside(self, name: str) -> Path:
        """Return the path of a file of search that can be made again from the rows."""
        return self.state.folder / name


def read_state(folder: Path, before: IndexState | None = None) -> IndexState:
    """Read an index.

    Raise StoreError if the folder is not an index of this format, or its database cannot be read at
    all.

    Parameters
    ----------
    folder : Path
    before : IndexState, optional
        Of the same index at an earlier moment: only what was added since is read, and nothing if
        all is the same.
    """
    place, committed = str(folder / DATABASE), committed_changes(INDEX, folder / DATABASE)
    with explained(INDEX, folder / DATABASE):
        database = open_to_read(folder)
        with closed_on_error(database):
            damages: list[Damage] = []
            seals = read_seals(folder, database, damages)
            damages += [] if damages else lost_changes(committed, seals)
            recipes = read_recipes(place, database, damages)
    columns = None if before is None or before.damages else before.descriptors
    state = IndexState(folder, database, seals, recipes, damages, columns)
    # A connection refers to itself, so it would wait for the garbage collector.
    weakref.finalize(state, database.close)
    if before is not None and before.seals == seals:
        for name in ("descriptors", "shape_ids", "labels", "names"):
            if name in before.__dict__:
                state.__dict__[name] = before.__dict__[name]
    return state
