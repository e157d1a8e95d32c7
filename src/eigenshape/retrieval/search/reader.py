"""A reader of an index: one state for many queries, which any number of threads may ask."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import describe_value, require_type
from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import html_repr
from certeig.kit.typing import Integer
from eigenshape._errors import StoreError
from eigenshape._sealed import is_log_long
from eigenshape.geometry.conversion import MeshLike
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, describe_query
from eigenshape.retrieval.patches.descriptor import PatchDescriptor, PatchRecipe
from eigenshape.retrieval.patches.distance import USUAL_ISOLATION
from eigenshape.retrieval.search.candidates import (
    FEWEST_TO_SCAN,
    Candidates,
    Supplier,
    choose_candidates,
)
from eigenshape.retrieval.search.coarse import CoarseRows, coarse_rows, stored_isolations
from eigenshape.retrieval.search.engines import Engine, supply_from
from eigenshape.retrieval.search.matches import Matches
from eigenshape.retrieval.search.options import QueryOptions
from eigenshape.retrieval.search.scoring import search_candidates
from eigenshape.retrieval.store.damage import warn_of_damage
from eigenshape.retrieval.store.database import DATABASE
from eigenshape.retrieval.store.state import DamagedEntryError, IndexState, Snapshot, read_state

# Return an engine that holds the vectors of all shapes, as `FaissEngine` does.
EngineMaker = Callable[[CoarseRows], Engine]


class IndexReader:
    """One state of an index, kept open for many queries.

    Made by `ShapeIndex.reader`. Any number of threads may ask it at the same time. What other
    processes add or remove is seen after `refresh`, and a query sees one state from begin to end.
    A pickle holds the folder and the engine alone: another process opens the index as it is then.

    Parameters
    ----------
    folder : Path
    engine : callable, optional
        What finds candidates among very many shapes, such as `FaissEngine`.

    Examples
    --------
    >>> import eigenshape as es
    >>> index = es.ShapeIndex.create(None)
    >>> fish = es.describe(es.make_creature("fish", n_vertices=500), es.retrieval.SCALE_FREE)
    >>> index.add_many([es.retrieval.DescribedShape("fish", [fish])])
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
        self._scans: dict[AnyRecipe, _Scan] = {}
        self._state: IndexState | None = read_state(folder)
        self._state.descriptors  # noqa: B018 - read now, so that damage is named when it is opened
        warn_of_damage(str(folder), self._state.damages)

    def __reduce__(self) -> tuple[type["IndexReader"], tuple[Path, EngineMaker | None]]:
        return IndexReader, (self.state.folder, self._engine)

    def __enter__(self) -> "IndexReader":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        return len(self.state)

    def __repr__(self) -> str:
        if self._state is None:
            return "IndexReader(closed)"
        return f"IndexReader({str(self._state.folder)!r}, {len(self)} shapes)"

    @property
    def state(self) -> IndexState:
        """Return the state that queries see now."""
        state = self._state
        if state is None:
            raise StoreError(
                "A reader must be open to be queried; it was closed. Open another one."
            )
        return state

    def close(self) -> None:
        """Let go of the state; its transaction ends when the queries that use it have ended."""
        self._state = None
        self._scans = {}

    def refresh(self) -> bool:
        """See what was added to the index, or removed from it, since the reader was opened.

        SQLite keeps a log of what is changed as long as a reader holds an older state, so refresh a
        reader from time to time while others write.

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
            folder, damages, seals = before.folder, before.damages, before.seals
            now = self._state = read_state(folder, before)
            now.descriptors  # noqa: B018 - read now, so that damage is named here
            if is_log_long(folder / DATABASE):
                # Whoever holds the latest state lets the log move into the file, and whoever reads
                # that state from the file lets the next writer begin the log anew.
                del before
                now = self._state = read_state(folder, now)
        warn_of_damage(str(folder), [each for each in now.damages if each not in damages])
        return now.seals != seals

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
        return self._scan(self.state, recipe).snapshot

    def default_recipe(self) -> AnyRecipe:
        """Return the recipe by which a mesh is described, as of `ShapeIndex.default_recipe`."""
        return choose_recipe(list(self.state.recipes.values()))

    def query(
        self,
        shape: MeshLike | Descriptor,
        *,
        n_matches: Integer = 5,
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
        return self.ask(shape, QueryOptions(n_matches, where, without, exact))

    def ask(
        self, shape: MeshLike | Descriptor, options: QueryOptions, state: IndexState | None = None
    ) -> Matches:
        """Find the shapes that are most similar, as `query` does.

        Parameters
        ----------
        shape : MeshLike or descriptor
        options : QueryOptions
        state : IndexState, optional
            By default the latest.
        """
        require_type(options, QueryOptions, "options")
        if state is None:
            state = self.state
        choice = options.choose(state)  # before a mesh is described, which takes seconds
        recipe = choose_recipe(list(state.recipes.values()))
        descriptor = describe_query(shape, recipe)
        while True:  # again without what turns out to be damaged
            try:
                scan = self._scan(state, descriptor.recipe)
                snapshot = scan.snapshot
                allowed = choice.allowed(snapshot.shape_of)
                isolations = np.full(snapshot.n_shapes, USUAL_ISOLATION)
                if options.is_scaled:
                    isolations = scan.isolations()
                places = np.flatnonzero(allowed)
                candidates = Candidates(places, "exact", len(places))
                if isinstance(descriptor, PatchDescriptor):  # by heat all are compared
                    supplier = None
                    is_large = snapshot.n_shapes > FEWEST_TO_SCAN
                    if self._engine is not None and is_large and not options.exact:
                        scan.coarse(descriptor.recipe)  # which makes the engine at the first query
                        supplier = scan.supplier
                    candidates = choose_candidates(
                        descriptor,
                        partial(scan.coarse, descriptor.recipe),
                        allowed,
                        isolations,
                        options,
                        supplier,
                    )
                return search_candidates(
                    snapshot, descriptor, candidates, int(options.n_matches), isolations
                )
            except DamagedEntryError as err:  # the rest is served
                warn_of_damage(str(state.folder), err.damages)
                state.leave_out(err.ids)
                with self._lock:
                    self._scans.pop(descriptor.recipe, None)

    def _scan(self, state: IndexState, recipe: AnyRecipe) -> "_Scan":
        """Return what search keeps of a state and a recipe."""
        with self._lock:
            kept = self._scans.get(recipe)
            if kept is None or kept.snapshot.state is not state:
                kept = _Scan(state.snapshot(recipe), self._engine, kept)
                self._scans[recipe] = kept
            return kept


class _Scan:
    """What a reader keeps to search one snapshot: each is made or read when it is needed first.

    Parameters
    ----------
    snapshot : Snapshot
    maker : callable, optional
        Make an engine.
    before : _Scan, optional
        Of an earlier state.
    """

    def __init__(
        self, snapshot: Snapshot, maker: EngineMaker | None, before: "_Scan | None"
    ) -> None:
        self.snapshot, self._maker = snapshot, maker
        self.engine: Engine | None = None
        self.supplier: Supplier | None = None
        self._before: CoarseRows | None = None
        self._coarse: CoarseRows | None = None
        self._isolations: Float[np.ndarray, " n"] | None = None
        self._lock = RLock()
        if before is not None:
            self.engine = before.engine
            self._before = before._before if before._coarse is None else before._coarse
            if np.array_equal(before.snapshot.columns, snapshot.columns):  # nothing has changed
                self.supplier, self._coarse = before.supplier, before._coarse
                self._isolations = before._isolations

    def coarse(self, recipe: PatchRecipe) -> CoarseRows:
        """Return the short rows of all shapes, and make an engine of them if one is wanted."""
        with self._lock:
            if self._coarse is None:
                made = coarse_rows(self.snapshot, recipe, self._before)
                # An engine holds the rows of the file, which stay until many shapes have changed.
                is_new = self._before is None or self._before.numbers is not made.numbers
                if self._maker is not None and is_new:
                    self.engine = self._maker(made)
                    require_type(self.engine, Engine, "the engine that was made")
                if self.engine is not None:
                    self.supplier = supply_from(self.engine, made)
                self._coarse = made
            return self._coarse

    def isolations(self) -> Float[np.ndarray, " n"]:
        """Return how isolated each shape is; 0 for heat, whose scores are not scaled."""
        with self._lock:
            if self._isolations is None:
                recipe, columns = self.snapshot.recipe, self.snapshot.columns
                found = np.zeros(len(columns))
                if isinstance(recipe, PatchRecipe):
                    found = stored_isolations(self.snapshot, recipe, columns["rows_checksum"])
                found.flags.writeable = False
                self._isolations = found
            return self._isolations


def choose_recipe(recipes: list[AnyRecipe]) -> AnyRecipe:
    """Return the first recipe of patches, else the first recipe, else that of an empty index."""
    patches = [recipe for recipe in recipes if isinstance(recipe, PatchRecipe)]
    return next(iter([*patches, *recipes])) if recipes else PatchRecipe()


def require_maker(engine: object) -> None:
    """Raise an error unless an argument can be called, and is no class of something else."""
    if not callable(engine) or (isinstance(engine, type) and not issubclass(engine, Engine)):
        raise InvalidParameterError(
            "engine must be a function that takes CoarseRows and returns an engine; it is "
            f"{describe_value(engine)}. Pass es.retrieval.FaissEngine, or lambda coarse: engine."
        )
