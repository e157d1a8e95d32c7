"""Adding shapes to an index: what is known of each, what is checked, and which rows are written."""

import sqlite3
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from certeig.kit.arguments import require_each
from certeig.kit.arrays import record
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import StoreError
from eigenshape._sealed import checksum
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, details_of, recipe_to_text, rows_of
from eigenshape.retrieval.store.damage import Damage
from eigenshape.retrieval.store.database import (
    DATABASE,
    integer_checksums,
    read_recipes,
    read_seals,
)
from eigenshape.retrieval.store.facts import ShapeFacts, ShapeRow
from eigenshape.retrieval.store.state import (
    IndexState,
    MissingShapeError,
    StoredDescriptor,
    StoredShape,
)
from eigenshape.retrieval.thumbnails import LARGEST_THUMBNAIL


@dataclass(frozen=True)
class Record(ShapeFacts):
    """What an index holds of a shape beside its descriptors.

    Attributes
    ----------
    name : str
        Unique in the index.
    label : str or None
        Class of the shape.
    source : str or None
        Where the shape came from: a path, for example.
    digest : str or None
        Hash of the content, by which `build_index` recognizes a file that it has described.
    tags : tuple of str
        Words by which shapes are chosen.
    attributes : dict
        Numbers and texts by name, by which shapes are chosen.
    recipes : tuple of HeatRecipe or PatchRecipe
        By which the shape is described.

    See Also
    --------
    ShapeIndex.records

    Examples
    --------
    >>> import eigenshape as es
    >>> index = es.ShapeIndex.create(None)
    >>> fish, recipe = es.make_creature("fish", n_vertices=500), es.retrieval.SCALE_FREE
    >>> index.add("fish 1", fish, label="fish", attributes={"length": 0.4}, recipe=recipe)
    >>> [(record.name, record.attributes) for record in index.records(where={"label": "fish"})]
    [('fish 1', {'length': 0.4})]
    """

    recipes: tuple[AnyRecipe, ...] = ()


@record
class DescribedShape(ShapeFacts):
    """A shape that is described already, to be added to an index.

    Descriptors of one recipe are views of the shape: the whole first, then what is seen of it from
    some sides. The view with the lowest score counts.

    Parameters
    ----------
    name : str
        By which the shape is found; unique in the index.
    descriptors : sequence of HeatDescriptor or PatchDescriptor
    label, source : str, optional
        Class of the shape, and where it came from.
    digest : str, optional
        Hash of its content. If the name is in the index with the same digest, the shape gains the
        recipes that it lacks, and keeps its descriptors by the others, unless it is damaged.
    tags : sequence of str
        Words by which queries may choose shapes.
    attributes : mapping
        Numbers and texts by name, by which queries may choose shapes.
    thumbnail : bytes, optional
        A picture, PNG or WebP, of at most 8,192 bytes.

    See Also
    --------
    ShapeIndex.add_many, draw_thumbnail

    Examples
    --------
    >>> import eigenshape as es
    >>> fish = es.describe(es.make_creature("fish", n_vertices=500), es.retrieval.SCALE_FREE)
    >>> shape = es.retrieval.DescribedShape("fish", [fish], attributes={"length": 0.4})
    >>> index = es.ShapeIndex.create(None)
    >>> index.add_many([shape])
    >>> index.query(fish, where={"length": (0, 1)})[0].name
    'fish'
    """

    descriptors: Sequence[Descriptor]
    thumbnail: bytes | None = field(default=None, kw_only=True)


def rows_of_each(name: str, descriptors: Sequence[Descriptor]) -> list[np.ndarray]:
    """Return the rows of descriptors as they are stored; refuse numbers that cannot be."""
    if not descriptors:
        raise InvalidParameterError(
            f"A shape must have a descriptor to be found; {name!r} has none."
        )
    return [rows_of(descriptor, name) for descriptor in descriptors]


