"""Describe many files in worker processes, and add what they find to an index."""

import os
import socket
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from itertools import chain
from pathlib import Path
from time import monotonic
from typing import Any

from typing_extensions import TypeAliasType

from certeig.kit.arguments import require_each, require_type
from certeig.kit.errors import InvalidParameterError
from certeig.kit.files import content_digest
from certeig.kit.progress import Callback, ignore
from certeig.kit.text import Shown
from certeig.kit.typing import Integer
from eigenshape._workers import Item as Item  # noqa: PLC0414 - the room lists it from here
from eigenshape._workers import Outcome, run_in_workers
from eigenshape._workers import Workers as Workers  # noqa: PLC0414 - and this
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.repairs.repair_names import require_repairs
from eigenshape.geometry.repairs.repair_report import RepairedMesh
from eigenshape.retrieval.index import STAGE, ShapeIndex
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, describe_to_store
from eigenshape.retrieval.patches.codebook import PatchCodebook, default_codebook
from eigenshape.retrieval.patches.descriptor import PatchRecipe, patch_descriptor
from eigenshape.retrieval.patches.patches import N_VIEWS as N_PATCH_VIEWS
from eigenshape.retrieval.patches.patches import mesh_patches
from eigenshape.retrieval.patches.training import train_codebook
from eigenshape.retrieval.store.upkeep import find_damaged
from eigenshape.retrieval.store.writing import DescribedShape
from eigenshape.retrieval.thumbnails import draw_thumbnail
from eigenshape.scans.partial import view_number

Recipes = TypeAliasType("Recipes", Sequence[AnyRecipe])
Read = TypeAliasType("Read", Callable[[Path], MeshLike | RepairedMesh[TriangleMesh]])
ReadRepaired = Callable[[Path], tuple[TriangleMesh, tuple[str, ...]]]
Describe = Callable[[TriangleMesh], list[Any]]
# Shapes that a codebook is learned from. A hundred closed ones have 45,000 patches for its 32
# Gaussians, and take some minutes; fewer than 40 leave it to the codebook of the library.
FEWEST_TO_TRAIN, MOST_TO_TRAIN = 40, 100
REPAIRS = "repairs"  # attribute of a shape that was repaired: what was done
N_TRAINING_VIEWS = 2  # partial views of each closed shape that a codebook is learned from
# Shapes are added together, at most this many, and at most this many seconds after the last ones.
# One change costs 5 ms of CPU and some waits for the disk; a stopped build loses what is not added.
MOST_AT_ONCE, LONGEST_KEPT = 64, 1.0


@dataclass(frozen=True)
class BatchReport(Shown):
    """What `build_index` did.

    Attributes
    ----------
    added, skipped : tuple of str
        Names of the shapes that were added, and that the index had already.
    failed : tuple of (str, str)
        Name and reason of each shape that could not be added.
    repaired : tuple of (str, tuple of str)
        Name of each shape that was repaired, or made of points, before it was described, and what
        was done.

    See Also
    --------
    build_index

    Examples
    --------
    A script that describes files keeps the work under the main guard. It can say what went wrong:

    >>> from tempfile import mkdtemp
    >>> import eigenshape as es
    >>> index = es.ShapeIndex.create(mkdtemp())
    >>> report = es.retrieval.build_index(index, [], es.read_mesh)
    >>> for name, reason in report.failed:
    ...     print(f"{name}: {reason}")
    >>> len(report.added)
    0
    """

    added: tuple[str, ...]
    skipped: tuple[str, ...]
    failed: tuple[tuple[str, str], ...]
    repaired: tuple[tuple[str, tuple[str, ...]], ...] = ()


@dataclass(frozen=True)
class _ReadFile:
    """What a worker made of a file: its descriptors or, to learn from, its patches."""

    digest: str
    repairs: tuple[str, ...]
    thumbnail: bytes
    found: list[Any]


