"""Describe many files in worker processes, and add what they find to an index."""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from hashlib import file_digest, sha256
from pathlib import Path
from typing import SupportsIndex

from eigenshape._arguments import require_each, require_type
from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._text import html_repr, short_repr
from eigenshape._workers import Item as Item  # noqa: PLC0414 - the room lists it from here
from eigenshape._workers import Workers as Workers  # noqa: PLC0414 - and this
from eigenshape._workers import run_in_workers
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor
from eigenshape.retrieval.patches.codebook import PatchCodebook, default_codebook, train_codebook
from eigenshape.retrieval.patches.patches import Patches, extract_patches
from eigenshape.retrieval.store.index import Record, ShapeIndex
from eigenshape.retrieval.store.writing import describe_to_store

Read = Callable[[Path], MeshLike]
Callback = Callable[[int, int, str, str | None], None]
# Shapes that a codebook is learned from. A hundred closed ones have 45,000 patches for its 32
# Gaussians, and take some minutes; fewer than 40 leave it to the codebook of the library.
FEWEST_TO_TRAIN, MOST_TO_TRAIN = 40, 100
N_TRAINING_VIEWS = 2  # partial views of each closed shape that a codebook is learned from


@dataclass(frozen=True)
class BatchReport:
    """What `build_index` did.

    Attributes
    ----------
    added, skipped : tuple of str
        Names of the shapes that were added, and that the index had already.
    failed : tuple of (str, str)
        Name and reason of each shape that could not be added.

    See Also
    --------
    build_index
    """

    added: tuple[str, ...]
    skipped: tuple[str, ...]
    failed: tuple[tuple[str, str], ...]

    __repr__ = short_repr
    _repr_html_ = html_repr


@dataclass(frozen=True)
class _DescribedFile:
    digest: str
    descriptors: tuple[Descriptor, ...]


def build_index(  # noqa: PLR0913 - one keyword for each choice of a batch
    index: ShapeIndex,
    items: Sequence[Item],
    read: Read,
    *,
    recipes: Sequence[AnyRecipe] | None = None,
    n_views: SupportsIndex | None = None,
    workers: Workers = Workers(),
    callback: Callback | None = None,
) -> BatchReport:
    """Describe files in several processes, and add each to an index as soon as it is described.

    A file that raises an error, hangs or kills its process is reported, and the others go on. Only
    this process writes: after Ctrl-C or a crash, the same call continues where it stopped. A file
    that the index has with the same content and recipes is skipped. A file whose content has
    changed replaces the old shape in one step.

    Parameters
    ----------
    index : ShapeIndex
    items : sequence of Item
        Files, with the names and labels of their shapes.
    read : callable
        Return the mesh of a path: ``es.read_mesh``, or a function of yours that a new process can
        import by name.
    recipes : sequence of HeatRecipe or PatchRecipe, optional
        By default that of `ShapeIndex.default_recipe`.
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
        If two items have the same name, or `n_views` is negative.
    StoreError
        If the index cannot be written.
    EigenshapeError
        If no worker can start. A script must call this under ``if __name__ == "__main__":``, since
        workers import the script.

    See Also
    --------
    ShapeIndex.add, train_codebook_from_files

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> import eigenshape as es
    >>> index = es.ShapeIndex.create(mkdtemp())
    >>> es.retrieval.build_index(index, [], es.read_mesh)  # with items: under the main guard
    BatchReport(added=(), skipped=(), failed=())
    """
    require_type(index, ShapeIndex, "index")
    require_type(workers, Workers, "workers")
    require_each(items, Item, "items")
    if recipes is None:
        recipes = (index.default_recipe(),)
    require_each(recipes, AnyRecipe, "recipes")
    if n_views is not None:
        n_views = whole_number(n_views, "n_views", 0)
    _require_different_names(items)
    callback = callback or _ignore

    known = {record.name: record for record in index.records()}
    todo = [item for item in items if not _is_known(item, known.get(item.name), recipes)]
    added: set[str] = set()
    failed: dict[str, str] = {}
    n_done = len(items) - len(todo)
    if n_done:
        callback(n_done, len(items), "already in the index", None)
    work = partial(_describe_file, read, tuple(recipes), n_views)
    # Closing stops the workers at once, also after Ctrl-C.
    with closing(run_in_workers(work, todo, workers)) as outcomes:
        for item, outcome in outcomes:
            n_done += 1
            error = outcome.error if outcome.value is None else _add(index, item, outcome.value)
            if error is None:
                added.add(item.name)
            else:
                failed[item.name] = error
            callback(n_done, len(items), item.name, error)
    names = [item.name for item in items]
    return BatchReport(
        added=tuple(name for name in names if name in added),
        skipped=tuple(name for name in names if name not in added and name not in failed),
        failed=tuple((name, failed[name]) for name in names if name in failed),
    )


