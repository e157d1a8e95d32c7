"""The index of a service: what it answers is read here, and nowhere else."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from jaxtyping import Int

import eigenshape as es
from eigenshape.retrieval.store.filters import choose_shapes
from eigenshape.retrieval.store.state import tags_and_attributes

REFRESH_SECONDS = 1.0  # between looks for shapes that other processes have added or removed


@dataclass(frozen=True)
class Shape:
    """What an answer may say of a shape.

    Attributes
    ----------
    name, label, source : str
    tags : tuple of str
    attributes : dict of str to float or str
    has_thumbnail : bool
        Whether the index holds its picture.
    """

    name: str
    label: str | None
    source: str | None
    tags: tuple[str, ...] = ()
    attributes: Mapping[str, float | str] = field(default_factory=dict)
    has_thumbnail: bool = False


@dataclass(frozen=True, eq=False)
class Found:
    """A shape of the index that is like the query.

    Attributes
    ----------
    shape : Shape
    score : float
        Near 0 for the same shape; smaller is more alike.
    chance : float, optional
        Share of unrelated shapes that would score as well, where it was measured.
    pairs : (p, 2) int
        Vertices that correspond: of the query, and of this shape. Surest pairs first.
    """

    shape: Shape
    score: float
    chance: float | None
    pairs: Int[np.ndarray, "p 2"]


@dataclass(frozen=True)
class Answer:
    """What a query found.

    Attributes
    ----------
    found : tuple of Found
        Best first.
    method : str
        How shapes were searched for: "exact", "staged" or "candidates".
    n_compared : int
        Shapes that were compared exactly.
    nothing_alike : bool
        Whether the best score is no better than those of unrelated shapes.
    """

    found: tuple[Found, ...] = ()
    method: str = "exact"
    n_compared: int = 0
    nothing_alike: bool = False


class ShelfReader:
    """An index, read by many threads at once.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    StoreError
        If the folder is no index, or cannot be read.
    """

    def __init__(self, folder: str | Path) -> None:
        self._index = es.ShapeIndex.open(folder)
        self._reader = self._index.reader()
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._due = monotonic() + REFRESH_SECONDS

    def __len__(self) -> int:
        return len(self._reader)

    @property
    def recipe(self) -> Any:
        """Return the recipe by which queries are described."""
        return self._reader.default_recipe()

    def refresh(self, *, now: bool = False) -> None:
        """See what other processes have added or removed; the index is looked at once a second."""
        with self._lock:
            if now or monotonic() >= self._due:
                self._reader.refresh()
                self._due = monotonic() + REFRESH_SECONDS

    def add(self, shape: es.retrieval.DescribedShape, *, replace: bool) -> None:
        """Add a shape, or replace one; StoreError says what does not allow it."""
        with self._writing:  # an index has one writer, and waits for others for seconds alone
            self._index.add_many([shape], replace=replace)
        self.refresh(now=True)

    def remove(self, name: str) -> None:
        """Remove a shape; StoreError says what does not allow it."""
        with self._writing:
            self._index.remove(name)
        self.refresh(now=True)

    def require_attributes(self, where: Mapping[str, Any] | None) -> None:
        """Refuse conditions about an attribute that no shape has."""
        choose_shapes(self._reader.state, where)

    def query(
        self,
        descriptor: Any,
        n_matches: int,
        *,
        where: Mapping[str, Any] | None = None,
        exact: bool = False,
    ) -> Answer:
        """Return the shapes that are most alike.

        Parameters
        ----------
        descriptor : HeatDescriptor or PatchDescriptor
        n_matches : int
        where : mapping, optional
            Conditions that the shapes must meet.
        exact : bool
            Whether every shape must be compared.
        """
        if not len(self):
            return Answer()
        matches = self._reader.query(descriptor, n_matches=n_matches, where=where, exact=exact)
        found = tuple(self._found(descriptor, match) for match in matches)
        return Answer(found, matches.method, matches.n_compared, matches.nothing_alike)

    def _found(self, descriptor: Any, match: es.retrieval.Match) -> Found:
        ours, theirs = match.correspondences.T
        pairs = np.column_stack([descriptor.vertices[ours], match.vertices[theirs]])
        shape = self.shape(match.name)
        if shape is None:  # removed since
            shape = Shape(match.name, match.label, match.source)
        return Found(shape, match.score, match.chance, pairs)

    def shapes(
        self, offset: int, limit: int, where: Mapping[str, Any] | None = None
    ) -> tuple[int, Sequence[Shape]]:
        """Return how many shapes meet some conditions, and a few of them, sorted by name."""
        state = self._reader.state
        chosen = choose_shapes(state, where)
        names = state.names
        if chosen is not None:
            names = sorted(facts.name for facts in state.facts(chosen).values())
        found = map(self.shape, names[offset : offset + limit])
        return len(names), [shape for shape in found if shape is not None]

    def shape(self, name: str) -> Shape | None:
        """Return a shape by its name."""
        state = self._reader.state
        facts = state.find(name)
        if facts is None:
            return None
        told = (facts.name, facts.label, facts.source, *tags_and_attributes(facts))
        return Shape(*told, bool(facts.n_pictures))

    def thumbnail(self, name: str) -> bytes | None:
        """Return the picture that the index holds of a shape, PNG or WebP; None if it holds none."""
        state = self._reader.state
        facts = state.find(name)
        return None if facts is None else state.picture(facts)