def require_columns(recipe: AnyRecipe, n_columns: int, known: int) -> None:
    """Raise an error if rows by a recipe are longer or shorter than others."""
    if n_columns != known:
        raise InvalidParameterError(
            f"All features of one recipe must have as many numbers; the features of recipe "
            f"{recipe.name!r} have {known}, and these have {n_columns}."
        )


def described(shape: DescribedShape) -> StoredShape:
    """Return a shape as it is stored; refuse what cannot be."""
    require_each(shape.descriptors, Descriptor, "descriptors")
    row = shape.as_row()
    if shape.thumbnail is not None and len(shape.thumbnail) > LARGEST_THUMBNAIL:
        raise InvalidParameterError(
            f"A thumbnail must have at most {LARGEST_THUMBNAIL} bytes; that of {shape.name!r} has "
            f"{len(shape.thumbnail)}. Use draw_thumbnail."
        )
    views: Counter[AnyRecipe] = Counter()
    stored = []
    pairs = zip(shape.descriptors, rows_of_each(shape.name, shape.descriptors), strict=True)
    for descriptor, rows in pairs:
        recipe = descriptor.recipe
        details = details_of(descriptor)
        n_rows, n_columns = rows.shape
        view, data = views[recipe], rows.tobytes()
        stored.append(StoredDescriptor(recipe, view, n_rows, n_columns, data, details))
        views[recipe] += 1
    return StoredShape(row, shape.thumbnail, stored)


class NameTakenError(StoreError):
    """The name of a shape stands for another one."""


