"""What the studio shows at first: files, the files of a folder, the shapes of an index, or a creature."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import eigenshape as es
from eigenshape_studio.others.specimens import Specimens, is_collection
from eigenshape_studio.shape.loading import load_file
from eigenshape_studio.shape.samples import SAMPLES, sample_mesh
from eigenshape_studio.tab.history import Shape
from eigenshape_studio.tab.workspace import Workspace

MOST_LISTED = 500  # shapes that stand in the list of the page


def open_workspace(paths: Sequence[str | Path] = (), index: str | Path | None = None) -> Workspace:
    """Return what new tabs show; what is computed of its first shape is shared.

    Parameters
    ----------
    paths : sequence of paths
        Files, folders of files, or the folder of an index. The first shape is shown, and the others
        can be chosen from a list. Without any, that is a creature which the library makes. Of the
        folder of a collection, its mean is shown, and its specimens can be chosen.
    index : path, optional
        Folder of an index to search in; by default the first one among the paths.

    Raises
    ------
    FileFormatError
        If no shape can be read; those before the first readable one are left out with a note.
    InvalidParameterError
        If a folder has no shape.
    """
    found: list[tuple[str, Path]] = []
    collection: Path | None = None
    for one in paths:
        path = Path(one).absolute()
        held = _index_in(path) if path.is_dir() else None
        if held is not None:
            index = index or path
            found += _files_of(held)
        elif is_collection(path):
            collection = path
        elif path.is_dir():
            found += [(item.name, item.path.absolute()) for item in es.io.find_items(path)]
        else:
            found.append((path.name, path))
    if collection is not None:
        specimens = Specimens(collection)
        workspace = Workspace(specimens.mean, specimens.title, index=index, shared=True)
        workspace.specimens = specimens
        return workspace
    if not found:
        workspace = Workspace(sample_mesh(SAMPLES[0]), SAMPLES[0], index=index, shared=True)
        workspace.welcome = True
        return workspace
    first, notes = _open_first(found)
    listed = [
        Shape(number, name, partial(load_file, path), path=str(path))
        for number, (name, path) in enumerate(found[1:MOST_LISTED], 1)
    ]
    workspace = Workspace([first, *listed], index=index, shared=True)
    workspace.notes = notes
    return workspace


def _open_first(found: list[tuple[str, Path]]) -> tuple[Shape, list[str]]:
    """Return the first shape that can be read, and why those before it, which are removed, cannot.

    All tabs share what is computed of it; of the others each tab has its own.
    """
    notes: list[str] = []
    while True:
        name, path = found[0]
        shape = Shape(0, name, partial(load_file, path), path=str(path), shared=True)
        try:
            shape.analysis  # noqa: B018  it is read now
        except (es.EigenshapeError, OSError) as error:
            if len(found) == 1:
                raise
            notes.append(f"{name} cannot be opened: {error}")
            del found[0]
        else:
            return shape, notes


def _index_in(folder: Path) -> es.ShapeIndex | None:
    """Return the index in a folder, if there is one."""
    try:
        return es.ShapeIndex.open(folder)
    except es.StoreError:
        return None


def _files_of(index: es.ShapeIndex) -> list[tuple[str, Path]]:
    """Return names and files of the shapes of an index whose files are still there."""
    named = [(record.name, record.source) for record in index.records()]
    return [(name, Path(source)) for name, source in named if source and Path(source).exists()]
