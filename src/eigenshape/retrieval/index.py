"""A collection of described shapes in a folder, searched for those that are most alike."""

import tempfile
import weakref
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from shutil import rmtree
from time import time
from typing import Any

from certeig.kit.arguments import require_each, require_type
from certeig.kit.files import as_path
from certeig.kit.text import html_repr, printable
from certeig.kit.typing import Integer
from eigenshape._errors import StoreError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, describe_to_store
from eigenshape.retrieval.search.matches import Matches
from eigenshape.retrieval.search.reader import EngineMaker, IndexReader, choose_recipe
from eigenshape.retrieval.store.damage import warn_of_damage
from eigenshape.retrieval.store.database import create, writing
from eigenshape.retrieval.store.facts import ShapeFacts
from eigenshape.retrieval.store.filters import choose_shapes
from eigenshape.retrieval.store.state import IndexState, read_state
from eigenshape.retrieval.store.upkeep import (
    IndexReport,
    compact_index,
    export_index,
    merge_indexes,
    verify_index,
)
from eigenshape.retrieval.store.writing import (
    DescribedShape,
    Record,
    Writer,
    described,
)
from eigenshape.retrieval.thumbnails import draw_thumbnail

IN_MEMORY = Path("/dev/shm")  # where Linux keeps files in memory

STAGE = "stage.txt"  # in the folder of an index, while it is prepared for its first shapes
MOST_LISTED = 10  # shapes that a notebook shows of an index


