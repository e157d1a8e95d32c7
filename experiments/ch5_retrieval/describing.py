"""Descriptors made in worker processes and kept in a folder, so that nothing is described twice."""

import hashlib
import multiprocessing
import os
import pickle
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

from draws import Shape, Version, make
from methods import Method, Trainable
from real_shapes import DATA
from rich.progress import Progress
from threadpoolctl import threadpool_limits

import eigenshape as es

MAKING = tuple(Path(__file__).with_name(name) for name in ("draws.py", "perturbing.py"))


@dataclass(frozen=True)
class Failure:
    """Why there is no descriptor."""

    reason: str


@cache
def digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


@dataclass(frozen=True)
class Store:
    """A folder of descriptors, each under a hash of its method, of its shape's file, and of how versions are made."""

    folder: Path

    def path(self, method: Method, version: Version) -> Path:
        """Return where a descriptor lies."""
        sources = digest(DATA / version.shape.path), *map(digest, MAKING), version_of("eigenshape")
        what = (*sources, method, version.kind, version.seed, version.shape.number, version.change)
        return self.folder / hashlib.sha256(repr(what).encode()).hexdigest()

    def lesson(
        self, method: Trainable, shapes: Sequence[Shape], learn: Callable[[], Method]
    ) -> Method:
        """Return a method that has learnt from complete shapes, as it was kept; else let it learn, and keep it."""
        sources = [digest(DATA / shape.path) for shape in shapes]
        what = ("lesson", *sources, *map(digest, MAKING), version_of("eigenshape"), method)
        path = self.folder / hashlib.sha256(repr(what).encode()).hexdigest()
        if not path.exists():
            self.folder.mkdir(parents=True, exist_ok=True)
            keep(path, learn())
        return pickle.loads(path.read_bytes())

    def load(self, method: Method, version: Version) -> Any:
        """Return a descriptor, or its Failure."""
        return pickle.loads(self.path(method, version).read_bytes())

    def save(self, method: Method, version: Version, descriptor: Any) -> None:
        """Keep a descriptor."""
        keep(self.path(method, version), descriptor)


def keep(path: Path, what: Any) -> None:
    """Write a file whole or not at all."""
    beside = path.with_suffix(f".{os.getpid()}")
    beside.write_bytes(pickle.dumps(what))
    beside.replace(path)


def describe_all(
    store: Store, methods: Sequence[Method], versions: Sequence[Version], workers: int
) -> dict[str, str]:
    """Describe what the store lacks, side by side, and name whatever cannot be made or described, with the reason."""
    store.folder.mkdir(parents=True, exist_ok=True)
    lacking = {
        version: [method for method in methods if not store.path(method, version).exists()]
        for version in versions
    }
    todo = {version: missing for version, missing in lacking.items() if missing}
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(
        max(min(workers, len(todo)), 1), context, initializer=threadpool_limits, initargs=(1,)
    )
    with Progress() as bar, pool:
        task = bar.add_task("describing", total=len(versions), completed=len(versions) - len(todo))
        futures: list[Future[None]] = [
            pool.submit(describe_one, store, missing, version) for version, missing in todo.items()
        ]
        try:
            for future in as_completed(futures):
                future.result()
                bar.advance(task)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    found = (
        (version, method, store.load(method, version)) for version in versions for method in methods
    )
    return {
        f"{version.name} (draw {version.seed}), {method.name}": entry.reason
        for version, method, entry in found
        if isinstance(entry, Failure)
    }


def describe_one(store: Store, methods: Sequence[Method], version: Version) -> None:
    """Make a version once, and describe it by every method."""
    try:
        mesh = make(version)
    except es.EigenshapeError as error:
        for method in methods:
            store.save(method, version, Failure(f"there is no such version: {error}"))
        return
    for method in methods:
        try:
            found = method.describe(mesh)
        except es.EigenshapeError as error:
            found = Failure(str(error))
        store.save(method, version, found)
