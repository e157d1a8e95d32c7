"""Files of landmarks that other programs write and we only read, and what all parsers share."""

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple, TypeAlias
from xml.etree import ElementTree

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.morphometrics.landmarks import Landmarks

Table: TypeAlias = dict[str, Landmarks]

MISSING = ("", "NA", "NaN", "nan")  # of a number, as R, pandas and tps programs write it
NOT_PLACED = 9999.0  # each coordinate of a point that Landmark Editor has not placed
PLANAR = (
    "its points are in a plane and are read with z = 0; fit_procrustes does not tell a planar form "
    "from its mirror image"
)


class Parsed(NamedTuple):
    """What a file holds: specimens, sentences on what they do not show, and the unit that it names."""

    specimens: Table
    notes: tuple[str, ...] = ()
    unit: str | None = None


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


def points_of(lines: Sequence[str], n_axes: int = 3) -> np.ndarray:
    """Return the points of lines of three numbers, or of two in a plane, which get z = 0."""
    for line in lines:
        if len(line.split()) != n_axes:
            count = "three" if n_axes == 3 else "two"
            raise FileFormatError(f"a point must have {count} numbers; a line is {line!r}.")
    rows = np.reshape([as_number(word) for line in lines for word in line.split()], (-1, n_axes))
    return np.column_stack([rows, 0 * rows[:, 0]]) if n_axes == 2 else rows


def numbered(points: np.ndarray, curves: Sequence[Sequence[int]] = ()) -> Landmarks:
    """Return landmarks that are named by their numbers."""
    return Landmarks([str(row + 1) for row in range(len(points))], points, curves=curves)


def by_name(names: Sequence[str], found: Iterable[Landmarks]) -> Table:
    """Return specimens by name; raise an error if two have the same."""
    for row, name in enumerate(names):
        if name in names[:row]:
            raise FileFormatError(
                f"specimens must have different names; two are {name!r}. Rename one in the file."
            )
    return dict(zip(names, found, strict=True))


def one_specimen(
    stem: str,
    labels: Sequence[str],
    points: np.ndarray,
    curves: Sequence[Sequence[int]] = (),
    semilandmarks: int = 0,
    unit: str | None = None,
) -> Parsed:
    """Return the one specimen of a file; labels that occur again get a number."""
    names: dict[str, int] = {}
    notes = []
    for row, label in enumerate(labels):
        name, count = label, 1
        while name in names:
            count += 1
            name = f"{label} ({count})"
        names[name] = row
    again = [name for name, label in zip(names, labels, strict=True) if name != label]
    if again:
        notes.append(
            f"labels that occur again got numbers, {again[0]!r} and {len(again) - 1} others; points of "
            "other specimens must be in the same order"
        )
    if semilandmarks:
        notes.append(
            f"semilandmarks (description Semi, {semilandmarks} points) are read like all others; "
            "fit_procrustes lets points slide that its curves= or normals= name"
        )
    return Parsed({stem: Landmarks(names, points, curves=curves)}, tuple(notes), unit)


def is_semilandmark(description: str) -> bool:
    """Return whether SlicerMorph calls a point so, which merges lists of fixed points and of these."""
    return description.strip().lower() == "semi"


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
    labels = words[:n_rows] if shape[2] else [str(row + 1) for row in range(n_rows)]
    numbers = words[n_rows * bool(shape[2]) + n_columns * bool(shape[4]) :]
    if len(numbers) != n_rows * n_columns or n_columns % n_axes:
        raise FileFormatError(
            f"there must be {n_rows} times {n_columns} numbers, and {n_axes} for each point; there "
            f"are {len(numbers)}. Labels must not hold spaces."
        )
    values = np.array([as_number(word) for word in numbers])
    if shape[5] == "1" and shape[6]:
        values[values == as_number(shape[6])] = np.nan
    points = values.reshape(-1, n_axes)
    if n_axes == 2:
        points = np.column_stack([points, 0 * points[:, 0]])
    notes = (PLANAR,) * (n_axes == 2)
    if n_columns == n_axes:
        return Parsed({stem: numbered(points)}, notes)
    return Parsed(by_name(labels, map(numbered, points.reshape(n_rows, -1, 3))), notes)


def parse_picked_points(text: str, stem: str) -> Parsed:
    """Read the picked points of MeshLab; one that is not active is not placed."""
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as err:
        raise FileFormatError(
            f"picked points of MeshLab must be XML; they are not: {err}."
        ) from err
    labels, places = [], []
    for row, point in enumerate(root.iter("point")):
        is_placed = point.get("active", "1") != "0"
        places.append([as_number(point.attrib[axis]) if is_placed else np.nan for axis in "xyz"])
        labels.append(point.get("name", "").strip() or str(row + 1))
    return one_specimen(stem, labels, np.reshape(places, (-1, 3)))


def parse_landmark_editor(text: str, stem: str) -> Parsed:
    """Read points of Landmark Editor: a version, a number of points, then names with coordinates."""
    lines = filled_lines(text)
    if not lines or not lines[0].startswith("Version"):
        raise FileFormatError(
            "a .pts file of landmarks must begin with 'Version 1.0'; it does not. Points without "
            "names are read by read_shape."
        )
    words = [line.split() for line in lines[2:]]
    if lines[1] != str(len(words)):
        raise FileFormatError(
            f"there must be as many points as the second line says; it says {lines[1]!r}, and there "
            f"are {len(words)}."
        )
    labels = [" ".join(row[:-3]) or str(number + 1) for number, row in enumerate(words)]
    points = points_of([" ".join(row[-3:]) for row in words])
    points[(points == NOT_PLACED).all(axis=1)] = np.nan
    return one_specimen(stem, labels, points)


def parse_amira(text: str, stem: str) -> Parsed:
    """Read a landmark set of Amira or Avizo; each further set is a specimen."""
    head, *sections = re.split(r"^@(\d+)[ \t]*$", text, flags=re.MULTILINE)
    count = re.search(r"define\s+Markers\s+(\d+)", head)
    if "ASCII" not in head.partition("\n")[0] or count is None:
        raise FileFormatError(
            "landmarks of Amira must be text with a line 'define Markers'; they are not. Save them "
            "as Amira Landmark ASCII."
        )
    body = dict(zip(sections[::2], sections[1::2], strict=True))
    sets = re.findall(
        r"Markers\s*\{\s*(?:float|double)\[3\]\s+Coordinates\w*\s*\}\s*=?\s*@(\d+)", head
    )
    found = []
    for key in sets:
        points = points_of(filled_lines(body[key]))
        if len(points) != int(count[1]):
            raise FileFormatError(
                f"each set must have {count[1]} landmarks, as declared; @{key} has {len(points)}."
            )
        found.append(numbered(points))
    names = [stem] if len(sets) == 1 else [f"{stem} {row + 1}" for row in range(len(sets))]
    unit = re.search(r'Coordinates\s+"([^"]*)"', head)
    return Parsed(by_name(names, found), unit=unit[1] if unit else None)
