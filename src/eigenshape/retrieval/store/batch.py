"""Describe many shapes in worker processes that may die, and keep what they find."""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from hashlib import file_digest, sha256
from pathlib import Path
from typing import get_args

from eigenshape._arguments import require_each, require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.retrieval.heat.descriptor import SCALE_FREE
from eigenshape.retrieval.patches.codebook import PatchCodebook, made_codebook, train_codebook
from eigenshape.retrieval.patches.patches import Patches
from eigenshape.retrieval.store.index import Record, ShapeIndex
from eigenshape.retrieval.store.kinds import AnyRecipe, Descriptor
from eigenshape.retrieval.store.workers import Item, Workers, in_workers

Describe = Callable[[Path], Sequence[Descriptor]]
Teach = Callable[[Path], Sequence[Patches]]
Told = Callable[[int, int, str, str | None], None]
FEWEST_TEACHERS, MOST_TEACHERS = 40, 100  # shapes


@dataclass(frozen=True)
class BatchReport:
    """What a batch did.

    Attributes
    ----------
    added, skipped : tuple of str
        Names that were described now, and that the index had.
    failed : tuple of (str, str)
        Name and reason of each shape that could not be taken.
    """

    added: tuple[str, ...]
    skipped: tuple[str, ...]
    failed: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class _Described:
    digest: str
    descriptors: tuple[Descriptor, ...]


def build_index(
    index: ShapeIndex,
    items: Sequence[Item],
    describe: Describe,
    *,
    recipes: Sequence[AnyRecipe] = (SCALE_FREE,),
    workers: Workers = Workers(),
    told: Told | None = None,
) -> BatchReport:
    """Describe files side by side and add each to an index as soon as it is done.

    A file that raises, hangs or kills its process is reported, and the others go on. This process alone writes: after
    Ctrl-C or a kill the same call does only what is left. A file that the index has with the same content and recipes
    is skipped, one whose content has changed is replaced in one step.

    Parameters
    ----------
    index : ShapeIndex
    items : sequence of Item
    describe : callable
        From a path to descriptors of each of `recipes`; importable by name, since it runs in fresh processes.
    recipes : sequence of Recipe or PatchRecipe
        What `describe` follows.
    workers : Workers
    told : callable, optional
        Called as told(n_done, n_items, name, error or None) after each file.

    Returns
    -------
    BatchReport
        In the order of `items`, whichever was done first.

    Raises
    ------
    InvalidParameterError
        If two items have one name.
    StoreError
        If the index cannot be written.
    EigenshapeError
        If no worker can start: a script must call this under ``if __name__ == "__main__":``, since workers import it.
    """
    require_type(index, ShapeIndex, "index")
    require_type(workers, Workers, "workers")
    require_each(items, Item, "items")
    require_each(recipes, AnyRecipe, "recipes")
    _require_names(items)
    tell = told or _silent
    known = {record.name: record for record in index.records()}
    todo = [item for item in items if not _is_known(item, known.get(item.name), recipes)]
    added, failed = set(), {}
    n_done = len(items) - len(todo)
    if n_done:
        tell(n_done, len(items), "already in the index", None)
    work = partial(_described, describe, tuple(recipes))
    with closing(in_workers(work, todo, workers)) as outcomes:  # closed at once, also after Ctrl-C
        for item, outcome in outcomes:
            n_done += 1
            reason = outcome.reason if outcome.found is None else _keep(index, item, outcome.found)
            if reason is None:
                added.add(item.name)
            else:
                failed[item.name] = reason
            tell(n_done, len(items), item.name, reason)
    names = [item.name for item in items]
    return BatchReport(
        added=tuple(name for name in names if name in added),
        skipped=tuple(name for name in names if name not in added and name not in failed),
        failed=tuple((name, failed[name]) for name in names if name in failed),
    )


def learn_words(
    items: Sequence[Item], teach: Teach, *, workers: Workers = Workers(), told: Told | None = None
) -> PatchCodebook:
    """Learn the words of patches from files side by side; a small collection takes words that come with the library.

    At most 100 files teach, those whose names have the lowest hashes; the same whatever their order. Those that cannot
    be taken are passed over: `build_index` will name them.

    Parameters
    ----------
    items : sequence of Item
    teach : callable
        From a path to the patches of a shape and of some views of it; importable by name.
    workers : Workers
    told : callable, optional
        As in `build_index`.

    Returns
    -------
    PatchCodebook
        Of `made_codebook` where there are fewer than 40 files, or fewer that can be taken.

    Raises
    ------
    EigenshapeError
        As `build_index`, if no worker can start.
    """
    require_type(workers, Workers, "workers")
    require_each(items, Item, "items")
    if len(items) < FEWEST_TEACHERS:
        return made_codebook()
    tell = told or _silent
    teachers = sorted(items, key=lambda item: sha256(item.name.encode()).digest())[:MOST_TEACHERS]
    lessons: dict[str, Sequence[Patches]] = {}
    with closing(in_workers(teach, teachers, workers)) as outcomes:
        for number, (item, outcome) in enumerate(outcomes):
            if outcome.found is not None:
                lessons[item.name] = outcome.found
            tell(number + 1, len(teachers), item.name, None)
    if len(lessons) < FEWEST_TEACHERS:
        return made_codebook()
    return train_codebook([patches for item in teachers for patches in lessons.get(item.name, ())])


def _require_names(items: Sequence[Item]) -> None:
    paths: dict[str, Path] = {}
    for item in items:
        if item.name in paths:
            raise InvalidParameterError(
                f"Items must have different names; {item.name!r} is both {paths[item.name]} and {item.path}."
            )
        paths[item.name] = item.path


def _described(describe: Describe, recipes: tuple[AnyRecipe, ...], path: Path) -> _Described:
    """Describe a file, in a worker."""
    digest = content_digest(
        path
    )  # before it is read: a file that changes meanwhile is done again next time
    descriptors = tuple(describe(path))
    _require_described(descriptors, recipes)
    return _Described(digest, descriptors)


def _require_described(descriptors: tuple[Descriptor, ...], recipes: tuple[AnyRecipe, ...]) -> None:
    for found in descriptors:
        if not isinstance(found, get_args(Descriptor)):
            raise InvalidParameterError(
                f"A describer must return descriptors; it returned {type(found).__name__}."
            )
    there = {found.recipe for found in descriptors}
    for recipe in recipes:
        if recipe not in there:
            raise InvalidParameterError(
                f"A describer must follow every recipe; {recipe.name!r} has no descriptor."
            )


def _keep(index: ShapeIndex, item: Item, found: _Described) -> str | None:
    """Add a shape; the reason, where the index does not take it."""
    known = {"label": item.label, "source": str(item.path.absolute()), "digest": found.digest}
    try:
        index.add(item.name, found.descriptors, **known, replace=True)
    except InvalidParameterError as err:
        return str(err)
    return None


def content_digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def _is_known(item: Item, record: Record | None, recipes: Sequence[AnyRecipe]) -> bool:
    if record is None or not set(recipes) <= set(record.recipes):
        return False
    try:
        return content_digest(item.path) == record.digest
    except OSError:  # a worker will say so
        return False


def _silent(n_done: int, n_items: int, name: str, error: str | None) -> None:
    """Tell nobody."""
