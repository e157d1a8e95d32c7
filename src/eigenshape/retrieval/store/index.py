"""A collection of described shapes in a folder, searched for those that are most alike."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import SupportsIndex

import numpy as np
from jaxtyping import Int

from eigenshape._arguments import require_each, require_type
from eigenshape._arrays import whole_number
from eigenshape._errors import StoreError
from eigenshape._text import html_repr, short_repr
from eigenshape._threads import one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, kind_of
from eigenshape.retrieval.patches.descriptor import PatchRecipe
from eigenshape.retrieval.store import files as store
from eigenshape.retrieval.store.catalog import ShapeRow, keep_recipe
from eigenshape.retrieval.store.reading import StoredDescriptors, read_descriptors
from eigenshape.retrieval.store.writing import (
    add_shape,
    describe_to_store,
    require_columns,
    require_text,
    rows_of_each,
    write_views,
)


@dataclass(frozen=True)
class Record:
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
    recipes : tuple of HeatRecipe or PatchRecipe
        By which the shape is described.

    See Also
    --------
    ShapeIndex.records
    """

    name: str
    label: str | None
    source: str | None
    digest: str | None
    recipes: tuple[AnyRecipe, ...]

    __repr__ = short_repr
    _repr_html_ = html_repr


@dataclass(frozen=True, eq=False)
class Match:
    """A shape that `ShapeIndex.query` found.

    Attributes
    ----------
    name, label, source : str
        As in its `Record`.
    score : float
        Of `matching_score` or `patch_scores`: 0, or nearly, for the same descriptor; smaller is
        more alike.
    correspondences : (p, 2) int
        Features or patches that correspond: the number of one of the query, and of one of this
        shape. Surest pairs first.
    vertices : (m,) int
        The vertex of each feature or patch of this shape.
    view : int
        Which of the descriptors of the shape matched, in the order in which they were added: 0 is
        the first, that of the whole shape.

    See Also
    --------
    ShapeIndex.query

    Examples
    --------
    >>> import tempfile
    >>> import eigenshape as es
    >>> recipe = es.retrieval.SCALE_FREE
    >>> index = es.ShapeIndex.create(tempfile.mkdtemp())
    >>> for name in ("fish", "biped"):
    ...     mesh = es.make_creature(name, n_vertices=500)
    ...     index.add_descriptors(name, [es.describe(mesh, recipe)], label="creature")
    >>> scan = es.make_creature("fish", pose=1, n_vertices=500)
    >>> match = index.query(es.describe(scan, recipe), n_matches=1)[0]
    >>> match.name, match.label, len(match.vertices)
    ('fish', 'creature', 15)
    """

    name: str
    label: str | None
    source: str | None
    score: float
    correspondences: Int[np.ndarray, "p 2"]
    vertices: Int[np.ndarray, " m"]
    view: int

    __repr__ = short_repr
    _repr_html_ = html_repr


