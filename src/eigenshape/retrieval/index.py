"""A collection of described shapes in a folder, and the question which of them are most alike."""

import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, SupportsIndex
from zlib import crc32

import numpy as np
from jaxtyping import Int

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError, StoreError
from eigenshape.retrieval import store
from eigenshape.retrieval.descriptor import Recipe, ShapeDescriptor
from eigenshape.retrieval.score import match_features, matching_scores


@dataclass(frozen=True)
class Record:
    """What an index knows of a shape beside its descriptors.

    Attributes
    ----------
    name : str
        Unique in the index.
    label : str or None
        Class, where it is known.
    source : str or None
        Where the shape came from, a path say.
    digest : str or None
        Hash of the content, by which a batch knows that it has the shape already.
    recipes : tuple of Recipe
        By which it is described.
    """

    name: str
    label: str | None
    source: str | None
    digest: str | None
    recipes: tuple[Recipe, ...]


@dataclass(frozen=True, eq=False)
class Match:
    """A shape that answers a query.

    Attributes
    ----------
    name, label, source : str
        As in its `Record`.
    score : float
        Of `matching_score`: 0 for the same descriptor, smaller is more alike.
    correspondences : (p, 2) int
        Feature of the query, feature of this shape, closest pairs first.
    vertices : (m,) int
        The vertex at which each feature of this shape lies.
    view : int
        Which of the shape's descriptors is meant, in the order in which they were added: 0 is the first.
    """

    name: str
    label: str | None
    source: str | None
    score: float
    correspondences: Int[np.ndarray, "p 2"]
    vertices: Int[np.ndarray, " m"]
    view: int