def build_index(  # noqa: PLR0913 - one keyword for each choice of a batch
    index: ShapeIndex,
    items: Sequence[Item],
    read: Read,
    *,
    recipes: Recipes | None = None,
    learn: bool = False,
    repairs: Sequence[str] = (),
    n_views: Integer | None = None,
    workers: Workers = Workers(),
    callback: Callback | None = None,
) -> BatchReport:
    """Describe files in several processes, and add them to an index as they are described.

    A file that raises an error, hangs, needs too much memory or kills its process is reported, and
    the others go on. Only this process writes, at most 64 shapes and one second at a time: after
    Ctrl-C or a crash, the same call continues where it stopped. A file that the index has with the
    same content and recipes is skipped, but its path, label, tags and attributes are brought up to
    date; its stored numbers are compared with their checksums, and a damaged shape is described
    anew. A file whose content has changed replaces the old shape in one step.

    Parameters
    ----------
    index : ShapeIndex
    items : sequence of Item
        Files, with the names and labels of their shapes.
    read : callable
        Return the mesh of a path: ``es.read_mesh``; ``es.io.read_surface``, which also makes
        surfaces of point clouds and of depth scans; or a function of yours that a new
        process can import by name. It may return a `RepairedMesh`, whose report is kept.
    recipes : sequence of HeatRecipe or PatchRecipe, optional
        By default that of `ShapeIndex.default_recipe`.
    learn : bool
        Whether an index without a recipe learns a codebook from the first shapes, as
        `train_codebook_from_files` does. Files that it learns from are read once.
    repairs : sequence of str
        Of `eigenshape.repair`, applied to each mesh before it is described; ``["auto"]`` does what
        is needed. The attribute ``repairs`` of a shape tells what was done to it, also by `read`.
    n_views : int, optional
        As of `ShapeIndex.add`.
    workers : Workers
    callback : callable, optional
        Called as callback(n_done, n_items, name, error or None) after each file.

    Returns
    -------
    BatchReport
        In the order of `items`.

    Raises
    ------
    InvalidParameterError
        If two items have the same name, `n_views` is not in 0..1000, a repair is unknown, or `learn` is
        given with recipes.
    StoreError
        If the index cannot be written.
    EigenshapeError
        If no worker can start. A script must call this under ``if __name__ == "__main__":``, since
        workers import the script.

    See Also
    --------
    find_items, ShapeIndex.add, train_codebook_from_files

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> import eigenshape as es
    >>> index = es.ShapeIndex.create(mkdtemp())
    >>> es.retrieval.build_index(index, [], es.read_mesh)  # with items: under the main guard
    BatchReport(added=(), skipped=(), failed=(), repaired=())
    """
    require_type(index, ShapeIndex, "index")
    require_type(workers, Workers, "workers")
    require_each(items, Item, "items")
    if recipes is not None:
        require_each(recipes, AnyRecipe, "recipes")
    if learn and recipes is not None:
        raise InvalidParameterError(
            "An index either learns a codebook or is given recipes; both were given. "
            "Pass learn=False."
        )
    views = None if n_views is None else view_number(n_views, "n_views")
    read_item = partial(_read_repaired, read, require_repairs(repairs))
    paths: dict[str, Path] = {}
    for item in items:
        if item.name in paths:
            raise InvalidParameterError(
                f"Items must have different names; {item.name!r} is the name of both "
                f"{paths[item.name]} and {item.path}."
            )
        paths[item.name] = item.path
    callback = callback or ignore

    taught: dict[str, Outcome[_ReadFile]] = {}
    if learn and not index.recipes():
        count = N_PATCH_VIEWS if views is None else views
        with announce_learning(index.folder, callback) as report:
            taught = _read_teachers(items, read_item, count, workers, report)
            index.keep_recipe(PatchRecipe(_learn_from(taught.values())))
        # Of several processes that fill a new index, all take the codebook of the first.
        patch_recipe = next(kept for kept in index.recipes() if isinstance(kept, PatchRecipe))
        for name, outcome in taught.items():
            if outcome.value is not None:
                patches = outcome.value.found[: 1 + count]
                found: list[Any] = [patch_descriptor(patches, patch_recipe)]
                taught[name] = Outcome(replace(outcome.value, found=found))
    recipes = (index.default_recipe(),) if recipes is None else tuple(recipes)

    todo = _update_known(index, [item for item in items if item.name not in taught], recipes)
    n_done = len(items) - len(todo)
    if n_done > len(taught):
        callback(n_done, len(items), "already in the index", None)
    writer = _Writer(index)
    failed: dict[str, str] = {}
    repaired: dict[str, tuple[str, ...]] = {}
    ready = [(item, taught[item.name]) for item in items if item.name in taught]
    work = partial(_read_file, read_item, partial(_describe, recipes, views))
    # Closing stops the workers at once, also after Ctrl-C; what is described by then is kept.
    with writer, closing(run_in_workers(work, todo, workers)) as described:
        for item, outcome in chain(ready, described):
            if outcome.value is None:
                failed[item.name] = str(outcome.error)
            else:
                repaired[item.name] = outcome.value.repairs
                writer.add(_shape(item, outcome.value))
            if item.name not in taught:
                n_done += 1
                callback(n_done, len(items), item.name, failed.get(item.name))
    failed |= writer.refused
    names = [item.name for item in items]
    return BatchReport(
        added=tuple(name for name in names if name in writer.added),
        skipped=tuple(name for name in names if name not in writer.added and name not in failed),
        failed=tuple((name, failed[name]) for name in names if name in failed),
        repaired=tuple((name, repaired[name]) for name in names if repaired.get(name)),
    )


