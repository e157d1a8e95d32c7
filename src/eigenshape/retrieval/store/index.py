"""A collection of described shapes in a folder, and the question which of them are most alike."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import SupportsIndex
from zlib import crc32

import numpy as np
from jaxtyping import Int

from eigenshape._arguments import require_each, require_type
from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError, StoreError
from eigenshape._threads import one_blas_thread
from eigenshape.retrieval.store import files as store
from eigenshape.retrieval.store.catalog import Catalog, ShapeRow, keep_recipe
from eigenshape.retrieval.store.kinds import AnyRecipe, Descriptor, kind_of
from eigenshape.retrieval.store.reading import Held, held_by


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
    recipes : tuple of Recipe or PatchRecipe
        By which it is described.
    """

    name: str
    label: str | None
    source: str | None
    digest: str | None
    recipes: tuple[AnyRecipe, ...]


@dataclass(frozen=True, eq=False)
class Match:
    """A shape that answers a query.

    Attributes
    ----------
    name, label, source : str
        As in its `Record`.
    score : float
        Of `matching_score` or `patch_scores`: 0, or nearly, for the same descriptor; smaller is more alike.
    correspondences : (p, 2) int
        Feature or patch of the query, the same of this shape, surest pairs first.
    vertices : (m,) int
        The vertex at which each feature or patch of this shape lies.
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
            If the folder is no index, or one of another format, or its database is damaged.
        """
        with store.reading(Path(folder)):
            return cls(Path(folder))

    @classmethod
    def open_or_create(cls, folder: str | Path) -> "ShapeIndex":
        """Open the index in a folder, or make an empty one; of several processes at once, one makes it.

        Raises
        ------
        StoreError
            If the folder holds anything but an index of this format.

        Examples
        --------
        >>> from tempfile import TemporaryDirectory
        >>> import eigenshape as es
        >>> with TemporaryDirectory() as folder:
        ...     es.ShapeIndex.open_or_create(folder) == es.ShapeIndex.open_or_create(folder)
        True
        """
        store.create_if_missing(Path(folder))
        return cls.open(folder)

    def __len__(self) -> int:
        with store.reading(self.folder) as catalog:
            return len(catalog.shapes)

    def records(self) -> list[Record]:
        """List all shapes by name."""
        with store.reading(self.folder) as catalog:
            recipes = dict(catalog.recipes())
        numbers: dict[int, set[int]] = {shape.id: set() for shape in catalog.shapes}
        for kept in catalog.descriptors:
            numbers[kept.shape].add(kept.recipe)
        return [
            Record(*shape[1:], tuple(recipes[number] for number in sorted(numbers[shape.id])))
            for shape in sorted(catalog.shapes, key=lambda shape: shape.name)
        ]

    def recipes(self) -> list[AnyRecipe]:
        """List the recipes by which shapes are described or are to be, in the order in which they came."""
        with store.reading(self.folder) as catalog:
            return [recipe for _, recipe in catalog.recipes()]

    def keep_recipe(self, recipe: AnyRecipe) -> None:
        """Keep a recipe before any shape is described by it, one whose words were long to learn, say.

        Raises
        ------
        StoreError
            If another process is writing.
        """
        require_type(recipe, AnyRecipe, "recipe")
        with store.writing(self.folder) as catalog:
            keep_recipe(catalog, recipe)

    def add(
        self,
        name: str,
        descriptors: Sequence[Descriptor],
        *,
        label: str | None = None,
        source: str | None = None,
        digest: str | None = None,
        replace: bool = False,
    ) -> None:
        """Add a shape with one or more descriptors.

        Descriptors of one recipe are views of the shape, the whole first, say, and then what is seen of it from some
        sides: the view with the lowest score counts, for patches beside the first by half. A name that is there
        with the same digest gains the recipes that it lacks, and keeps what it has of the others. With `replace`, a
        shape that is there with another digest gives way in the same step.

        Raises
        ------
        InvalidParameterError
            If there is no descriptor, a number is not finite, or rows are not as long as others of the recipe.
        StoreError
            If the name is there with another digest and is not to be replaced, or another process is writing.
        """
        require_each(descriptors, Descriptor, "descriptors")
        _require_text(name, label, source, digest)
        rows = _packed(name, descriptors)
        with store.writing(self.folder) as before:
            catalog, shape = _with_shape(
                before, ShapeRow(0, name, label, source, digest), replace=replace
            )
            for recipe in dict.fromkeys(descriptor.recipe for descriptor in descriptors):
                views = [
                    pair for pair in zip(descriptors, rows, strict=True) if pair[0].recipe == recipe
                ]
                self._put(catalog, shape, keep_recipe(catalog, recipe), views)

    def _put(
        self,
        catalog: Catalog,
        shape: int,
        recipe: int,
        views: Sequence[tuple[Descriptor, np.ndarray]],
    ) -> None:
        others = [kept for kept in catalog.descriptors if kept.recipe == recipe]
        n_columns = others[0].n_columns if others else views[0][1].shape[1]
        for descriptor, rows in views:
            _require_columns(descriptor, rows, n_columns)
        if any(kept.shape == shape for kept in others):
            return
        for view, (descriptor, rows) in enumerate(views):
            details = kind_of(descriptor.recipe).details(descriptor)
            offset = store.append_rows(self.folder, catalog.database, recipe, rows)
            entry = (
                shape,
                recipe,
                view,
                offset,
                *rows.shape,
                crc32(rows.tobytes()),
                crc32(details),
                details,
            )
            catalog.database.execute(
                "INSERT INTO descriptor VALUES (NULL, ?, ?, ?, ?, ?, ?, ?, ?, ?)", entry
            )

    def remove(self, name: str) -> None:
        """Remove a shape. The bytes of its rows stay in the file, so that a reader of the old state still finds them.

        Raises
        ------
        StoreError
            If there is no shape of that name, or another process is writing.
        """
        with store.writing(self.folder) as catalog:
            shape = catalog.shape(name)
            if shape is None:
                raise StoreError(f"A shape must be in the index to be removed; {name!r} is not.")
            catalog.without(shape)

    def query(self, descriptor: Descriptor, *, n_matches: SupportsIndex = 5) -> list[Match]:
        """Find the shapes whose descriptors of the same recipe have the lowest score, each shape once.

        Numbers are kept in single precision, and those of the query are rounded alike, so that a shape in the index
        finds itself with score 0. Equal scores are sorted by name.

        Raises
        ------
        InvalidParameterError
            If `n_matches` is not positive, or the descriptor could not stand in the index.
        StoreError
            If no shape has a descriptor of that recipe, or a file is damaged.
        """
        require_type(descriptor, Descriptor, "descriptor")
        wanted = whole_number(n_matches, "n_matches", 1, 2**31)
        kind, (ours,) = kind_of(descriptor.recipe), _packed("the query", [descriptor])
        asked = kind.restored(ours, kind.details(descriptor), descriptor.recipe)
        with store.reading(self.folder) as catalog, one_blas_thread():
            held = held_by(self.folder, catalog, descriptor.recipe)
            _require_columns(descriptor, ours, held.entries[0].kept.n_columns)
            scores = kind.verified(asked, held.restored, kind.scored(asked, held.rows))
            order = np.argsort(scores, kind="stable")
            firsts = np.unique(
                [held.entries[place].shape.name for place in order], return_index=True
            )[1]
            best = order[np.sort(firsts)[:wanted]].tolist()
            return [_match(asked, held, place, float(scores[place])) for place in best]

    def descriptor(self, name: str, recipe: AnyRecipe) -> Descriptor:
        """Return the first descriptor of a shape by a recipe, as it is kept, to ask for more of its like.

        Raises
        ------
        StoreError
            If the shape is not there or has no descriptor of that recipe, or a file is damaged.
        """
        require_type(recipe, AnyRecipe, "recipe")
        with store.reading(self.folder) as catalog:
            held = held_by(self.folder, catalog, recipe)
            for place, entry in enumerate(held.entries):
                if entry.shape.name == name:
                    return held.restored(place)
        raise StoreError(
            f"A shape must be described by the recipe asked for; {name!r} is not described by {recipe}."
        )


