"""Folders of shapes: what one holds, and which of them a page may open."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import eigenshape as es
from eigenshape_studio.calls import RequestError
from eigenshape_studio.others.specimens import is_collection

MOST_LISTED = 500  # shapes that stand in the list of the page


@dataclass(frozen=True)
class Found:
    """What a path stands for.

    Attributes
    ----------
    files : list of (name, path)
    index : path, optional
        The path, if it is the folder of an index; the files are then those of its shapes.
    collection : path, optional
        The path, if it is the folder of a collection.
    """

    files: list[tuple[str, Path]] = field(default_factory=list)
    index: Path | None = None
    collection: Path | None = None


def look_in(path: Path) -> Found:
    """Return what a file, a folder of files, an index or a collection holds.

    Raises
    ------
    InvalidParameterError
        If a folder has no shape.
    """
    if not path.is_dir():
        return Found([(path.name, path)])
    index = _index_in(path)
    if index is not None:
        sources = [(record.name, record.source) for record in index.records()]
        # A file may have gone since it was indexed.
        there = [(name, Path(one)) for name, one in sources if one and Path(one).exists()]
        return Found(there, index=path)
    if is_collection(path):
        return Found(collection=path)
    return Found([(item.name, item.path.absolute()) for item in es.io.find_items(path)])


def _index_in(folder: Path) -> es.ShapeIndex | None:
    """Return the index in a folder, if there is one."""
    try:
        return es.ShapeIndex.open(folder)
    except es.StoreError:
        return None


class Folders:
    """The folders that a page may open: those in one folder of this machine.

    Parameters
    ----------
    root : Path
    """

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()

    def path(self, place: str) -> Path:
        """Return a folder by its path from the root.

        Raises
        ------
        RequestError
            If it is none, or lies elsewhere.
        """
        try:
            path = (self.root / place).resolve()
            if path.is_relative_to(self.root) and path.is_dir():
                return path
        except (OSError, ValueError):  # a name that no file can have
            pass
        raise RequestError(f"A folder must be in {self.root}; {place[:80]!r} is none there.")

    def list(self, place: str) -> np.ndarray:
        """Return what is in a folder, as the bytes of JSON.

        There is its path, the number of files of shapes in it, and the name and kind of each folder
        in it: "index", "collection" or "folder".
        """
        path = self.path(place)
        suffixes = tuple(es.io.SHAPE_FORMATS)
        names = sorted((one for one in path.iterdir() if one.name[0] != "."), key=_order)
        found = {
            "path": str(path),
            "n_files": sum(one.name.lower().endswith(suffixes) for one in names),
            "folders": [[one.name, _kind(one)] for one in names if one.is_dir()],
        }
        return np.frombuffer(json.dumps(found).encode(), np.uint8)


def _order(path: Path) -> str:
    return path.name.lower()


def _kind(folder: Path) -> str:
    """Return what a folder seems to be, without opening it."""
    if (folder / "index.sqlite").is_file():
        return "index"
    return "collection" if is_collection(folder) else "folder"
