"""Labels of faces, and maps between vertices, in files."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from certeig.kit.errors import FileFormatError
from certeig.kit.files import read_regular, replace_file
from eigenshape.io.formats.numbers import INT64, lines_of, whole, whole_table
from eigenshape.io.formats.ply import parse_labels
from eigenshape.io.formats.registry import PARCEL_FORMATS, suffix_in
from eigenshape.io.opening import naming

LABEL_SUFFIXES = (".seg", ".txt", ".json")  # of files of labels, in the order of search
KEY = "face_labels"


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


def read_labels(path: Path) -> Int[np.ndarray, " f"]:
    """Read one label per face.

    A file has one label a line, the list "face_labels" in .json, or the property `label` in .ply.

    Raise FileFormatError if a line or an entry is not a whole number, if there is no such list, or if
    the file holds labels of vertices, and OSError if the system cannot open the file.
    """
    if suffix_in(path.name) in PARCEL_FORMATS:
        raise FileFormatError(
            f"Labels must be those of faces; {path} holds parcels of vertices. Write "
            "es.io.read_parcellation(path, mesh).labels[mesh.faces[:, 0]] to a .txt file, one a line."
        )
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
