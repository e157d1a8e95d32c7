"""Describing files in processes of this machine or of a cluster, and adding them to an index."""

import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Callback
from certeig.kit.threads import thread_count
from eigenshape._errors import MissingExtraError
from eigenshape._workers import Item, Workers
from eigenshape.cli.console import batch_reporter, err, progress_bar
from eigenshape.cli.inputs import memory_bytes
from eigenshape.io.surface_files import read_surface
from eigenshape.retrieval.building.batch import (
    BatchReport,
    announce_learning,
    build_index,
    train_codebook_from_files,
)
from eigenshape.retrieval.heat.recipe import HeatRecipe
from eigenshape.retrieval.index import ShapeIndex
from eigenshape.retrieval.patches.codebook import PatchCodebook, default_codebook
from eigenshape.retrieval.patches.descriptor import PatchRecipe
from eigenshape.retrieval.store.filters import choose_shapes, parse_filters

# For the verbs, as they are, beside what is defined here
__all__ = ["choose_shapes", "parse_filters"]

RETRIES = 3  # workers of a cluster that a task may lose before it counts as failed


def parse_part(text: str | None) -> tuple[int, int] | None:
    """Return the numbers of a part such as "3/64"."""
    if text is None:
        return None
    found = re.fullmatch(r"(\d+)/(\d+)", text.strip())
    if found is None or not 1 <= int(found[1]) <= int(found[2]):
        raise InvalidParameterError(
            f"--part takes the number of a part and the number of parts, such as 3/64; it is {text!r}."
        )
    return int(found[1]), int(found[2])


@contextmanager
def worker_processes(
    count: int | None, timeout: float, memory: float | None, scheduler: str | None
) -> Iterator[Workers]:
    """Give the processes that describe files: of this machine, or of a Dask cluster."""
    limit = memory_bytes(memory)
    count = thread_count() if count is None else count
    if scheduler is None:
        yield Workers(count, timeout, limit)
        return
    try:
        from distributed import Client  # noqa: PLC0415 - an extra
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            "--scheduler needs dask; run: pip install 'eigenshape[cluster]'"
        ) from error
    try:
        client: Any = Client(scheduler)
    except (OSError, ValueError) as error:
        raise InvalidParameterError(
            f"--scheduler takes the address of a Dask scheduler that runs; {scheduler!r} does not "
            f"answer: {error}."
        ) from error
    with client:
        # Not pure: the same file may be described again after it has changed.
        executor: Any = client.get_executor(pure=False, retries=RETRIES)
        yield Workers(count, timeout, limit, executor)


def describe_all(
    index: ShapeIndex,
    items: Sequence[Item],
    recipe: HeatRecipe | PatchRecipe | None,
    workers: Workers,
    *,
    repairs: tuple[str, ...],
    n_views: int | None,
) -> BatchReport:
    """Build an index with a progress bar, naming each file that fails as soon as it does.

    Without a recipe, an index that has none learns a codebook.
    """
    learns = recipe is None and not index.recipes()
    with progress_bar("index") as progress:
        report = build_index(
            index,
            items,
            read_surface,
            recipes=None if recipe is None else (recipe,),
            learn=recipe is None,
            repairs=repairs,
            n_views=n_views,
            workers=workers,
            callback=batch_reporter(progress),
        )
    if learns:
        comes_along = index.default_recipe() == PatchRecipe(default_codebook())
        err.print(
            "codebook: the one that comes with eigenshape, because there are too few shapes to learn from"
            if comes_along
            else "codebook: learned from the shapes of this index"
        )
    return report


def learn_codebook(
    items: Sequence[Item],
    workers: Workers,
    repairs: tuple[str, ...],
    index: ShapeIndex | None = None,
) -> PatchCodebook:
    """Learn a codebook with a progress bar; `index stats` of an index says how far it is."""
    with progress_bar("codebook") as progress, ExitStack() as stack:
        report: Callback = batch_reporter(progress)
        if index is not None:
            report = stack.enter_context(announce_learning(index.folder, report))
        return train_codebook_from_files(
            items, read_surface, repairs=repairs, workers=workers, callback=report
        )