def train_codebook_from_files(
    items: Sequence[Item],
    read: Read,
    *,
    repairs: Sequence[str] = (),
    workers: Workers = Workers(),
    callback: Callback | None = None,
) -> PatchCodebook:
    """Learn a codebook of patches from files, in several processes.

    At most 100 files are used, those whose names have the lowest hashes, whatever the order of
    `items`. Files that cannot be read or described are passed over: `build_index` reports them.

    Parameters
    ----------
    items : sequence of Item
    read : callable
        As of `build_index`.
    repairs : sequence of str
        As of `build_index`.
    workers : Workers
    callback : callable, optional
        As of `build_index`.

    Returns
    -------
    PatchCodebook
        `default_codebook` if there are fewer than 40 files, or fewer that can be described.

    Raises
    ------
    InvalidParameterError
        If a repair is unknown.
    EigenshapeError
        If no worker can start, as for `build_index`.

    See Also
    --------
    train_codebook, default_codebook, build_index

    Examples
    --------
    >>> import eigenshape as es
    >>> codebook = es.retrieval.train_codebook_from_files([], es.read_mesh)
    >>> codebook == es.retrieval.default_codebook()
    True
    """
    require_type(workers, Workers, "workers")
    require_each(items, Item, "items")
    read_item = partial(_read_repaired, read, require_repairs(repairs))
    taught = _read_teachers(items, read_item, N_TRAINING_VIEWS, workers, callback or ignore)
    return _learn_from(taught.values())


def _read_teachers(
    items: Sequence[Item], read: ReadRepaired, n_views: int, workers: Workers, callback: Callback
) -> dict[str, Outcome[_ReadFile]]:
    """Extract the patches of the shapes that a codebook is learned from; of none if too few."""
    if len(items) < FEWEST_TO_TRAIN:
        return {}
    chosen = sorted(items, key=lambda item: sha256(item.name.encode()).digest())[:MOST_TO_TRAIN]
    extract = partial(mesh_patches, n_views=max(n_views, N_TRAINING_VIEWS))
    work = partial(_read_file, read, extract)
    found = {}
    with closing(run_in_workers(work, chosen, workers)) as outcomes:
        for number, (item, outcome) in enumerate(outcomes):
            found[item.name] = outcome
            callback(number + 1, len(items), item.name, outcome.error)
    # in this order, so that the codebook does not depend on which file was done first
    return {item.name: found[item.name] for item in chosen}


@contextmanager
def announce_learning(folder: Path, callback: Callback) -> Iterator[Callback]:
    """Write into the folder of an index how far learning its codebook is, beside a callback.

    Until the codebook is learned the index holds no shape, which takes minutes on large meshes.
    """
    note = folder / STAGE

    def write(done: str) -> None:
        with suppress(OSError):  # a full disk; it is a note alone
            note.write_text(
                f"learning a codebook: {done} shapes read by process {os.getpid()} on "
                f"{socket.gethostname()}"
            )

    def report(n_done: int, n_items: int, name: str, error: str | None) -> None:
        write(f"{n_done} of {min(n_items, MOST_TO_TRAIN)}")
        callback(n_done, n_items, name, error)

    write("no")
    try:
        yield report
    finally:
        note.unlink(missing_ok=True)