def train_codebook_from_files(
    items: Sequence[Item],
    read: Read,
    *,
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
    workers : Workers
    callback : callable, optional
        As of `build_index`; errors are not passed.

    Returns
    -------
    PatchCodebook
        `default_codebook` if there are fewer than 40 files, or fewer that can be described.

    Raises
    ------
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
    if len(items) < FEWEST_TO_TRAIN:
        return default_codebook()
    callback = callback or _ignore
    chosen = sorted(items, key=lambda item: sha256(item.name.encode()).digest())[:MOST_TO_TRAIN]
    shapes: dict[str, list[Patches]] = {}
    with closing(run_in_workers(partial(_extract_file, read), chosen, workers)) as outcomes:
        for number, (item, outcome) in enumerate(outcomes):
            if outcome.value is not None:
                shapes[item.name] = outcome.value
            callback(number + 1, len(chosen), item.name, None)
    if len(shapes) < FEWEST_TO_TRAIN:
        return default_codebook()
    return train_codebook([patches for item in chosen for patches in shapes.get(item.name, ())])


def content_digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def _require_different_names(items: Sequence[Item]) -> None:
    paths: dict[str, Path] = {}
    for item in items:
        if item.name in paths:
            raise InvalidParameterError(
                f"Items must have different names; {item.name!r} is the name of both "
                f"{paths[item.name]} and {item.path}."
            )
        paths[item.name] = item.path


def _describe_file(
    read: Read, recipes: tuple[AnyRecipe, ...], n_views: int | None, path: Path
) -> _DescribedFile:
    """Describe a file, in a worker."""
    # Before it is read: a file that changes meanwhile is described again next time.
    digest = content_digest(path)
    mesh = as_mesh(read(path))
    descriptors = [
        descriptor for recipe in recipes for descriptor in describe_to_store(mesh, recipe, n_views)
    ]
    return _DescribedFile(digest, tuple(descriptors))


def _extract_file(read: Read, path: Path) -> list[Patches]:
    """Extract the patches of a file, in a worker."""
    return extract_patches(read(path), n_views=N_TRAINING_VIEWS)


def _add(index: ShapeIndex, item: Item, file: _DescribedFile) -> str | None:
    """Add a shape; return the reason if the index refuses it."""
    facts = {"label": item.label, "source": str(item.path.absolute()), "digest": file.digest}
    try:
        index.add_descriptors(item.name, file.descriptors, **facts, replace=True)
    except InvalidParameterError as err:
        return str(err)
    return None


def _is_known(item: Item, record: Record | None, recipes: Sequence[AnyRecipe]) -> bool:
    if record is None or not set(recipes) <= set(record.recipes):
        return False
    try:
        return content_digest(item.path) == record.digest
    except OSError:  # the worker that opens the file reports it
        return False


def _ignore(n_done: int, n_items: int, name: str, error: str | None) -> None:
    """Do nothing after a file."""