@dataclass(frozen=True)
class ShapeIndex:
    """A handle on a folder of descriptors: one writer at a time, any number of readers.

    Every call reads or writes the folder, and nothing is kept open between calls. A writer that is killed leaves the
    state before or the state after. Made by `ShapeIndex.create` or `ShapeIndex.open`.
    """

    folder: Path

    @classmethod
    def create(cls, folder: str | Path) -> "ShapeIndex":
        """Make an empty index in a folder that is empty or not there yet.

        Raises
        ------
        StoreError
            If the folder holds anything.
        """
        store.create(Path(folder))
        return cls(Path(folder))

    @classmethod
    def open(cls, folder: str | Path) -> "ShapeIndex":
        """Open an index that is there.

        Raises
        ------
        StoreError
            If the folder is no index, or one of another format.
        """
        store.require(Path(folder))
        return cls(Path(folder))

    def __len__(self) -> int:
        with store.reading(self.folder) as database:
            return int(database.execute("SELECT count(*) FROM shape").fetchone()[0])

    def records(self) -> list[Record]:
        """List all shapes by name."""
        with store.reading(self.folder) as database:
            shapes = database.execute("SELECT id, name, label, source, digest FROM shape ORDER BY name").fetchall()
            query = "SELECT DISTINCT shape, fields FROM descriptor JOIN recipe ON recipe.id = recipe ORDER BY recipe.id"
            recipes: dict[int, list[Recipe]] = {}
            for shape, fields in database.execute(query):
                recipes.setdefault(shape, []).append(store.read_recipe(fields))
        return [Record(*known, tuple(recipes.get(shape, ()))) for shape, *known in shapes]  # type: ignore[call-arg]

    def add(
        self,
        name: str,
        descriptors: Sequence[ShapeDescriptor],
        *,
        label: str | None = None,
        source: str | None = None,
        digest: str | None = None,
        replace: bool = False,
    ) -> None:
        """Add a shape with one or more descriptors.

        Descriptors of one recipe are views of the shape, the whole first, say, and then what is seen of it from some
        sides: the view with the lowest score counts. A name that is there with the same digest gains the recipes that
        it lacks, and keeps what it has of the others. With `replace`, a shape that is there with another digest gives
        way in the same step.

        Raises
        ------
        InvalidParameterError
            If there is no descriptor, a number is not finite, or rows are not as long as others of the recipe.
        StoreError
            If the name is there with another digest and is not to be replaced, or another process is writing.
        """
        _require_text(name, label, source, digest)
        _require_storable(name, descriptors)
        with store.writing(self.folder) as database:
            shape = _shape_id(database, (name, label, source, digest), replace=replace)
            for recipe in dict.fromkeys(descriptor.recipe for descriptor in descriptors):
                views = [descriptor for descriptor in descriptors if descriptor.recipe == recipe]
                self._put(database, shape, store.keep_recipe(database, recipe), views)

    def _put(self, database: sqlite3.Connection, shape: int, recipe: int, views: Sequence[ShapeDescriptor]) -> None:
        other = database.execute("SELECT n_columns FROM descriptor WHERE recipe = ? LIMIT 1", (recipe,)).fetchone()
        for descriptor in views:
            _require_columns(descriptor, other[0] if other else views[0].vectors.shape[1])
        if database.execute("SELECT 1 FROM descriptor WHERE shape = ? AND recipe = ?", (shape, recipe)).fetchone():
            return
        for view, descriptor in enumerate(views):
            rows, vertices = descriptor.vectors.astype(store.ROW), descriptor.vertices.astype("<i8").tobytes()
            offset = store.append_rows(self.folder, database, recipe, rows)
            entry = (shape, recipe, view, offset, *rows.shape, crc32(rows.tobytes()), vertices)
            database.execute("INSERT INTO descriptor VALUES (?, ?, ?, ?, ?, ?, ?, ?)", entry)

    def remove(self, name: str) -> None:
        """Remove a shape. The bytes of its rows stay in the file, so that a reader of the old state still finds them.

        Raises
        ------
        StoreError
            If there is no shape of that name, or another process is writing.
        """
        with store.writing(self.folder) as database:
            if not database.execute("DELETE FROM shape WHERE name = ?", (name,)).rowcount:
                raise StoreError(f"A shape must be in the index to be removed; {name!r} is not.")

    def query(self, descriptor: ShapeDescriptor, *, n_matches: SupportsIndex = 5) -> list[Match]:
        """Find the shapes whose descriptors of the same recipe have the lowest matching score, each shape once.

        Numbers are kept in single precision, and those of the query are rounded alike, so that a shape in the index
        finds itself with score 0. Equal scores are sorted by name.

        Raises
        ------
        InvalidParameterError
            If `n_matches` is not positive, or the descriptor could not stand in the index.
        StoreError
            If no shape has a descriptor of that recipe, or a file is damaged.
        """
        wanted = whole_number(n_matches, "n_matches", 1, 2**31)
        _require_storable("the query", [descriptor])
        single = ShapeDescriptor(
            descriptor.vectors.astype(store.ROW).astype(np.float64), descriptor.vertices, descriptor.recipe
        )
        with store.reading(self.folder) as database:
            entries, vectors = self._rows(database, descriptor.recipe)
        _require_columns(descriptor, vectors[0].shape[1])
        starts = np.cumsum([0, *(len(rows) for rows in vectors)])[:-1]
        scores, _ = matching_scores(single.vectors, np.concatenate(vectors).astype(np.float64), starts, single.recipe)
        order = np.argsort(scores, kind="stable")
        _, first = np.unique([entries[place][4] for place in order], return_index=True)
        best = order[np.sort(first)[:wanted]]
        return [_match(single, entries[place], vectors[place], float(scores[place])) for place in best]

    def descriptor(self, name: str, recipe: Recipe) -> ShapeDescriptor:
        """Return the first descriptor of a shape by a recipe, in single precision, to ask for more of its like.

        Raises
        ------
        StoreError
            If the shape is not there or has no descriptor of that recipe, or a file is damaged.
        """
        with store.reading(self.folder) as database:
            entries, vectors = self._rows(database, recipe)
        for entry, rows in zip(entries, vectors, strict=True):
            if entry[4] == name:
                return _stored(entry, rows, recipe)
        raise StoreError(f"A shape must be described by the recipe asked for; {name!r} is not described by {recipe}.")

    def _rows(self, database: sqlite3.Connection, recipe: Recipe) -> tuple[list[Any], list[np.ndarray]]:
        number = store.recipe_id(database, recipe)
        query = (
            "SELECT offset, n_rows, n_columns, checksum, name, label, source, vertices, view "
            "FROM descriptor JOIN shape ON shape.id = shape WHERE recipe = ? ORDER BY name, view"
        )
        entries = database.execute(query, (number,)).fetchall()
        if not entries:
            held = database.execute("SELECT fields FROM recipe WHERE id IN (SELECT recipe FROM descriptor)")
            there = sorted(store.read_recipe(fields).name for (fields,) in held)
            raise StoreError(
                f"An index answers in the recipes it holds; {self.folder} holds {', '.join(there) or 'no shape'} and "
                f"was asked in {recipe}."
            )
        path = store.rows_path(self.folder, number or 0)
        data = memoryview(path.read_bytes() if path.exists() else b"")
        return entries, [store.read_rows(data, entry[:4], path) for entry in entries]


