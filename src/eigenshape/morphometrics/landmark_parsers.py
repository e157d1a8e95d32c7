"""Files of landmarks that other programs write and we only read, and what all parsers share."""

import re
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, TypeAlias
from xml.etree import ElementTree

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape.morphometrics.landmarks import Landmarks

Table: TypeAlias = dict[str, Landmarks]

MISSING = ("", "NA")  # of a number, as R, pandas and tps programs write it, beside NaN
NOT_PLACED = 9999.0  # each coordinate of a point that Landmark Editor has not placed
PLANAR = "its points are in a plane and are read with z = 0"


class Parsed(NamedTuple):
    """What a file holds: specimens, sentences on what they do not show, and units that it names."""

    specimens: Table
    notes: Iterable[str] = ()
    units: Iterable[str] = ()


def as_number(text: str) -> float:
    """Return a number, or NaN for a missing one. `float` would take 1_000 for a thousand, too."""
    if text.strip() in MISSING:
        return np.nan
    if "_" in text:
        raise FileFormatError(f"{text!r} is no number.")
    return float(text)


def filled_lines(text: str) -> list[str]:
    """Return the lines that are not empty, without spaces around them."""
    return [line.strip() for line in text.splitlines() if line.strip()]


def sections_of(text: str, heading: str) -> tuple[str, dict[str, list[str]]]:
    """Return the text before the first heading, and the lines below each, by its name."""
    head, *rest = re.split(heading, text, flags=re.MULTILINE)
    names = [name.strip().lower() for name in rest[::2]]
    return head, dict(zip(names, map(filled_lines, rest[1::2]), strict=True))


def points_of(lines: Sequence[str], n_axes: int = 3) -> np.ndarray:
    """Return the points of lines of three numbers, or of two in a plane."""
    for line in lines:
        if len(line.split()) != n_axes:
            raise FileFormatError(f"a point must have {n_axes} numbers; a line is {line!r}.")
    return np.reshape([as_number(word) for word in " ".join(lines).split()], (-1, n_axes))


def unlabeled(
    specimens: Iterable[tuple[Any, ...]], notes: Iterable[str] = (), units: Iterable[str] = ()
) -> Parsed:
    """Return specimens whose landmarks are named by their numbers.

    Each is given as its name, its points, those in a plane without z, and the rows of its curves.
    """
    found: Table = {}
    planar = []
    for name, points, *curves in specimens:
        if name in found:
            raise FileFormatError(
                f"specimens must have different names; two are {name!r}. Rename one in the file."
            )
        if points.shape[1] == 2:
            planar = [PLANAR]
            points = np.column_stack([points, 0 * points[:, 0]])  # noqa: PLW2901
        numbers = [str(row + 1) for row in range(len(points))]
        found[name] = Landmarks(numbers, points, curves=curves)
    return Parsed(found, [*planar, *notes], units)


def one_specimen(
    stem: str,
    labels: Sequence[str],
    points: np.ndarray,
    curves: Sequence[Sequence[int]] = (),
    units: Iterable[str] = (),
) -> Parsed:
    """Return the one specimen of a file; labels that occur again get a number."""
    names: dict[str, str] = {}
    for label in labels:
        name, count = label, 1
        while name in names:
            count += 1
            name = f"{label} ({count})"
        names[name] = label
    notes = []
    again = [name for name, label in names.items() if name != label]
    if again:
        notes.append(
            f"labels that occur again got numbers, {again[0]!r} and {len(again) - 1} others; points of "
            "other specimens must be in the same order"
        )
    return Parsed({stem: Landmarks(names, points, curves=curves)}, notes, units)


