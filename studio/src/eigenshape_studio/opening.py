"""What the studio shows at first: files, the files of a folder, the shapes of an index, or a creature."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import eigenshape as es
from eigenshape_studio.analysis import Analysis
from eigenshape_studio.history import Shape
from eigenshape_studio.loading import load_file
from eigenshape_studio.workspace import Workspace

MOST_LISTED = 500  # shapes that stand in the list of the page


def open_workspace(
    shapes: es.types.MeshLike | Sequence[str | Path] = (), index: str | Path | None = None
) -> Workspace:
    """Return what new tabs show; what is computed of its first shape is shared.

    Parameters
    ----------
    shapes : MeshLike or sequence of paths
        Files, folders of files, or the folder of an index. The first shape is shown, and the others
        can be chosen from a list. Without any, that is a creature which the library makes.
    index : path, optional
        Folder of an index to search in; by default the first one among the paths.

    Raises
    ------
    FileFormatError
        If the first shape cannot be read.
    InvalidParameterError
        If a folder has no shape.
    """
    if not isinstance(shapes, Sequence) or not all(isinstance(one, str | Path) for one in shapes):
        return Workspace(shapes, index=index, shared=True)
    folders = [Path(one) for one in shapes if Path(one).is_dir()]
    opened = {folder: found for folder in folders if (found := _index_in(folder)) is not None}
    index = index or next(iter(opened), None)
    found = []
    for one in shapes:
        path = Path(one).absolute()
        if Path(one) in opened:
            found += list(_files_of(opened[Path(one)]))
        elif path.is_dir():
            found += [(item.name, item.path.absolute()) for item in es.io.find_items(path)]
        else:
            found.append((path.name, path))
    if not found:
        creature = es.make_creature("quadruped", n_vertices=2500)
        return Workspace(creature, "quadruped", index=index, shared=True)
    # All tabs share what is computed of the first one; of the others each tab has its own.
    makers = [partial(Analysis, shared=True)] + [Analysis] * len(found)
    listed = [
        Shape(number, name, partial(load_file, path), make, str(path))
        for number, ((name, path), make) in enumerate(
            zip(found[:MOST_LISTED], makers, strict=False)
        )
    ]
    return Workspace(listed, index=index, shared=True)


def _index_in(folder: Path) -> es.ShapeIndex | None:
    """Return the index in a folder, if there is one."""
    try:
        return es.ShapeIndex.open(folder)
    except es.StoreError:
        return None


def _files_of(index: es.ShapeIndex) -> Iterator[tuple[str, Path]]:
    """Find the files of the shapes of an index that are still there."""
    for record in index.records():
        if record.source is not None and Path(record.source).exists():
            yield record.name, Path(record.source)