@dataclass(frozen=True)
class ShapeIndex:
    """A folder of described shapes, in which similar ones are found.

    Call `ShapeIndex.create`, `ShapeIndex.open` or `ShapeIndex.open_or_create`. Any number of
    processes may read an index at the same time, while one writes. Every call reads or writes the
    folder, and nothing stays open between calls. A process that is killed while it writes leaves
    the state before or after the call. All that is read is checked, and damage is reported.

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
    def create(cls, folder: str | Path) -> "ShapeIndex":
        """Make an empty index.

        Parameters
        ----------
        folder : str or Path
            An empty folder, or one that does not exist.

        Returns
        -------
        ShapeIndex

        Raises
        ------
        StoreError
            If the folder holds anything.
        """
        store.create(Path(folder))
        return cls(Path(folder))

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
            If the folder is no index, its format is another one, or its database is damaged.
        """
        with store.reading(Path(folder)):
            return cls(Path(folder))

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
        store.create_if_missing(Path(folder))
        return cls.open(folder)

    def __len__(self) -> int:
        with store.reading(self.folder) as catalog:
            return len(catalog.shapes)

    def records(self) -> list[Record]:
        """List all shapes, sorted by name.

        Returns
        -------
        list of Record
        """
        with store.reading(self.folder) as catalog:
            recipes = dict(catalog.recipes())
        used: dict[int, set[int]] = {shape.id: set() for shape in catalog.shapes}
        for row in catalog.descriptors:
            used[row.shape].add(row.recipe)
        return [
            Record(*shape[1:], tuple(recipes[number] for number in sorted(used[shape.id])))
            for shape in sorted(catalog.shapes, key=lambda shape: shape.name)
        ]

    def recipes(self) -> list[AnyRecipe]:
        """List the recipes of the index, in the order in which they were added.

        Returns
        -------
        list of HeatRecipe or PatchRecipe
        """
        with store.reading(self.folder) as catalog:
            return [recipe for _, recipe in catalog.recipes()]

    def default_recipe(self) -> AnyRecipe:
        """Return the recipe by which `add` and `query` describe a mesh.

        Returns
        -------
        HeatRecipe or PatchRecipe
            The first `PatchRecipe` of the index, else its first recipe. For an empty index,
            patches with the codebook that comes with the library.
        """
        recipes = self.recipes()
        patches = [recipe for recipe in recipes if isinstance(recipe, PatchRecipe)]
        return next(iter([*patches, *recipes])) if recipes else PatchRecipe()

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
        with store.writing(self.folder) as catalog:
            keep_recipe(catalog, recipe)

    def add(  # noqa: PLR0913 - one keyword for each fact of a shape, and how it is described
        self,
        name: str,
        mesh: MeshLike,
        *,
        label: str | None = None,
        source: str | None = None,
        recipe: AnyRecipe | None = None,
        n_views: SupportsIndex | None = None,
        replace: bool = False,
    ) -> None:
        """Describe a mesh and add it to the index.

        A closed mesh is also described as single viewpoints see it, so that partial scans find it.

        Parameters
        ----------
        name : str
            By which the shape is found; unique in the index.
        mesh : MeshLike
            A closed or open surface, of any size.
        label, source : str, optional
            Class of the shape, and where it came from.
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
        StoreError
            If the name is in the index and `replace` is False, or another process is writing.

        See Also
        --------
        ShapeIndex.add_descriptors, build_index
        """
        mesh = as_mesh(mesh)
        require_type(recipe, AnyRecipe | None, "recipe")
        require_text(name, label, source)
        if recipe is None:
            recipe = self.default_recipe()
        descriptors = describe_to_store(mesh, recipe, n_views)
        self.add_descriptors(name, descriptors, label=label, source=source, replace=replace)

    def add_descriptors(
        self,
        name: str,
        descriptors: Sequence[Descriptor],
        *,
        label: str | None = None,
        source: str | None = None,
        digest: str | None = None,
        replace: bool = False,
    ) -> None:
        """Add a shape that is described already.

        Descriptors of one recipe are views of the shape: the whole first, then what is seen of it
        from some sides. The view with the lowest score counts.

        Parameters
        ----------
        name : str
            By which the shape is found; unique in the index.
        descriptors : sequence of HeatDescriptor or PatchDescriptor
        label, source : str, optional
            Class of the shape, and where it came from.
        digest : str, optional
            Hash of its content. If the name is in the index with the same digest, the shape gains
            the recipes that it lacks, and keeps its descriptors by the others.
        replace : bool
            Whether a shape of the same name with another digest is replaced, in one step.

        Raises
        ------
        InvalidParameterError
            If there is no descriptor, a number is not finite, or the rows of a descriptor are
            longer or shorter than those of others by the same recipe.
        StoreError
            If the name is in the index with another digest and `replace` is False, or another
            process is writing.

        See Also
        --------
        ShapeIndex.add, ShapeIndex.descriptors
        """
        require_each(descriptors, Descriptor, "descriptors")
        require_text(name, label, source, digest)
        rows = rows_of_each(name, descriptors)
        with store.writing(self.folder) as before:
            row = ShapeRow(0, name, label, source, digest)
            catalog, shape = add_shape(before, row, replace=replace)
            for recipe in dict.fromkeys(descriptor.recipe for descriptor in descriptors):
                views = [
                    pair for pair in zip(descriptors, rows, strict=True) if pair[0].recipe == recipe
                ]
                write_views(self.folder, catalog, shape, keep_recipe(catalog, recipe), views)

    def remove(self, name: str) -> None:
        """Remove a shape.

        Its numbers stay in the file, so that processes that read the old state still find them.

        Parameters
        ----------
        name : str

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

    def query(self, shape: MeshLike | Descriptor, *, n_matches: SupportsIndex = 5) -> list[Match]:
        """Find the shapes that are most similar to a mesh, whole or partial, in any pose.

        Parameters
        ----------
        shape : MeshLike, HeatDescriptor or PatchDescriptor
            A mesh is described by `default_recipe`. A descriptor, of `describe`, is compared with
            the descriptors by its recipe.
        n_matches : int
            Shapes to return at most.

        Returns
        -------
        list of Match
            Lowest score first, each shape once; equal scores are sorted by name. The index keeps
            numbers in single precision, and those of the query are rounded alike.

        Raises
        ------
        InvalidShapeError
            If a mesh is given, as `describe`.
        InvalidParameterError
            If `n_matches` is not positive, or a number of the descriptor is not finite.
        StoreError
            If no shape is described by the recipe, or a file is damaged.

        See Also
        --------
        describe, matching_score, patch_scores
        """
        wanted = whole_number(n_matches, "n_matches", 1, 2**31)
        if isinstance(shape, Descriptor):
            descriptor = shape
        else:
            mesh, recipe = as_mesh(shape, "shape"), self.default_recipe()
            descriptor = kind_of(recipe).describe_query(mesh, recipe)
        kind = kind_of(descriptor.recipe)
        (rows,) = rows_of_each("the query", [descriptor])
        query = kind.restore(rows, kind.details(descriptor), descriptor.recipe)
        with store.reading(self.folder) as catalog, one_blas_thread():
            stored = read_descriptors(self.folder, catalog, descriptor.recipe)
            require_columns(descriptor, rows, stored.entries[0].row.n_columns)
            scores = kind.verify(query, stored.descriptor, kind.scores(query, stored.rows))

            # Of the views of each shape, keep the one with the lowest score. Entries are sorted by
            # name, and so are equal scores.
            order = np.argsort(scores, kind="stable")
            names = [stored.entries[place].shape.name for place in order]
            firsts = np.unique(names, return_index=True)[1]
            best = order[np.sort(firsts)[:wanted]].tolist()
            return [_match(query, stored, place, float(scores[place])) for place in best]

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
            If the shape has no descriptor by that recipe, or a file is damaged.
        """
        require_type(recipe, AnyRecipe, "recipe")
        with store.reading(self.folder) as catalog:
            stored = read_descriptors(self.folder, catalog, recipe)
            found = [
                stored.descriptor(place)
                for place, entry in enumerate(stored.entries)
                if entry.shape.name == name
            ]
        if not found:
            raise StoreError(
                f"A shape must be described by the requested recipe; {name!r} is not described by "
                f"{recipe}."
            )
        return found


def _match(query: Descriptor, stored: StoredDescriptors, place: int, score: float) -> Match:
    (shape, row), found = stored.entries[place], stored.descriptor(place)
    pairs = kind_of(stored.recipe).correspondences(query, found)
    return Match(shape.name, shape.label, shape.source, score, pairs, found.vertices, row.view)
