"""A reader of an index: one state of it in memory, which any number of threads may ask."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import RLock
from types import TracebackType
from typing import Any, SupportsIndex

import numpy as np
from jaxtyping import Bool

from eigenshape._arguments import describe_value, require_type
from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError, StoreError
from eigenshape._text import html_repr
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, kind_of
from eigenshape.retrieval.patches.descriptor import PatchDescriptor, PatchRecipe
from eigenshape.retrieval.search.candidates import (
    FEWEST_TO_SCAN,
    Candidates,
    Supplier,
    choose_candidates,
)
from eigenshape.retrieval.search.coarse import CoarseRows, coarse_rows
from eigenshape.retrieval.search.engines import Engine, supply_from
from eigenshape.retrieval.store.damage import warn_of_damage
from eigenshape.retrieval.store.filters import choose_shapes, require_attributes
from eigenshape.retrieval.store.kept_tables import open_state
from eigenshape.retrieval.store.records import Matches
from eigenshape.retrieval.store.searching import search_candidates
from eigenshape.retrieval.store.snapshot import IndexState, Snapshot, read_state

# Return an engine that holds the vectors of all shapes, as `FaissEngine` does.
EngineMaker = Callable[[CoarseRows], Engine]


class IndexReader:
    """One state of an index, kept open for many queries.

    Made by `ShapeIndex.reader`. Any number of threads may ask it at the same time. What other
    processes add or remove is seen after `refresh`, and a query sees one state from begin to end.
    A pickle holds the folder and the engine alone: another process opens the index as it is then.

    Examples
    --------
    >>> import eigenshape as es
    >>> index = es.ShapeIndex.create(None)
    >>> fish = es.describe(es.make_creature("fish", n_vertices=500), es.retrieval.SCALE_FREE)
    >>> index.add_descriptors("fish", [fish])
    >>> with index.reader() as reader:
    ...     len(reader), reader.query(fish)[0].name
    (1, 'fish')
    """

    _repr_html_ = html_repr

    def __init__(self, folder: Path, engine: EngineMaker | None = None) -> None:
        if engine is not None:
            require_maker(engine)
        self._lock = RLock()
        self._engine = engine
        self._scans: dict[PatchRecipe, _Scan] = {}
        self._state: IndexState | None = open_state(folder)
        warn_of_damage(str(folder), self._state.damages)

    def __reduce__(self) -> tuple[type["IndexReader"], tuple[Path, EngineMaker | None]]:
        return IndexReader, (self.state.folder, self._engine)

    def __enter__(self) -> "IndexReader":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __len__(self) -> int:
        return len(self.state.shapes.ids)

    def __repr__(self) -> str:
        if self._state is None:
            return "IndexReader(closed)"
        return f"IndexReader({str(self._state.folder)!r}, {len(self)} shapes)"

    @property
    def state(self) -> IndexState:
        """Return the state that queries see now."""
        state = self._state
        if state is None:
            raise StoreError("A reader must be open to be asked; it was closed. Open another one.")
        return state

    def close(self) -> None:
        """Let go of the files; they stay mapped as long as a query runs."""
        self._state = None
        self._scans = {}

    def refresh(self) -> bool:
        """See what was added to the index, or removed from it, since the reader was opened.

        Returns
        -------
        bool
            Whether anything has changed. If shapes were added alone, only they are read.

        Raises
        ------
        StoreError
            If the index cannot be read any more.
        """
        with self._lock:
            before = self.state
            now = read_state(before.folder, before)
            self._state = now
        if now is before:
            return False
        warn_of_damage(
            str(now.folder), [each for each in now.damages if each not in before.damages]
        )
        return True

    def snapshot(self, recipe: AnyRecipe) -> Snapshot:
        """Return all descriptors by a recipe, as arrays.

        Parameters
        ----------
        recipe : HeatRecipe or PatchRecipe

        Returns
        -------
        Snapshot

        Raises
        ------
        StoreError
            If there are none.
        """
        require_type(recipe, AnyRecipe, "recipe")
        return self.state.snapshot(recipe)

    def default_recipe(self) -> AnyRecipe:
        """Return the recipe by which a mesh is described, as of `ShapeIndex.default_recipe`."""
        return choose_recipe(list(self.state.recipes.values()))

    def query(
        self,
        shape: MeshLike | Descriptor,
        *,
        n_matches: SupportsIndex = 5,
        where: Mapping[str, Any] | None = None,
        without: str | None = None,
        exact: bool = False,
    ) -> Matches:
        """Find the shapes that are most similar, as `ShapeIndex.query` does.

        Parameters
        ----------
        shape : MeshLike, HeatDescriptor or PatchDescriptor
        n_matches : int
        where : mapping, optional
        without : str, optional
        exact : bool

        Returns
        -------
        Matches

        Raises
        ------
        InvalidShapeError, InvalidParameterError, StoreError
            As `ShapeIndex.query`.
        """
        wanted = whole_number(n_matches, "n_matches", 1, 2**31)
        state = self.state
        # Before a mesh is described, which takes seconds
        chosen = choose_shapes(state.shapes, where)
        require_attributes(state.shapes, where)
        if without is not None:
            if without not in state.names:
                raise InvalidParameterError(
                    f"without must be the name of a shape of the index; {without!r} is none. "
                    "`records` lists them."
                )
            chosen[state.names[without]] = False
        if isinstance(shape, Descriptor):
            descriptor = shape
        else:
            mesh, recipe = as_mesh(shape, "shape"), choose_recipe(list(state.recipes.values()))
            descriptor = kind_of(recipe).describe_query(mesh, recipe)
        return self._search(state, descriptor, wanted, chosen, exact=exact)

    def _search(
        self,
        state: IndexState,
        descriptor: Descriptor,
        n_matches: int,
        chosen: Bool[np.ndarray, " n"],
        *,
        exact: bool = False,
        is_scaled: bool = True,
    ) -> Matches:
        """Search one state for a descriptor, among the chosen ones of its n shapes.

        Scores may be scaled by how isolated each shape is.
        """
        snapshot = state.snapshot(descriptor.recipe)
        allowed = snapshot.mask(chosen)
        candidates = self._candidates(snapshot, descriptor, allowed, n_matches, exact=exact)
        matches, damages = search_candidates(
            snapshot, descriptor, candidates, n_matches, is_scaled=is_scaled
        )
        warn_of_damage(str(state.folder), damages)
        return matches

    def _candidates(
        self,
        snapshot: Snapshot,
        descriptor: Descriptor,
        allowed: Bool[np.ndarray, " k"],
        n_matches: int,
        *,
        exact: bool,
    ) -> Candidates:
        if not isinstance(descriptor, PatchDescriptor):  # of which all are compared
            places = np.flatnonzero(allowed)
            return Candidates(places, "exact", len(places))
        scan = partial(self._scan, snapshot, descriptor.recipe)
        supplier = None
        if self._engine is not None and snapshot.n_shapes > FEWEST_TO_SCAN and not exact:
            supplier = scan().supplier
        return choose_candidates(
            descriptor,
            lambda: scan().coarse,
            allowed,
            n_matches=n_matches,
            exact=exact,
            supplier=supplier,
        )

    def _scan(self, snapshot: Snapshot, recipe: PatchRecipe) -> "_Scan":
        """Return the short rows of a snapshot; they are made or read once a state."""
        with self._lock:
            kept = self._scans.get(recipe)
            if kept is not None and kept.state is snapshot.state:
                return kept
            if kept is None:
                coarse, engine = coarse_rows(snapshot, recipe), None
            else:
                coarse, engine = coarse_rows(snapshot, recipe, kept.coarse), kept.engine
            # An engine holds the rows of the file, which stay until many shapes have changed.
            is_new = kept is None or kept.coarse.numbers is not coarse.numbers
            if self._engine is not None and is_new:
                engine = self._engine(coarse)
                require_type(engine, Engine, "the engine that was made")
            supplier = None if engine is None else supply_from(engine, coarse)
            found = self._scans[recipe] = _Scan(snapshot.state, coarse, engine, supplier)
            return found


@dataclass(frozen=True, eq=False)
class _Scan:
    """What a reader keeps to choose candidates from one state of an index."""

    state: IndexState
    coarse: CoarseRows
    engine: Engine | None
    supplier: Supplier | None


def choose_recipe(recipes: list[AnyRecipe]) -> AnyRecipe:
    """Return the first recipe of patches, else the first recipe, else that of an empty index."""
    patches = [recipe for recipe in recipes if isinstance(recipe, PatchRecipe)]
    return next(iter([*patches, *recipes])) if recipes else PatchRecipe()


def require_maker(engine: object) -> None:
    """Raise an error unless an argument can be called, and is no class of something else.

    Raises
    ------
    InvalidParameterError
    """
    if not callable(engine) or (isinstance(engine, type) and not issubclass(engine, Engine)):
        raise InvalidParameterError(
            "engine must be a function that takes CoarseRows and returns an engine; it is "
            f"{describe_value(engine)}. Pass es.retrieval.FaissEngine, or lambda coarse: engine."
        )