class Writer:
    """Writes shapes in an open transaction. What it costs does not grow with the index.

    Raise StoreError if a recipe of the index is damaged.

    Parameters
    ----------
    folder : Path
    database : Connection
        In a transaction of `writing`.
    """

    def __init__(self, folder: Path, database: sqlite3.Connection) -> None:
        damages: list[Damage] = []
        seals = read_seals(folder, database)
        recipes = read_recipes(str(folder / DATABASE), database, damages)
        if damages:
            raise StoreError(
                f"An index must be whole to be changed; {folder}: {damages[0]}. Merge it into a "
                "new index to keep what is whole."
            )
        # As a state that sees what this transaction has changed
        self.state = IndexState(folder, database, seals, recipes, damages)
        self.database = database
        self._n_columns = dict(database.execute("SELECT id, n_columns FROM recipe"))

    def add(self, shape: StoredShape, *, replace: bool) -> bool:
        """Write a shape; return whether it is new.

        One of the same name and digest gains the recipes that it lacks. It is written anew if it is
        damaged: what has the same digest is the same.

        Raise StoreError if the name is in the index with another digest and `replace` is False, and
        InvalidParameterError if rows are longer or shorter than those of others by the same recipe.
        """
        name, digest = shape.row.name, shape.row.digest
        old = self.find(name)
        same = old is not None and old.digest is not None and old.digest == digest
        if old is not None and not same and not replace:
            digests = f"with digest {old.digest}, not {digest}"
            raise NameTakenError(
                f"A name stands for one shape; {name!r} is in the index "
                f"{digests if old.digest and digest else 'already'}. Remove it first, or add it "
                "with replace=True (--replace)."
            )
        if old is not None and not (same and self.state.is_whole(old)):
            self.delete(old)
            old = None
        known = set()
        if old is None:
            number = self._next("shape")
            row = shape.row._replace(
                id=number,
                n_descriptors=len(shape.descriptors),
                n_pictures=int(shape.picture is not None),
            )
            self._insert("shape", *row, checksum(*row))
            if shape.picture is not None:
                self._insert("picture", number, shape.picture, checksum(number, shape.picture))
        else:
            number = old.id
            query = "SELECT DISTINCT recipe FROM descriptor WHERE shape = ?"
            known = {self.state.recipes[row[0]] for row in self.database.execute(query, (number,))}
        new = [each for each in shape.descriptors if each.recipe not in known]
        for each in new:
            recipe = self.keep_recipe(each.recipe, each.n_columns)
            sizes = (each.view, each.n_rows, each.n_columns)
            checksums = (crc32(each.rows), crc32(each.details))
            integers = (self._next("descriptor"), number, recipe, *sizes, *checksums)
            seal = integer_checksums(np.array([integers], dtype=np.int64))
            self._insert("descriptor", *integers, int(seal[0]), each.rows, each.details)
        if old is not None and new:
            self._update(old._replace(n_descriptors=old.n_descriptors + len(new)))
        return not same

    def find(self, name: str) -> ShapeRow | None:
        """Return the shape of a name, or None if there is none."""
        found = self.database.execute("SELECT id FROM shape WHERE name = ?", (name,)).fetchone()
        if found is None:
            return None
        query = f"SELECT {', '.join(ShapeRow._fields)} FROM shape WHERE id = ?"
        row = self.database.execute(query, found).fetchone()
        if row is None or row[1] != name:  # a flipped bit in the list of names
            raise StoreError(
                f"The list of names must lead from {name!r} to its shape; it leads to "
                f"{row and row[1]!r}. {self.state.folder / DATABASE} is damaged: merge the index "
                "into a new one to keep what is whole."
            )
        return ShapeRow(*row)

    def remove(self, name: str) -> None:
        """Delete a shape, its descriptors and its picture."""
        facts = self.find(name)
        if facts is None:
            raise MissingShapeError(name, "be removed")
        self.delete(facts)

    def delete(self, facts: ShapeRow) -> None:
        """Delete the rows of a shape."""
        self.database.execute("DELETE FROM descriptor WHERE shape = ?", (facts.id,))
        for table in ("picture", "shape"):
            self.database.execute(f"DELETE FROM {table} WHERE id = ?", (facts.id,))

    def update(self, record: Record) -> None:
        """Write what is known of a shape anew."""
        row = record.as_row()
        old = self.find(record.name)
        if old is None:
            raise MissingShapeError(record.name, "be updated")
        new = ShapeRow(old.id, *row[1:7], old.n_descriptors, old.n_pictures)
        if new != old:
            self._update(new)

    def _update(self, facts: ShapeRow) -> None:
        fields = ", ".join(f"{name} = ?" for name in ShapeRow._fields[1:])
        query = f"UPDATE shape SET {fields}, checksum = ? WHERE id = ?"
        self.database.execute(query, (*facts[1:], checksum(*facts), facts.id))

    def _insert(self, table: str, *values: Any) -> None:
        marks = ", ".join("?" * len(values))
        self.database.execute(f"INSERT INTO {table} VALUES ({marks})", values)

    def _next(self, table: str) -> int:
        """Return a number that no row of a table has had."""
        query = "SELECT seq FROM sqlite_sequence WHERE name = ?"
        row = self.database.execute(query, (table,)).fetchone()
        return 1 + (row[0] if row else 0)

    def keep_recipe(self, recipe: AnyRecipe, n_columns: int = 0) -> int:
        """Return the number of a recipe, which is stored if it is new.

        A field that a stored recipe lacks, since it was introduced later, has its default. Rows by
        one recipe have as many numbers as those of the first shape.
        """
        numbers = [number for number, other in self.state.recipes.items() if other == recipe]
        number = numbers[0] if numbers else len(self._n_columns) + 1
        # None if the recipe is new, and 0 if it was kept before any shape was described by it
        known = self._n_columns.get(number)
        if known and n_columns:
            require_columns(recipe, n_columns, known)
        if known or known == n_columns:
            return number
        fields, codebook = recipe_to_text(recipe)
        row = (number, fields, n_columns, codebook or b"")
        if known is not None:
            self.database.execute("DELETE FROM recipe WHERE id = ?", (number,))
        self._insert("recipe", *row, checksum(*row))
        self.state.recipes[number] = recipe
        self._n_columns[number] = n_columns
        return number
