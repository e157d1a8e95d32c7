"""Find the shapes of folders, with what is known of them."""

import csv
import os
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from hashlib import sha256
from math import isfinite
from pathlib import Path
from typing import Any

from certeig.kit.arrays import whole_number
from certeig.kit.errors import FileFormatError, InvalidParameterError
from certeig.kit.files import as_path, read_regular, require_lines
from certeig.kit.typing import Integer
from eigenshape._sealed import StoreWarning
from eigenshape._workers import Item
from eigenshape.io.formats.registry import (
    GZ,
    HEMISPHERES,
    POINT_FORMATS,
    SHAPE_FORMATS,
    signed_suffix,
    suffix_in,
)

NAME, LABEL, TAGS = "name", "label", "tags"  # columns of a table of labels; others are attributes


def find_items(
    sources: str | Path | Sequence[str | Path],
    *,
    labels: str | Path | None = None,
    part: tuple[Integer, Integer] | None = None,
) -> list[Item]:
    """Find the files of meshes and of points in folders and in the folders in them.

    Links to folders are followed, and each folder is searched once.
    A shape is named by its path below the given folder, without the suffix of the file unless two
    files differ only in the suffix. Surfaces of FreeSurfer without one, such as lh.pial, are found
    by their first bytes. Points beside a mesh of the same name, such as its landmarks,
    are left out. The class of a shape is the name of the folder that holds it; a file that lies
    directly in the given folder, or is given itself, has none.

    Parameters
    ----------
    sources : path, or sequence of paths
        Folders, and files of the formats of `read_shape`.
    labels : path, optional
        Table of comma-separated values with a header. The column ``name`` holds names of shapes or
        paths of files below the folder. ``label`` is the class, ``tags`` are separated by
        semicolons, and every other column is an attribute, a number where the text is one. Empty
        cells are left out. The table may name shapes of a larger collection.
    part : pair of int, optional
        ``(i, n)``: only part i of n, counted from 1, so that n jobs share the work. The name of a
        shape determines its part, so the jobs need not communicate.

    Returns
    -------
    list of Item
        Sorted by path within each folder.

    Warns
    -----
    StoreWarning
        If the table names shapes that are not there: how many, and the first of them.

    Raises
    ------
    InvalidParameterError
        If two shapes have the same name, there is no file, or there is no such part.
    FileFormatError
        If the table has no column ``name``, or names none of the shapes.
    OSError
        If a source does not exist, or the table cannot be read.

    See Also
    --------
    eigenshape.retrieval.build_index : Describe them, and add them to an index.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> (folder / "cats").mkdir()
    >>> es.write_mesh(es.icosphere(1), folder / "cats" / "felix.ply")
    >>> item, = es.io.find_items(folder)
    >>> item.name, item.label
    ('cats/felix', 'cats')
    """
    folders = [sources] if isinstance(sources, str | Path) else sources
    if not isinstance(folders, Iterable):  # None, a number: `as_path` names it
        folders = [folders]
    items = [item for source in folders for item in _items_of(as_path(source, "sources"))]
    if not items:
        raise InvalidParameterError(
            f"Folders of shapes must hold meshes or points ({', '.join(SHAPE_FORMATS)}); "
            f"{', '.join(map(str, folders)) or 'an empty list'} holds none."
        )
    # A file that is given twice counts once.
    by_name: dict[str, Item] = {}
    for item in items:
        other = by_name.setdefault(item.name, item)
        if other.path != item.path:
            raise InvalidParameterError(
                f"Names of shapes must differ; {item.name!r} is the name of both {other.path} and "
                f"{item.path}. Give one folder that holds both."
            )
    items = list(by_name.values())
    if labels is not None:
        items = _labeled(items, Path(labels))
    return items if part is None else _part_of(items, part)


def _items_of(source: Path) -> Iterator[Item]:
    if not source.is_dir():
        # raises OSError for a folder that is misspelled, before anything is described
        source.stat()
        known = suffix_in(source.name) in SHAPE_FORMATS
        yield Item(_stem(source).name if known else source.name, source)
        return
    # The whole name of a surface of FreeSurfer, such as lh.pial, says what it is.
    stem_of = {
        path: _stem(path) if suffix_in(path.name) in SHAPE_FORMATS else path
        for path in sorted(_files_below(source))
        if suffix_in(path.name) in SHAPE_FORMATS
        or (path.name.startswith(HEMISPHERES) and signed_suffix(path) in SHAPE_FORMATS)
    }
    meshes = {stem for path, stem in stem_of.items() if suffix_in(path.name) not in POINT_FORMATS}
    paths = [
        path
        for path, stem in stem_of.items()
        if suffix_in(path.name) not in POINT_FORMATS or stem not in meshes
    ]
    stems = Counter(stem_of[path] for path in paths)
    for path in paths:
        named = path if stems[stem_of[path]] > 1 else stem_of[path]
        below = named.relative_to(source)
        yield Item(below.as_posix(), path, below.parent.name or None)