def parse_nts(text: str, stem: str) -> Parsed:
    """Read a matrix of NTSYS, of many specimens or of one, whose rows are landmarks."""
    lines = [line for line in filled_lines(text) if line[0] not in "\"'"]  # others are comments
    head, words = lines[0].upper().split(), " ".join(lines[1:]).split()
    shape = re.fullmatch(r"1 (\d+)(L?) (\d+)(L?) ([01])(?: (\S+))? DIM=([23])", " ".join(head))
    if shape is None:
        raise FileFormatError(
            "a file of NTSYS must begin as '1 4L 30L 0 DIM=3': a rectangular matrix, rows, columns, "
            f"missing values, axes, labels before the numbers; it begins with {lines[0]!r}."
        )
    n_rows, n_columns, n_axes = int(shape[1]), int(shape[3]), int(shape[7])
    n_labels = n_rows * bool(shape[2])
    numbers = words[n_labels + n_columns * bool(shape[4]) :]
    if len(numbers) != n_rows * n_columns or n_columns % n_axes:
        raise FileFormatError(
            f"there must be {n_rows} times {n_columns} numbers, and {n_axes} for each point; there "
            f"are {len(numbers)}. Labels must not hold spaces."
        )
    values = np.array([as_number(word) for word in numbers])
    if shape[5] == "1" and shape[6]:
        values[values == as_number(shape[6])] = np.nan
    points = values.reshape(-1, n_columns // n_axes, n_axes)
    names = words[:n_labels] or [str(row + 1) for row in range(n_rows)]
    if n_columns == n_axes:
        names, points = [stem], points.transpose(1, 0, 2)
    return unlabeled(zip(names, points, strict=True))


def parse_picked_points(text: str, stem: str) -> Parsed:
    """Read the picked points of MeshLab; one that is not active is not placed."""
    labels, places = [], []
    for row, point in enumerate(ElementTree.fromstring(text).iter("point")):
        is_placed = point.get("active", "1") != "0"
        places.append([as_number(point.attrib[axis]) if is_placed else np.nan for axis in "xyz"])
        labels.append(point.get("name", "").strip() or str(row + 1))
    return one_specimen(stem, labels, np.reshape(places, (-1, 3)))


def parse_landmark_editor(text: str, stem: str) -> Parsed:
    """Read points of Landmark Editor: a version, a number of points, then names with coordinates."""
    lines = filled_lines(text)
    if not text.lstrip().startswith("Version"):
        raise FileFormatError(
            "a .pts file of landmarks must begin with 'Version 1.0'; it does not. Points without "
            "names are read by read_shape."
        )
    rows = [line.rsplit(maxsplit=3) for line in lines[2:]]
    if lines[1] != str(len(rows)):
        raise FileFormatError(
            f"there must be as many points as the second line says; it says {lines[1]!r}, and there "
            f"are {len(rows)}."
        )
    points = points_of([" ".join(row[1:]) for row in rows])
    points[(points == NOT_PLACED).all(axis=1)] = np.nan
    return one_specimen(stem, [row[0] for row in rows], points)


def parse_amira(text: str, stem: str) -> Parsed:
    """Read a landmark set of Amira or Avizo; each further set is a specimen."""
    head, sections = sections_of(text, r"^@(\d+)\s*$")
    count = re.search(r"define\s+Markers\s+(\d+)", head)
    if "ASCII" not in head.partition("\n")[0] or count is None:
        raise FileFormatError(
            "landmarks of Amira must be text with a line 'define Markers'; they are not. Save them "
            "as Amira Landmark ASCII."
        )
    sets = re.findall(
        r"Markers\s*\{\s*(?:float|double)\[3\]\s+Coordinates\w*\s*\}\s*=?\s*@(\d+)", head
    )
    found = []
    for number, key in enumerate(sets, 1):
        points = points_of(sections[key])
        if len(points) != int(count[1]):
            raise FileFormatError(
                f"each set must have {count[1]} landmarks, as declared; @{key} has {len(points)}."
            )
        name = stem if len(sets) == 1 else f"{stem} {number}"
        found.append((name, points))
    return unlabeled(found, units=re.findall(r'Coordinates\s+"([^"]*)"', head))