@dataclass(frozen=True)
class ShapeIndex:
    """A folder of described shapes, in which similar ones are found.

    Call `ShapeIndex.create`, `ShapeIndex.open` or `ShapeIndex.open_or_create`. Any number of
    processes may read an index at the same time, while one writes. Every call reads or writes the
    folder, and nothing stays open between calls. A process that is killed while it writes leaves
    the state before or after the call. Everything has a checksum: what is damaged is named by a
    `StoreWarning`, and the rest is served.

    Attributes
    ----------
    folder : Path

    See Also
    --------
    build_index : Describe many files in worker processes.
    describe : Describe a mesh without an index.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> import eigenshape as es
    >>> index = es.ShapeIndex.create(mkdtemp())
    >>> for kind in ("fish", "bird"):
    ...     index.add(kind, es.make_creature(kind, n_vertices=500), label="animal", n_views=1)
    >>> match, other = index.query(es.make_creature("fish", 1, n_vertices=500))
    >>> match.name, other.name
    ('fish', 'bird')
    >>> match.score < other.score
    True
    """

    folder: Path

    _repr_html_ = html_repr

    @classmethod
    def create(cls, folder: str | Path | None) -> "ShapeIndex":
        """Make an empty index.

        Parameters
        ----------
        folder : str or Path, or None
            An empty folder, or one that does not exist. With None, the index is temporary: it is in
            memory where the system keeps files in memory (Linux), else in a temporary folder, and
            is deleted with the last reference to what this call returns.

        Returns
        -------
        ShapeIndex

        Raises
        ------
        StoreError
            If the folder holds anything.
        """
        if folder is None:
            place = IN_MEMORY if IN_MEMORY.is_dir() else None
            index = cls(Path(tempfile.mkdtemp(prefix="eigenshape-", dir=place)))
            weakref.finalize(index, rmtree, index.folder, ignore_errors=True)
        else:
            index = cls(as_path(folder, "folder"))
        create(index.folder)
        return index

    @classmethod
    def open(cls, folder: str | Path) -> "ShapeIndex":
        """Open an existing index.

        Parameters
        ----------
        folder : str or Path

        Returns
        -------
        ShapeIndex

        Raises
        ------
        StoreError
            If the folder is no index, its format is another one, or its database cannot be read.
        """
        index = cls(as_path(folder, "folder"))
        len(index)
        return index

    @classmethod
    def open_or_create(cls, folder: str | Path) -> "ShapeIndex":
        """Open the index in a folder, or make an empty one if there is none.

        Several processes may call this at once: one of them makes the index.

        Parameters
        ----------
        folder : str or Path

        Returns
        -------
        ShapeIndex

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
        create(Path(folder), exist_ok=True)
        return cls.open(folder)

    @property
    def stage(self) -> str | None:
        """What is being done to an index before it holds shapes, and how old that note is; otherwise None."""
        note = self.folder / STAGE
        try:
            age = max(time() - note.stat().st_mtime, 0)
            return f"{note.read_text()}, {age:.0f} s ago"
        except OSError:
            return None

    def __len__(self) -> int:
        return len(read_state(self.folder))

    def _portrait(self) -> str:
        """Return the first shapes as an HTML table; nothing if they cannot be read."""
        try:
            state = read_state(self.folder)
            shapes = state.facts(state.shape_ids[:MOST_LISTED]).values()
        except (StoreError, OSError):
            return ""
        rows = [
            f"<tr><td>{escape(printable(each.name))}</td><td>{escape(printable(each.label or ''))}</td></tr>"
            for each in shapes
        ]
        n_more = len(state) - len(rows)
        more = f"<p>and {n_more:,} more</p>" if n_more else ""
        head = "<tr><th>name</th><th>label</th></tr>"
        caption = f"<caption>{len(state):,} shapes</caption>"
        return f"<table>{caption}{head}{''.join(rows)}</table>{more}"

    def _read(self) -> IndexState:
        state = read_state(self.folder)
        warn_of_damage(str(self.folder), state.damages)
        return state

    def reader(self, engine: EngineMaker | None = None) -> IndexReader:
        """Open a reader, which keeps the index in memory for many queries and many threads.

        `query` opens one for each call. A reader takes 72 bytes of memory a shape, and 1.2 KB of a
        file that the scan maps; the numbers that are compared are read from the database.

        Parameters
        ----------
        engine : callable, optional
            Make an engine that chooses which shapes are compared with a query, in place of a coarse
            scan: `FaissEngine`, above some 100,000 shapes, or a function that returns a
            `QdrantEngine`. It is called with the `CoarseRows` of all shapes at the first query.

        Returns
        -------
        IndexReader
            Close it, or use it in a ``with`` block.

        Raises
        ------
        InvalidParameterError
            If `engine` cannot be called.
        StoreError
            If the index cannot be read.

        Examples
        --------
        >>> import eigenshape as es
        >>> index = es.ShapeIndex.create(None)
        >>> fish = es.describe(es.make_creature("fish", n_vertices=500), es.retrieval.SCALE_FREE)
        >>> with index.reader() as reader:
        ...     index.add_many([es.retrieval.DescribedShape("fish", [fish])])
        ...     before = len(reader)
        ...     reader.refresh()
        ...     before, len(reader), reader.query(fish)[0].name
        True
        (0, 1, 'fish')
        """
        return IndexReader(self.folder, engine)

    def records(self, *, where: Mapping[str, Any] | None = None) -> list[Record]:
        """List shapes, sorted by name.

        Parameters
        ----------
        where : mapping, optional
            Conditions that a shape must meet, as of `query`; by default all shapes are listed.

        Returns
        -------
        list of Record

        Raises
        ------
        InvalidParameterError
            If a condition is none, or about an attribute that no shape has.
        """
        state = read_state(self.folder)
        chosen = choose_shapes(state, where)
        records = _records(state, None if chosen is None else set(chosen.tolist()))
        warn_of_damage(str(self.folder), state.damages)
        return records

    def recipes(self) -> list[AnyRecipe]:
        """List the recipes of the index, in the order in which they were added.

        Returns
        -------
        list of HeatRecipe or PatchRecipe
        """
        return list(self._read().recipes.values())

    def default_recipe(self) -> AnyRecipe:
        """Return the recipe by which `add` and `query` describe a mesh.

        Returns
        -------
        HeatRecipe or PatchRecipe
            The first `PatchRecipe` of the index, else its first recipe. For an empty index,
            patches with the codebook that comes with the library.
        """
        return choose_recipe(self.recipes())

    def keep_recipe(self, recipe: AnyRecipe) -> None:
        """Add a recipe before any shape is described by it, so that its codebook is not lost.

        Parameters
        ----------
        recipe : HeatRecipe or PatchRecipe

        Raises
        ------
        StoreError
            If another process is writing.
        """
        require_type(recipe, AnyRecipe, "recipe")
        with writing(self.folder) as database:
            Writer(self.folder, database).keep_recipe(recipe)

    def add(  # noqa: PLR0913 - one keyword for each fact of a shape, and how it is described
        self,
        name: str,
        mesh: MeshLike,
        *,
        label: str | None = None,
        source: str | None = None,
        tags: Sequence[str] = (),
        attributes: Mapping[str, Any] | None = None,
        recipe: AnyRecipe | None = None,
        n_views: Integer | None = None,
        replace: bool = False,
    ) -> None:
        """Describe a mesh and add it to the index, with a small picture.

        A closed mesh is also described as single viewpoints see it, so that partial scans find it.

        Parameters
        ----------
        name : str
            By which the shape is found; unique in the index.
        mesh : MeshLike
            A closed or open surface, of any size.
        label, source : str, optional
            Class of the shape, and where it came from.
        tags : sequence of str
            Words by which queries may choose shapes.
        attributes : mapping, optional
            Numbers and texts by name, by which queries may choose shapes.
        recipe : HeatRecipe or PatchRecipe, optional
            By default that of `default_recipe`.
        n_views : int, optional
            Viewpoints: by default 6 for patches and 4 for heat.
        replace : bool
            Whether a shape of the same name is replaced.

        Raises
        ------
        InvalidShapeError
            As `describe`.
        InvalidParameterError
            If `n_views` is not in 0..1000.
        StoreError
            If the name is in the index and `replace` is False, or another process is writing.

        See Also
        --------
        ShapeIndex.add_many, build_index
        """
        mesh = as_mesh(mesh)
        require_type(recipe, AnyRecipe | None, "recipe")
        facts = ShapeFacts(name, label=label, source=source, tags=tags, attributes=attributes or {})
        facts.as_row()  # which refuses them before the mesh is described, which takes a second
        descriptors = describe_to_store(mesh, recipe or self.default_recipe(), n_views)
        shape = DescribedShape(
            descriptors=descriptors, thumbnail=draw_thumbnail(mesh), **vars(facts)
        )
        self.add_many([shape], replace=replace)

    def add_many(self, shapes: Iterable[DescribedShape], *, replace: bool = False) -> None:
        """Add shapes that are described already, all in one step or none.

        A thousand shapes at once take little more time than ten one by one: the disk is waited for
        once a call.

        Parameters
        ----------
        shapes : iterable of DescribedShape
        replace : bool
            Whether shapes of the same name with another digest are replaced.

        Raises
        ------
        InvalidParameterError
            If a shape has no descriptor, a number is not finite, the rows of a descriptor are
            longer or shorter than those of others by the same recipe, or a tag or an attribute
            cannot be stored.
        StoreError
            If a name is in the index with another digest and `replace` is False, another process
            is writing, or the disk is full.

        See Also
        --------
        ShapeIndex.add, ShapeIndex.descriptors, build_index
        """
        with writing(self.folder) as database:
            writer = Writer(self.folder, database)
            for shape in shapes:
                require_type(shape, DescribedShape, "shapes[...]")
                writer.add(described(shape), replace=replace)

    def update(self, records: Iterable[Record]) -> None:
        """Change what is known of shapes, all in one step, and keep their descriptors.

        Parameters
        ----------
        records : iterable of Record
            As of `records`, with another label, source, digest, tags or attributes
            (``dataclasses.replace``). The name says which shape is meant.

        Raises
        ------
        InvalidParameterError
            If a tag or an attribute cannot be stored.
        StoreError
            If there is no shape of a name, or another process is writing.

        Examples
        --------
        >>> from dataclasses import replace
        >>> import eigenshape as es
        >>> index = es.ShapeIndex.create(None)
        >>> index.add("felix", es.make_creature("fish", n_vertices=500), n_views=0)
        >>> index.update([replace(record, label="fish") for record in index.records()])
        >>> index.records()[0].label
        'fish'
        """
        with writing(self.folder) as database:
            writer = Writer(self.folder, database)
            for record in records:
                require_type(record, Record, "records[...]")
                writer.update(record)

    def remove(self, *names: str) -> None:
        """Remove shapes, all in one step.

        Their space in the file serves shapes that are added later, or is given back by `compact`.
        Readers find them until they are refreshed. On a full disk, remove about ten at a time.

        Parameters
        ----------
        *names : str

        Raises
        ------
        StoreError
            If there is no shape of a name, another process is writing, or the disk is full and
            these are too many at once.
        """
        with writing(self.folder, frees=True) as database:
            writer = Writer(self.folder, database)
            for name in names:
                writer.remove(name)

    def prune(self, *folders: str | Path) -> list[str]:
        """Remove the shapes whose files lay in some folders and are no longer there, all in one step.

        Parameters
        ----------
        *folders : str or Path
            Those that were indexed.

        Returns
        -------
        list of str
            The names of the removed shapes.

        Raises
        ------
        StoreError
            As for `remove`.
        """
        places = [as_path(folder, "folders").absolute() for folder in folders]
        gone = []
        for record in self.records():
            path = Path(record.source) if record.source else None
            if path and any(path.is_relative_to(place) for place in places) and not path.exists():
                gone.append(record.name)
        if gone:
            self.remove(*gone)  # in one step: each change of an index waits for the disk
        return gone

    def query(
        self,
        shape: MeshLike | Descriptor,
        *,
        n_matches: Integer = 5,
        where: Mapping[str, Any] | None = None,
        without: str | None = None,
        exact: bool = False,
    ) -> Matches:
        """Find the shapes that are most similar to a mesh, whole or partial, in any pose.

        For many queries, open a `reader`.

        Parameters
        ----------
        shape : MeshLike, HeatDescriptor or PatchDescriptor
            A mesh is described by `default_recipe`. A descriptor, of `describe`, is compared with
            the descriptors by its recipe.
        n_matches : int
            Shapes to return at most.
        where : mapping, optional
            Conditions, all of which a shape must meet: ``{"label": "cat"}``, ``{"tag": "scanned"}``
            or, by the name of an attribute, ``{"height": 3}``. A list of values allows any of them,
            and a tuple of two numbers, of which one may be None, is a range:
            ``{"label": ["cat", "dog"], "height": (1.5, None)}``. A key that ends in ``!=`` chooses
            the shapes that do not meet its condition, also those without the attribute:
            ``{"label!=": "cat"}``.
        without : str, optional
            Name of a shape that is left out, such as that of `descriptors` which are passed here:
            it is like itself, whatever else the index holds.
        exact : bool
            Whether to compare all shapes with the query, however many there are. By default, of
            more than 2,000 shapes those are compared that a coarse scan finds nearest: some
            hundreds. The first such query makes a file for the scan, which takes 0.2 ms a shape.

        Returns
        -------
        Matches
            A sequence of `Match`, and how they were found. Lowest score first, each shape once;
            equal scores are sorted by name. The index keeps rounded numbers, and those of the query
            are rounded alike.

        Raises
        ------
        InvalidShapeError
            If a mesh is given, as `describe`.
        InvalidParameterError
            If `n_matches` is not positive, a number of the descriptor is not finite, a condition
            is none or about an attribute that no shape has, or `without` names no shape.
        StoreError
            If no shape is described by the recipe, or the index cannot be read.

        Warns
        -----
        StoreWarning
            If a part of the index is damaged. It is left out.

        See Also
        --------
        describe, matching_score, patch_scores
        """
        with self.reader() as reader:
            return reader.query(
                shape, n_matches=n_matches, where=where, without=without, exact=exact
            )

    def descriptors(self, name: str, recipe: AnyRecipe) -> list[Descriptor]:
        """Return the descriptors of a shape by a recipe, as they are stored.

        Parameters
        ----------
        name : str
        recipe : HeatRecipe or PatchRecipe

        Returns
        -------
        list of HeatDescriptor or PatchDescriptor
            That of the whole shape first. Pass it to `query` to find more shapes like it.

        Raises
        ------
        StoreError
            If the shape has no descriptor by that recipe, or it is damaged.
        """
        require_type(recipe, AnyRecipe, "recipe")
        state = self._read()
        facts = state.find(name)
        ids = [] if facts is None else state.descriptor_ids(facts)
        found = [each.restored() for each in state.stored(ids) if each.recipe == recipe]
        if not found:
            state.snapshot(recipe)  # which tells which recipes there are
            raise StoreError(
                f"A shape must be described by the requested recipe; {name!r} is not described by "
                f"{recipe}."
            )
        return found

    def thumbnail(self, name: str) -> bytes | None:
        """Return the small picture of a shape.

        Parameters
        ----------
        name : str

        Returns
        -------
        bytes or None
            As it was given, PNG or WebP; None if the shape was added without one.

        Raises
        ------
        StoreError
            If there is no shape of that name, or the picture is damaged.
        """
        state = self._read()
        return state.picture(state.require(name, "have a picture"))

    def verify(self) -> IndexReport:
        """Compare everything in the index with its checksums.

        Returns
        -------
        IndexReport
            With all damage, by name of shape where it is known.

        Raises
        ------
        StoreError
            If the database cannot be read at all.

        Examples
        --------
        >>> import eigenshape as es
        >>> es.ShapeIndex.create(None).verify()
        IndexReport(n_shapes=0, n_bytes=0, damages=())
        """
        return verify_index(self.folder)

    def compact(self) -> int:
        """Give the space of removed shapes back.

        The last pages of the file take the place of free ones, so it costs as much as was removed,
        and not as the index holds. The file becomes shorter when no reader holds an older state. It
        goes on in steps, so that it works on a full disk, too.

        Returns
        -------
        int
            Bytes that were given back.

        Raises
        ------
        StoreError
            If another process is writing, or the disk is full.
        """
        return compact_index(self.folder)

    def merge(self, others: Sequence["ShapeIndex"], *, replace: bool = False) -> int:
        """Add all shapes of other indexes, in one step.

        What is damaged in the others is left out with a `StoreWarning`, so merging a damaged index
        into a new one keeps what is whole.

        Parameters
        ----------
        others : sequence of ShapeIndex
        replace : bool
            Whether a shape replaces one of the same name with another digest.

        Returns
        -------
        int
            Shapes that were added. One with the name and the digest of a shape of this index is
            not, but gives it the recipes that it lacks.

        Raises
        ------
        InvalidParameterError
            If rows by one recipe are longer in one index than in another.
        StoreError
            If a name stands for two shapes and `replace` is False, another process is writing, or
            the disk is full.

        See Also
        --------
        query_indexes : Ask several indexes, and leave them apart.

        Examples
        --------
        >>> import eigenshape as es
        >>> part, whole = es.ShapeIndex.create(None), es.ShapeIndex.create(None)
        >>> part.add("fish", es.make_creature("fish", n_vertices=500), n_views=0)
        >>> whole.merge([part]), [record.name for record in whole.records()]
        (1, ['fish'])
        """
        require_each(others, ShapeIndex, "others")
        return merge_indexes(self.folder, [other.folder for other in others], replace=replace)

    def export(self, folder: str | Path, names: Sequence[str] | None = None) -> None:
        """Write records and descriptors as files for other programs.

        ``records.json`` lists the shapes, each with a number. ``descriptors.npz`` holds the arrays
        of each descriptor under ``number/recipe/view/``.

        Parameters
        ----------
        folder : str or Path
            An empty folder, or one that does not exist.
        names : sequence of str, optional
            Shapes to export; by default all.

        Raises
        ------
        StoreError
            If the folder holds anything, there is no shape of a name, or one is damaged.

        Examples
        --------
        >>> from tempfile import TemporaryDirectory
        >>> import numpy as np
        >>> import eigenshape as es
        >>> index = es.ShapeIndex.create(None)
        >>> fish = es.make_creature("fish", n_vertices=500)
        >>> index.add("fish", fish, recipe=es.retrieval.SCALE_FREE, n_views=0)
        >>> with TemporaryDirectory() as folder:
        ...     index.export(folder)
        ...     np.load(f"{folder}/descriptors.npz")["0/scale-free/0/vectors"].shape
        (15, 15)
        """
        if names is not None:
            require_each(names, str, "names")
        state = self._read()
        chosen = None
        if names is not None:
            chosen = {state.require(name, "be exported").id for name in names}
        export_index(state, _records(state, chosen), Path(folder))


def _records(state: IndexState, chosen: set[int] | None) -> list[Record]:
    """Return what is known of the chosen shapes, or of all, sorted by name."""
    used: dict[int, set[int]] = {}
    rows = state.descriptors
    for shape, recipe in zip(rows["shape"].tolist(), rows["recipe"].tolist(), strict=True):
        used.setdefault(shape, set()).add(recipe)
    records = []
    for facts in state.every():
        if chosen is None or facts.id in chosen:
            by = tuple(state.recipes[number] for number in sorted(used.get(facts.id, ())))
            records.append(Record(**facts.as_facts(), recipes=by))
    return sorted(records, key=lambda record: record.name)