def _match(asked: Descriptor, held: Held, place: int, score: float) -> Match:
    (shape, kept), other = held.entries[place], held.restored(place)
    pairs = kind_of(held.recipe).paired(asked, other)
    return Match(shape.name, shape.label, shape.source, score, pairs, other.vertices, kept.view)


def _require_text(name: str, *others: str | None) -> None:
    for text in (name, *others):
        if text is not None and (
            not isinstance(text, str) or text != text.encode(errors="replace").decode()
        ):
            raise InvalidParameterError(
                f"What an index keeps beside numbers must be Unicode text; {text!r} is not."
            )


def _packed(name: str, descriptors: Sequence[Descriptor]) -> list[np.ndarray]:
    """Return the rows of descriptors as they are kept, refusing what cannot be."""
    if not descriptors:
        raise InvalidParameterError(
            f"A shape needs a descriptor to be found by; {name!r} has none."
        )
    return [kind_of(descriptor.recipe).rows(descriptor, name) for descriptor in descriptors]


def _require_columns(descriptor: Descriptor, rows: np.ndarray, n_columns: int) -> None:
    if rows.shape[1] != n_columns:
        raise InvalidParameterError(
            f"Features of one recipe must have equally many numbers; of {descriptor.recipe.name!r} they have "
            f"{n_columns}, and here {rows.shape[1]}."
        )


def _with_shape(catalog: Catalog, new: ShapeRow, *, replace: bool) -> tuple[Catalog, int]:
    """Return a catalog with room for a shape's descriptors, and the number of the shape."""
    old = catalog.shape(new.name)
    if old is not None and old.digest is not None and old.digest == new.digest:
        return catalog, old.id
    if old is not None and not replace:
        raise StoreError(
            f"A name stands for one shape; {new.name!r} is in the index with digest {old.digest}, not {new.digest}. "
            "Remove it first, or add it with replace=True."
        )
    if old is not None:
        catalog = catalog.without(old)
    row = catalog.database.execute("INSERT INTO shape VALUES (NULL, ?, ?, ?, ?)", new[1:])
    return catalog, int(row.lastrowid or 0)
