"""What the studio shows at first: files, the files of a folder, the shapes of an index, or a creature."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import eigenshape as es
from eigenshape_studio.others import folders
from eigenshape_studio.others.specimens import Specimens
from eigenshape_studio.shape.loading import load_file
from eigenshape_studio.shape.samples import SAMPLES, sample_mesh
from eigenshape_studio.tab.history import Shape
from eigenshape_studio.tab.workspace import Workspace


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
        there = folders.look_in(Path(one).absolute())
        found += there.files
        index = index or there.index
        collection = there.collection or collection
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
        for number, (name, path) in enumerate(found[1 : folders.MOST_LISTED], 1)
    ]
    workspace = Workspace([first, *listed], index=index, shared=True)
    workspace.notes = [*notes, *first.found.report]
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