def _stem(path: Path) -> Path:
    """Return the path of a file without the suffix of its format, and without that of a packed one."""
    packed = path.name.lower().endswith(GZ)
    return (path.with_suffix("") if packed else path).with_suffix("")


def _files_below(folder: Path) -> Iterator[Path]:
    """List all files in a folder and below; links are followed, and no folder is entered twice."""
    entered: set[str] = set()
    waiting = [folder]
    # Links wait until the rest is done: a folder that has a path of its own is named by that path.
    while waiting:
        for place, folders, files in os.walk(waiting.pop(0)):
            real = os.path.realpath(place)
            if real in entered:
                folders.clear()
                continue
            entered.add(real)
            here = Path(place)
            folders.sort()
            waiting += [here / name for name in folders if (here / name).is_symlink()]
            yield from (here / name for name in files)


def _part_of(items: Sequence[Item], part: tuple[Integer, Integer]) -> list[Item]:
    if not isinstance(part, tuple | list) or len(part) != 2:
        raise InvalidParameterError(f"part must be a pair (i, n); it is {part!r}.")
    count = whole_number(part[1], "The number of parts", 1)
    number = whole_number(part[0], "The number of a part", 1, count)
    return [
        item
        for item in items
        if int.from_bytes(sha256(item.name.encode()).digest()) % count == number - 1
    ]


def _labeled(items: Sequence[Item], table: Path) -> list[Item]:
    rows = _read_table(table)
    by_name = {item.name: item for item in items}
    # a name with the suffix of its file is as good
    by_name |= {item.name + item.path.suffix: item for item in items}
    labeled = {}
    absent = []
    for line, row in rows:
        item = by_name.get(row[NAME])
        if item is None:
            absent.append(f"line {line} names {row[NAME]!r}")
            continue
        facts = {key: text for key, text in row.items() if key not in (NAME, LABEL, TAGS)}
        labeled[item.name] = replace(
            item,
            label=row.get(LABEL, item.label),
            tags=tuple(tag.strip() for tag in row.get(TAGS, "").split(";") if tag.strip()),
            attributes={key: _number_or_text(text) for key, text in facts.items()},
        )
    if rows and not labeled:
        raise FileFormatError(
            f"{table} must name shapes that are there; it names none of them, and {absent[0]}. "
            f"A shape is named by its path below the given folder, such as {items[0].name!r}."
        )
    if absent:
        # A table for a whole collection serves a folder that holds a part of it.
        warnings.warn(
            f"{len(absent)} of {len(rows)} rows of {table} name no file that is there; {absent[0]}.",
            StoreWarning,
            stacklevel=3,
        )
    return [labeled.get(item.name, item) for item in items]


def _read_table(table: Path) -> list[tuple[int, dict[str, str]]]:
    """Return the lines of a table by their numbers, each as its cells that are not empty."""
    require_lines(read_regular(table, "a table"))
    try:
        with table.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            columns = reader.fieldnames or []
            rows: list[tuple[int, dict[Any, Any]]] = [(reader.line_num, row) for row in reader]
    except (UnicodeDecodeError, csv.Error) as err:
        raise FileFormatError(
            f"{table} must hold comma-separated values in UTF-8; it does not: {err}."
        ) from err
    if NAME not in columns:
        raise FileFormatError(
            f"{table} must have a column {NAME!r}; its columns are "
            f"{', '.join(map(repr, columns)) or 'none'}."
        )
    for line, row in rows:
        if not row[NAME]:
            raise FileFormatError(f"{table} must name a shape in each line; line {line} does not.")
        if None in row:
            raise FileFormatError(
                f"{table} must have {len(columns)} cells a line; line {line} has more. Put cells "
                "that hold commas in double quotes."
            )
    return [(line, {key: text for key, text in row.items() if text}) for line, row in rows]


def _number_or_text(text: str) -> float | str:
    try:
        number = float(text)
    except ValueError:
        return text
    return number if isfinite(number) else text
