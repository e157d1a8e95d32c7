"""The index of a service: what it answers is read here, and nowhere else."""

import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from jaxtyping import Int

import eigenshape as es
from eigenshape.retrieval.search.options import QueryOptions
from eigenshape.retrieval.store.facts import ShapeRow
from eigenshape.retrieval.store.filters import choose_shapes
from eigenshape.retrieval.store.state import IndexState, MissingShapeError

REFRESH_SECONDS = 1.0  # between looks for shapes that other processes have added or removed


@dataclass(frozen=True)
class Shape:
    """What an answer may say of a shape.

    Attributes
    ----------
    id : int
        Its number, which no other shape of the index has, also none that replaces it.
    name, label, source : str
    tags : tuple of str
    attributes : dict of str to float or str
    has_thumbnail : bool
        Whether the index holds its picture.
    """

    id: int
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
    mirrored : bool, optional
        Whether it is rather like the mirror image of the query, where that can be told.
    pairs : (p, 2) int
        Vertices that correspond: of the query, and of this shape. Surest pairs first.
    """

    shape: Shape
    score: float
    chance: float | None
    mirrored: bool | None
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

    def refresh_until(self, ended: threading.Event) -> None:
        """See each second what others have changed: the log grows while a state is held."""
        while not ended.wait(REFRESH_SECONDS):
            with suppress(es.EigenshapeError, OSError):  # which the next request reports
                self.refresh()

    def add(self, shape: es.retrieval.DescribedShape, *, replace: bool) -> Shape:
        """Add a shape, or replace one; StoreError says what does not allow it."""
        with self._writing:  # an index has one writer, and waits for others for seconds alone
            self._index.add_many([shape], replace=replace)
            self.refresh(now=True)
            return self.require(shape.name)

    def remove(self, name: str) -> Shape:
        """Remove a shape and return what was known; StoreError says what does not allow it."""
        with self._writing:
            self.refresh(now=True)
            shape = self.require(name)
            self._index.remove(name)
            self.refresh(now=True)
        return shape

    def compact(self) -> int:
        """Give the space of removed shapes back, and return its bytes."""
        with self._writing:
            return self._index.compact()

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
        state = self._reader.state  # of which all is that is said; it may be an older one soon
        if not len(state):
            return Answer()
        options = QueryOptions(n_matches, where, exact=exact)
        matches = self._reader.ask(descriptor, options, state)
        found = []
        for match in matches:
            ours, theirs = match.correspondences.T
            pairs = np.column_stack([descriptor.vertices[ours], match.vertices[theirs]])
            shape = _shape_of(state.require(match.name, "be found"))
            found.append(Found(shape, match.score, match.chance, match.mirrored, pairs))
        return Answer(tuple(found), matches.method, matches.n_compared, matches.nothing_alike)

    def shapes(
        self, offset: int, limit: int, where: Mapping[str, Any] | None = None
    ) -> tuple[int, Sequence[Shape]]:
        """Return how many shapes meet some conditions, and a few of them, sorted by name."""
        state = self._reader.state
        chosen = choose_shapes(state, where)
        names = state.names
        if chosen is not None:
            names = sorted(facts.name for facts in state.facts(chosen).values())
        found = (state.require(name, "be listed") for name in names[offset : offset + limit])
        return len(names), [_shape_of(facts) for facts in found]

    def __contains__(self, name: str) -> bool:
        return self._reader.state.find(name) is not None

    def require(self, name: str, number: int | None = None) -> Shape:
        """Return a shape by its name; raise MissingShapeError if there is none with that number."""
        return _shape_of(_require(self._reader.state, name, number))

    def thumbnail(self, name: str, number: int) -> bytes | None:
        """Return the picture that the index holds of a shape, PNG or WebP; None if it holds none."""
        state = self._reader.state
        return state.picture(_require(state, name, number))


def _require(state: IndexState, name: str, number: int | None) -> ShapeRow:
    facts = state.require(name, "be shown")
    if number not in (None, facts.id):  # one that has replaced it
        raise MissingShapeError(name, "be shown")
    return facts


def _shape_of(facts: ShapeRow) -> Shape:
    known = (facts.id, facts.name, facts.label, facts.source, *facts.tags_and_attributes())
    return Shape(*known, bool(facts.n_pictures))