def _learn_from(outcomes: Iterable[Outcome[_ReadFile]]) -> PatchCodebook:
    files = [outcome.value for outcome in outcomes if outcome.value is not None]
    if len(files) < FEWEST_TO_TRAIN:
        return default_codebook()
    return train_codebook(
        [patches for file in files for patches in file.found[: 1 + N_TRAINING_VIEWS]]
    )


def _read_repaired(
    read: Read, repairs: tuple[str, ...], path: Path
) -> tuple[TriangleMesh, tuple[str, ...]]:
    """Return the mesh of a file after repairs, and what they and its reader did."""
    found = read(path)
    made = found if isinstance(found, RepairedMesh) else None
    done = repair(as_mesh(found if made is None else made.mesh), repairs)
    return done.mesh, (() if made is None else made.report) + done.report


def _read_file(read: ReadRepaired, describe: Describe, path: Path) -> _ReadFile:
    """Describe a file, in a worker."""
    # Before it is read: a file that changes meanwhile is described again next time.
    digest = content_digest(path)
    mesh, repairs = read(path)
    return _ReadFile(digest, repairs, draw_thumbnail(mesh), describe(mesh))


def _describe(
    recipes: tuple[AnyRecipe, ...], n_views: int | None, mesh: TriangleMesh
) -> list[Descriptor]:
    return [each for recipe in recipes for each in describe_to_store(mesh, recipe, n_views)]


def _shape(item: Item, file: _ReadFile) -> DescribedShape:
    done = {REPAIRS: "; ".join(file.repairs)} if file.repairs else {}
    return DescribedShape(
        item.name,
        file.found,
        digest=file.digest,
        thumbnail=file.thumbnail,
        **_facts_of(item, done),
    )


def _facts_of(item: Item, repairs: Mapping[str, Any]) -> dict[str, Any]:
    """Return what an index keeps of an item, with the attribute of what was repaired, if it was."""
    return {
        "label": item.label,
        "source": str(item.path.absolute()),
        "tags": tuple(sorted(set(item.tags))),
        "attributes": {**item.attributes, **repairs},
    }


class _Writer:
    """Adds shapes to an index some at a time, since each change of an index waits for the disk."""

    def __init__(self, index: ShapeIndex) -> None:
        self._index = index
        self._waiting: list[DescribedShape] = []
        self._begun = monotonic()
        self.added: set[str] = set()
        self.refused: dict[str, str] = {}

    def __enter__(self) -> None: ...

    def __exit__(self, *_: object) -> None:
        if self._waiting:
            self._write(self._waiting)

    def add(self, shape: DescribedShape) -> None:
        self._waiting.append(shape)
        if len(self._waiting) >= MOST_AT_ONCE or monotonic() - self._begun > LONGEST_KEPT:
            self._write(self._waiting)
            self._waiting = []
            self._begun = monotonic()

    def _write(self, shapes: Sequence[DescribedShape]) -> None:
        try:
            self._index.add_many(shapes, replace=True)
        except InvalidParameterError as err:
            if len(shapes) == 1:
                self.refused[shapes[0].name] = str(err)
                return
            for shape in shapes:  # each of the others is added
                self._write([shape])
        else:
            self.added.update(shape.name for shape in shapes)


def _update_known(
    index: ShapeIndex, items: Sequence[Item], recipes: Sequence[AnyRecipe]
) -> list[Item]:
    """Return the items that must be described; bring up to date what is known of the others."""
    known = {record.name: record for record in index.records()}
    same = []
    for item in items:
        if item.name in known and set(recipes) <= set(known[item.name].recipes):
            with suppress(OSError):  # the worker that opens the file reports it
                if content_digest(item.path) == known[item.name].digest:
                    same.append(item.name)
    whole = set(same) - find_damaged(index.folder, same)
    todo, changed = [], []
    for item in items:
        if item.name not in whole:
            todo.append(item)
            continue
        record = known[item.name]
        done = {key: text for key, text in record.attributes.items() if key == REPAIRS}
        new = replace(record, **_facts_of(item, done))
        if new != record:
            changed.append(new)
    if changed:  # a change takes the lock of the index, also one of nothing
        index.update(changed)
    return todo
