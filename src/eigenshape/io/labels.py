"""Files of whole numbers: labels of faces (.seg, .json or .ply), or corresponding vertices."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from eigenshape._errors import FileFormatError
from eigenshape._files import read_regular, replace_file
from eigenshape.io.formats.ply import parse_labels
from eigenshape.io.formats.text import INT64, Line, lines_of, quote_line, whole, whole_table

KEY = "face_labels"
LABEL = ("A label", "the label of one face")
VERTEX = ("A vertex", "the number of one vertex")


def read_labels(path: Path) -> Int[np.ndarray, " f"]:
    """Read one label per face.

    A file has one label a line, the list "face_labels" in .json, or the property `label` in .ply.

    Raises
    ------
    FileFormatError
        If a line or an entry is not a whole number, or if there is no such list.
    OSError
        If the system cannot open the file.
    """
    data = read_regular(path, "labels")
    try:
        suffix = path.suffix.lower()
        if suffix == ".ply":
            return parse_labels(data)
        return _from_json(data) if suffix == ".json" else _from_lines(lines_of(data), LABEL)
    except FileFormatError as err:
        raise type(err)(f"{path}: {err}") from err


def read_map(path: Path) -> Int[np.ndarray, " n"]:
    """Read the corresponding vertex of another shape for each vertex, one a line, from 0.

    Raises
    ------
    FileFormatError
        If a line is not a whole number.
    OSError
        If the system cannot open the file.
    """
    data = read_regular(path, "vertices that correspond")
    try:
        return _from_lines(lines_of(data), VERTEX)
    except FileFormatError as err:
        raise type(err)(f"{path}: {err}") from err


def write_labels(labels: Int[np.ndarray, " f"], path: Path) -> None:
    """Write one label a line; the file appears complete or not at all."""
    replace_file(path, "".join(f"{label}\n" for label in labels.tolist()).encode())


def _from_lines(lines: list[Line], words: tuple[str, str]) -> Int[np.ndarray, " f"]:
    table = whole_table(lines)
    if table is not None and table.shape[1] == 1:
        return table[:, 0]
    several = next((line for line in lines if len(line[1].split()) > 1), None)
    if several:
        raise FileFormatError(
            f"A line must hold {words[1]}; line {several[0]} is {quote_line(several)}."
        )
    return np.array([whole(line[1], line, words[0]) for line in lines], dtype=np.int64)


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