def _match(query: ShapeDescriptor, entry: Any, rows: np.ndarray, score: float) -> Match:
    name, label, source, _, view = entry[4:]
    found = _stored(entry, rows, query.recipe)
    return Match(name, label, source, score, match_features(query, found), found.vertices, view)


def _stored(entry: Any, rows: np.ndarray, recipe: Recipe) -> ShapeDescriptor:
    return ShapeDescriptor(rows.astype(np.float64), np.frombuffer(entry[7], "<i8"), recipe)


def _require_text(name: str, *others: str | None) -> None:
    for text in (name, *others):
        if text is not None and (not isinstance(text, str) or text != text.encode(errors="replace").decode()):
            raise InvalidParameterError(f"What an index keeps beside numbers must be Unicode text; {text!r} is not.")


def _require_storable(name: str, descriptors: Sequence[ShapeDescriptor]) -> None:
    if not descriptors:
        raise InvalidParameterError(f"A shape needs a descriptor to be found by; {name!r} has none.")
    for descriptor in descriptors:
        rows = descriptor.vectors
        with np.errstate(over="ignore"):
            bad = np.argwhere(~np.isfinite(rows.astype(store.ROW)))
        if bad.size or not rows.size:
            where = f"entry {bad[0].tolist()} is {rows[tuple(bad[0])]}" if bad.size else "it has none"
            raise InvalidParameterError(f"A descriptor must hold finite single-precision numbers; of {name!r} {where}.")
        if descriptor.vertices.shape != rows.shape[:1]:
            raise InvalidParameterError(
                f"A descriptor must name one vertex a feature; of {name!r} {len(rows)} features have vertices of shape "
                f"{descriptor.vertices.shape}."
            )


def _require_columns(descriptor: ShapeDescriptor, n_columns: int) -> None:
    if descriptor.vectors.shape[1] != n_columns:
        raise InvalidParameterError(
            f"Features of one recipe must have equally many numbers; of {descriptor.recipe.name!r} they have "
            f"{n_columns}, and here {descriptor.vectors.shape[1]}."
        )


def _shape_id(
    database: sqlite3.Connection, known: tuple[str, str | None, str | None, str | None], *, replace: bool
) -> int:
    name, digest = known[0], known[-1]
    row = database.execute("SELECT id, digest FROM shape WHERE name = ?", (name,)).fetchone()
    if row is not None and row[1] is not None and row[1] == digest:
        return int(row[0])
    if row is not None and not replace:
        raise StoreError(
            f"A name stands for one shape; {name!r} is in the index with digest {row[1]}, not {digest}. "
            "Remove it first, or add it with replace=True."
        )
    database.execute("DELETE FROM shape WHERE name = ?", (name,))
    return int(database.execute("INSERT INTO shape VALUES (NULL, ?, ?, ?, ?)", known).lastrowid or 0)
