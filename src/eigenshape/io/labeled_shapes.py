"""Labels of faces, and maps between vertices, in files; meshes with labels beside them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from certeig.kit.errors import FileFormatError
from certeig.kit.files import as_path, read_regular, replace_file
from eigenshape.io.formats.numbers import INT64, lines_of, whole, whole_table
from eigenshape.io.formats.ply import parse_labels
from eigenshape.io.formats.registry import MESH_FORMATS
from eigenshape.io.mesh_files import read_mesh
from eigenshape.io.opening import naming
from eigenshape.retrieval.labels.labeled_shape import LabeledShape

LABEL_SUFFIXES = (".seg", ".txt", ".json")  # of files of labels, in the order of search
KEY = "face_labels"
NAMES_FILE = "names.txt"  # in a folder of labeled shapes: the name of label k in line k + 1


def find_labels(path: Path) -> Path:
    """Return the file with the labels of a mesh: beside it, or a PLY file itself.

    Raise FileFormatError if there is no such file.
    """
    files = [path.with_suffix(suffix) for suffix in LABEL_SUFFIXES]
    for beside in files:
        if beside.exists():
            return beside
    if path.suffix.lower() == ".ply":
        return path
    names = ", ".join(beside.name for beside in files)
    raise FileFormatError(
        f"{path} must have labels beside it, in one of the files {names}; there is none. "
        "Write one label a line, as `eigenshape segment -o` does."
    )


def read_labeled_shape(path: str | Path, labels: str | Path | None = None) -> LabeledShape:
    r"""Read a mesh and the labels of its faces.

    Parameters
    ----------
    path : path
        A mesh, in any format of `read_mesh`.
    labels : path, optional
        One label a line (``.seg``, ``.txt``), the list ``face_labels`` (``.json``), or the property
        ``label`` of faces (``.ply``). By default the file of one of these kinds that lies beside
        the mesh and has its name, or the mesh itself if it is a PLY file.

    Returns
    -------
    LabeledShape

    Raises
    ------
    FileFormatError
        If there are no labels, or a label is not a whole number.
    InvalidParameterError
        If there is not one label for each face.
    OSError
        If a file cannot be read.

    See Also
    --------
    read_labeled_shapes, es.transfer_labels

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> es.write_mesh(es.icosphere(1), folder / "ball.off")
    >>> _ = (folder / "ball.seg").write_text("3\n" * 80)
    >>> set(es.io.read_labeled_shape(folder / "ball.off").labels.tolist())
    {3}
    """
    path = as_path(path)
    found = find_labels(path) if labels is None else Path(labels)
    return LabeledShape(read_mesh(path), read_labels(found))


def read_labeled_shapes(folder: str | Path) -> dict[str, LabeledShape]:
    """Read all labeled shapes of a folder, for `transfer_labels`.

    Each mesh has its labels beside it, as `read_labeled_shape` takes them. Equal labels must mean
    the same on all shapes of the folder.

    Parameters
    ----------
    folder : path

    Returns
    -------
    dict of str to LabeledShape
        By the name of the file without its suffix, in the order of names.

    Raises
    ------
    FileFormatError
        If there is no mesh in the folder, or as in `read_labeled_shape`.
    OSError
        If the folder or a file cannot be read.

    See Also
    --------
    read_label_names, es.transfer_labels

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> fish = es.make_creature("fish", n_vertices=500)
    >>> es.write_mesh(fish, folder / "fish.ply", face_labels=es.find_parts(fish).parts.labels)
    >>> library = es.io.read_labeled_shapes(folder)
    >>> other = es.make_creature("fish", 1, n_vertices=500)
    >>> found = es.transfer_labels(list(library.values()), other)
    >>> found.labels.shape == (other.n_faces,)
    True
    """
    return {
        path.stem: read_labeled_shape(path)
        for path in find_labeled_shapes(as_path(folder, "folder"))
    }


def find_labeled_shapes(folder: Path) -> list[Path]:
    """Return the meshes of a folder, sorted by name; raise FileFormatError if there are none."""
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in MESH_FORMATS)
    if not paths:
        raise FileFormatError(
            f"A folder of labeled shapes must hold a mesh; {folder} holds none. "
            f"Formats: {', '.join(MESH_FORMATS)}."
        )
    return paths


def read_label_names(folder: str | Path) -> list[str]:
    r"""Read the names of labels from the file ``names.txt`` of a folder of labeled shapes.

    Parameters
    ----------
    folder : path

    Returns
    -------
    list of str
        The name of label 0, of label 1, and so on; empty if there is no such file.

    See Also
    --------
    read_labeled_shapes

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> _ = (folder / "names.txt").write_text("torso\nleg\n")
    >>> es.io.read_label_names(folder)
    ['torso', 'leg']
    """
    path = as_path(folder, "folder") / NAMES_FILE
    if not path.exists():
        return []
    return [line.strip() for line in path.read_text(encoding="utf-8").splitlines()]


def read_labels(path: Path) -> Int[np.ndarray, " f"]:
    """Read one label per face.

    A file has one label a line, the list "face_labels" in .json, or the property `label` in .ply.

    Raise FileFormatError if a line or an entry is not a whole number, or if there is no such list,
    and OSError if the system cannot open the file.
    """
    data, suffix = read_regular(path, "labels"), path.suffix.lower()
    with naming(path):
        if suffix == ".ply":
            return parse_labels(data)
        return _from_json(data) if suffix == ".json" else _from_lines(data, "A label")


def read_map(path: Path) -> Int[np.ndarray, " n"]:
    """Read the corresponding vertex of another shape for each vertex, one a line, from 0.

    Raise FileFormatError if a line is not a whole number, and OSError if the system cannot open the
    file.
    """
    data = read_regular(path, "vertices that correspond")
    with naming(path):
        return _from_lines(data, "A vertex")


def write_labels(labels: Int[np.ndarray, " f"], path: Path) -> None:
    """Write one label a line; the file appears complete or not at all."""
    replace_file(path, "".join(f"{label}\n" for label in labels.tolist()).encode())


def _from_lines(data: bytes, what: str) -> Int[np.ndarray, " f"]:
    lines = lines_of(data)
    table = whole_table(lines)
    if table is not None and table.shape[1] == 1:
        return table[:, 0]
    return np.array([whole(line[1], line, what) for line in lines], dtype=np.int64)


def _from_json(data: bytes) -> Int[np.ndarray, " f"]:
    try:
        found: Any = json.loads(data)
    except (ValueError, RecursionError) as err:
        raise FileFormatError(
            f"A .json file of labels must hold JSON; it does not: {err}."
        ) from err
    labels = found.get(KEY) if isinstance(found, dict) else None
    if not isinstance(labels, list):
        raise FileFormatError(
            f'A .json file of labels must have a list "{KEY}", as `eigenshape segment --json` has.'
        )
    for place, label in enumerate(labels):
        if type(label) is not int or not -INT64 <= label < INT64:
            raise FileFormatError(
                f"Labels must be whole numbers of 64 bits; that of face {place} is {label!r}."
            )
    return np.array(labels, dtype=np.int64)
