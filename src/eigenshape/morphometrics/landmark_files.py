"""Files of landmarks, read and written: of 3D Slicer, of the tps programs, of Morphologika, and tables."""

import csv
import io
import json
import re
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from certeig.kit.arguments import require_type
from certeig.kit.errors import FileFormatError, InvalidParameterError
from certeig.kit.files import as_path, read_regular, replace_file, require_lines
from eigenshape._errors import count_nouns
from eigenshape.morphometrics.landmark_parsers import (
    Parsed,
    Table,
    as_number,
    filled_lines,
    one_specimen,
    parse_amira,
    parse_landmark_editor,
    parse_nts,
    parse_picked_points,
    points_of,
    sections_of,
    unlabeled,
)
from eigenshape.morphometrics.landmarks import (
    Landmarks,
    require_name,
    require_same_names,
    shared_curves,
)
from eigenshape.morphometrics.tps_files import parse_tps

SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/"
    "Schema/markups-schema-v1.0.3.json#"
)
# Slicer's coordinate systems, also as numbers of old .fcsv files. Meshes of Slicer are in LPS.
TURNED, AS_IT_IS = (-1.0, -1.0, 1.0), (1.0, 1.0, 1.0)
TO_LPS = {"LPS": AS_IT_IS, "1": AS_IT_IS, "RAS": TURNED, "0": TURNED}
FCSV_COLUMNS = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID"
# Slicer 5 adds two cells, which its header does not name: whether a point was placed, and how.
STATUS_COLUMN = 14
PLACED, NOT_PLACED = "2", ("0", "3")  # PositionDefined; PositionUndefined, PositionMissing
CSV_COLUMNS = ["specimen", "landmark", "x", "y", "z", "spread"]
CODES = (
    -1,
    -9,
    -99,
    -999,
    -9999,
    999,
    9999,
)  # that programs and people write where a point is missing
UNIT = "mm"  # of scenes and meshes of Slicer
# Names of units, as UCUM, Slicer and Amira write them, by their length in nanometers: the ratio of
# two whole numbers is rounded once
LENGTHS = {
    10**9: ("m", "meter", "metre"),
    10**7: ("cm", "centimeter", "centimetre"),
    10**6: ("mm", "millimeter", "millimetre"),
    10**3: ("um", "\u00b5m", "\u03bcm", "micron", "micrometer", "micrometre"),
    1: ("nm", "nanometer", "nanometre"),
    25_400_000: ("inch", "in", "[in_i]"),
}


def read_landmarks(path: str | Path, *, unit: str = UNIT) -> Landmarks:
    """Read the landmarks of one specimen.

    Parameters
    ----------
    path : str or Path
        Any file of `read_specimens` with one specimen, such as a `.mrk.json` file of 3D Slicer.
    unit : str, optional
        As in `read_specimens`.

    Returns
    -------
    Landmarks

    Warns
    -----
    UserWarning
        As `read_specimens`.

    Raises
    ------
    FileFormatError
        As `read_specimens`, and if the file holds several specimens.
    InvalidParameterError
        If the unit is unknown.

    See Also
    --------
    read_specimens, write_landmarks

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "skull.mrk.json")
    >>> found = es.morphometrics.Landmarks(["nasion"], [[0, 1.5, 2]])
    >>> es.morphometrics.write_landmarks(found, path)
    >>> es.morphometrics.read_landmarks(path).names
    ('nasion',)
    """
    specimens = read_specimens(path, unit=unit)
    if len(specimens) > 1:
        raise FileFormatError(
            f"{path} must hold one specimen; it holds {len(specimens)}. Read it by read_specimens."
        )
    return next(iter(specimens.values()))


def read_specimens(path: str | Path, *, unit: str = UNIT) -> dict[str, Landmarks]:
    r"""Read the landmarks of all specimens of a file, or of all files of a folder.

    - `.mrk.json` (or `.json`) and `.fcsv` of 3D Slicer, one specimen, which has the name of the file.
      Points in the system RAS are turned to LPS, in which Slicer writes meshes. Curves of `.mrk.json`
      files become `Landmarks.curves`. Points of all lists are landmarks; a label that occurs again
      gets a number.
    - `.tps`, points in space ("LM3=") or in a plane ("LM="), multiplied by "SCALE=". A specimen has
      the name of its "ID=" or "IMAGE=", or its number; landmarks, which have no names there, are
      numbered from "1" on. Points of "CURVES=" follow them, and become `Landmarks.curves`.
    - `.txt` of Morphologika; landmarks are numbered. Labels, groups and wireframes are not read.
    - `.nts` and `.dta` of NTSYS and Landmark Editor, `.pts` of Landmark Editor, `.pp` of MeshLab,
      `.landmarkAscii` of Amira and Avizo.
    - `.csv` with the columns specimen, landmark, x, y, z, and spread, if it is known.

    Parameters
    ----------
    path : str or Path
        A file, or a folder, whose files of all these formats but `.txt`, `.csv`, `.json` and `.dta`
        are read, also in the folders in it. There a file of one specimen names it by its own path
        below the folder.
    unit : str, optional
        The unit of the points that are returned: "m", "cm", "mm", "um", "nm" or "inch", that of the
        meshes. Points of files that name another one are converted to it; those of all others
        are returned as they are.

    Returns
    -------
    {str: Landmarks}
        Specimens by name, in the order of the file, all with the same landmarks. Missing points
        ("NA", or not placed) are NaN.

    Warns
    -----
    UserWarning
        If points were converted to another unit or read with z = 0, labels got numbers, outlines or
        radii are not read, or the last line has no end.

    Raises
    ------
    FileFormatError
        If the file does not follow its format, is cut off, or its specimens have different
        landmarks, or a folder holds no landmarks.
    InvalidParameterError
        If the unit is unknown, or a specimen has two files in a folder.

    See Also
    --------
    read_landmarks, write_landmarks

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "two.tps")
    >>> _ = path.write_text("LM3=1\n0 1.5 2\nID=a\nLM3=1\nNA NA NA\nID=b\n")
    >>> specimens = es.morphometrics.read_specimens(path)
    >>> specimens["a"].points.tolist(), specimens["b"].points.tolist()
    ([[0.0, 1.5, 2.0]], [[nan, nan, nan]])
    """
    path = as_path(path)
    if path.is_dir():
        found = read_folder(path, unit)
        if not found:
            raise FileFormatError(
                f"A folder of landmarks must hold files that end in {', '.join(IN_FOLDERS)}; {path} "
                "holds none."
            )
        return found
    return _read_file(path, unit, stacklevel=3)


def read_folder(folder: Path, unit: str, without: Path | None = None) -> Table:
    """Return the landmarks of all files in a folder, but not of those below another one.

    Raise InvalidParameterError if a specimen has two files, or landmarks of specimens differ.
    """
    found: Table = {}
    for path in sorted(folder.rglob("*")):
        is_output = without and without.absolute() in path.absolute().parents
        if is_output or not path.name.lower().endswith(IN_FOLDERS) or not path.is_file():
            continue
        suffix = _suffix(path, PARSERS)
        # The same suffix is that of point clouds.
        if suffix == ".pts" and not path.read_bytes().startswith(b"Version"):
            continue
        specimens = _read_file(path, unit, stacklevel=4)
        if len(specimens) == 1:
            name = path.relative_to(folder).as_posix()[: -len(suffix)]
            specimens = {name: next(iter(specimens.values()))}
        twice = found.keys() & specimens.keys()
        if twice:
            raise InvalidParameterError(
                f"A specimen must have one file of landmarks; {min(twice)!r} has two in {folder}. "
                "Move one of them elsewhere."
            )
        found |= specimens
    if found:
        require_same_names(found)
    return found


def _read_file(path: Path, unit: str, stacklevel: int) -> Table:
    """Return the specimens of a file, in a unit, and warn of what they do not show."""
    wanted = nanometers(unit)
    suffix = _suffix(path, PARSERS)
    data = read_regular(path, "landmarks")
    if not suffix.endswith(".json"):  # which may stand in one line
        require_lines(data)
    try:
        text = data.decode("utf-8-sig")
        specimens, notes, units = PARSERS[suffix](text, path.name[: -len(suffix)])
        require_same_names(specimens)
        named = next(iter(units), unit)
        ratio = nanometers(named) / wanted
    except (ValueError, csv.Error, SyntaxError) as err:  # the last one of XML
        raise FileFormatError(f"{path} must hold landmarks: {str(err)[:MOST_QUOTED]}") from err
    # JSON, or sections of Morphologika, of another structure fail in any of these ways.
    except (LookupError, TypeError, AttributeError, ArithmeticError, RecursionError) as err:
        raise FileFormatError(
            f"{path} must hold landmarks: its structure differs, {err!r}"
        ) from err
    notes = list(notes)
    points = np.concatenate([each.points for each in specimens.values()])
    if not points[:, 2].any():  # in a plane
        points = points[:, :2]
    for code in CODES:
        if count := int((points == code).all(axis=1).sum()):
            notes.append(
                f"{count_nouns(count, 'point')} with {code} for each coordinate may stand for missing "
                "ones; if so, write NA there"
            )
    if ratio != 1:
        specimens = {
            name: Landmarks(each.names, each.points * ratio, curves=each.curves)
            for name, each in specimens.items()
        }
        notes.append(f"its points are in {named} and were converted to {unit}")
    if suffix not in ENDED and not text.endswith("\n"):
        notes.append("its last line has no line break; if the file was cut off, that line is short")
    for note in notes:
        warnings.warn(f"{path}: {note}", stacklevel=stacklevel)
    return specimens


def nanometers(unit: str) -> int:
    """Return the length of a unit; raise InvalidParameterError if its name is unknown."""
    for length, names in LENGTHS.items():
        if str(unit).strip().lower() in names:
            return length
    known = ", ".join(names[0] for names in LENGTHS.values())
    raise InvalidParameterError(f"The unit of length must be one of {known}; it is {unit!r}.")


def write_landmarks(landmarks: Landmarks | Mapping[str, Landmarks], path: str | Path) -> None:
    """Write the landmarks of one specimen, or of several by name.

    Numbers are written with all their digits, so that they read back exactly. Names of landmarks
    are kept by `.mrk.json`, `.fcsv` and `.csv`, curves by `.mrk.json`, and spreads by `.csv`.

    Parameters
    ----------
    landmarks : Landmarks, or {str: Landmarks}
        Several specimens must have the same landmarks in the same order.
    path : str or Path
        Must end in `.mrk.json`, `.fcsv` (one specimen, in the system LPS), `.tps`, `.txt`
        (Morphologika) or `.csv`. Rows of a `.csv` file are in the order that `arrayspecs` of
        geomorph takes. A `.sliders.csv` file has no points but a row for each semilandmark of the
        curves, with the numbers of the point before, its own and the one after, counted from 1, as
        `gpagen(curves = )` of geomorph takes it.

    Raises
    ------
    FileFormatError
        If the name ends otherwise.
    InvalidParameterError
        If the format holds one specimen and there are several, there is none, landmarks or curves of
        specimens differ, or the name of one is empty, holds a line break, or begins with [ where
        that begins a section.
    OSError
        If the system cannot write there.

    See Also
    --------
    read_landmarks, read_specimens

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "mice.csv")
    >>> nose = es.morphometrics.Landmarks(["nose"], [[0, 1.5, 2]], spread=[0.1])
    >>> es.morphometrics.write_landmarks({"AKR": nose}, path)
    >>> print(path.read_text().strip())
    specimen,landmark,x,y,z,spread
    AKR,nose,0.0,1.5,2.0,0.1
    """
    require_type(landmarks, Landmarks | Mapping, "landmarks")
    path = as_path(path)
    suffix = _suffix(path, WRITERS)
    if isinstance(landmarks, Landmarks):
        landmarks = {path.name[: -len(suffix)]: landmarks}
    require_same_names(landmarks)
    for specimen in landmarks:
        require_name(specimen, "The name of a specimen")
        if suffix == ".txt" and specimen.startswith("["):
            raise InvalidParameterError(
                f"Names in files of Morphologika must not begin with [, as sections do; {specimen!r} does."
            )
    if suffix in OF_ONE and len(landmarks) > 1:
        raise InvalidParameterError(
            f"A {suffix} file holds one specimen; there are {len(landmarks)}. Write one file for each."
        )
    replace_file(path, WRITERS[suffix](dict(landmarks)).encode())


def _suffix(path: Path, formats: Mapping[str, object]) -> str:
    """Return the end of a name that is a format; raise an error if none is."""
    for suffix in formats:
        if path.name.lower().endswith(suffix):
            return suffix
    verb = "written" if formats is WRITERS else "read"
    raise FileFormatError(
        f"Files of landmarks that are {verb} end in {', '.join(formats)}; it is {path}."
    )


def _texts(numbers: np.ndarray) -> list[list[str]]:
    """Return rows of numbers with all their digits."""
    return [
        ["NA" if np.isnan(number) else repr(number) for number in row] for row in numbers.tolist()
    ]


def _parse_markups(text: str, stem: str) -> Parsed:
    rows: dict[tuple[str, tuple[float, ...]], int] = {}  # by label and place, of curves
    labels: list[str] = []
    places: list[tuple[float, ...]] = []
    curves = []
    units = set()
    for markup in json.loads(text)["markups"]:
        is_curve = markup.get("type") in ("Curve", "ClosedCurve")
        signs = _signs(markup.get("coordinateSystem", "LPS"))
        units.add(_unit_of(markup.get("coordinateUnits")))
        members = []
        for point in markup["controlPoints"]:
            label = str(point.get("label") or point.get("id") or len(labels) + 1).strip()
            place: tuple[float, ...] = (np.nan,) * 3
            if point.get("positionStatus", "defined") == "defined":
                if len(point["position"]) != 3:
                    raise FileFormatError(
                        f"a point must have 3 numbers; {label!r} is {point['position']}."
                    )
                pairs = zip(signs, point["position"], strict=True)
                place = tuple(sign * float(x) for sign, x in pairs)
            # Points of curves may be landmarks of another list, too: one point has one row.
            if not (is_curve and (label, place) in rows):
                rows[label, place] = len(labels)
                labels.append(label)
                places.append(place)
            members.append(rows[label, place])
        if is_curve:
            curves.append(members + members[:1] * (markup["type"] == "ClosedCurve"))
    if len(units) > 1:
        raise FileFormatError(
            f"all lists must be in one unit; they are in {' and '.join(sorted(units))}. Write one file "
            "for each."
        )
    return one_specimen(stem, labels, np.reshape(places, (-1, 3)), curves, units)


def _unit_of(entry: Any) -> str:
    """Return the unit of a list of Slicer: a text, or a code with its coding scheme and its meaning."""
    if isinstance(entry, dict):
        entry = entry.get("codeValue")
    return str((entry[0] if isinstance(entry, list) else entry) or UNIT)


def _format_markups(specimens: Table) -> str:
    (landmarks,) = specimens.values()
    places = np.nan_to_num(landmarks.points).tolist()
    statuses = np.where(np.isnan(landmarks.points[:, 0]), "undefined", "defined").tolist()
    points = [
        {"label": name, "position": places[row], "positionStatus": statuses[row]}
        for row, name in enumerate(landmarks.names)
    ]
    lists = [("Fiducial", points)]
    for curve in landmarks.curves:
        is_closed = len(curve) > 2 and curve[0] == curve[-1]
        kind = "ClosedCurve" if is_closed else "Curve"
        lists.append((kind, [points[row] for row in curve[: len(curve) - is_closed]]))
    markups = [
        {"type": kind, "coordinateSystem": "LPS", "controlPoints": listed} for kind, listed in lists
    ]
    return json.dumps({"@schema": SCHEMA, "markups": markups}, indent=1)


def _signs(system: str) -> tuple[float, float, float]:
    if system not in TO_LPS:
        raise FileFormatError(
            f"the coordinate system must be LPS or RAS; it is {system!r}. Save the list again in Slicer."
        )
    return TO_LPS[system]


def _parse_fcsv(text: str, stem: str) -> Parsed:
    head = dict(re.findall(r"^#\s*(\w+)\s*=\s*(.*?)\s*$", text, flags=re.MULTILINE))
    columns = head.get("columns", FCSV_COLUMNS).split(",")
    lines = [line for line in filled_lines(text) if not line.startswith("#")]
    names, places = [], []
    for cells in csv.reader(lines, strict=True):
        row = dict(zip(columns, cells, strict=False))
        if len(row) < len(columns):
            raise FileFormatError(f"a line must have {len(columns)} cells; one is {cells}.")
        is_placed = (cells[STATUS_COLUMN:] or [PLACED])[0] not in NOT_PLACED
        places.append([as_number(row[axis]) if is_placed else np.nan for axis in "xyz"])
        names.append(row["label"].strip() or str(len(places)))
    signs = _signs(head.get("CoordinateSystem", "RAS"))  # RAS in files that do not name theirs
    return one_specimen(stem, names, np.reshape(places, (-1, 3)) * signs)


def _format_fcsv(specimens: Table) -> str:
    (landmarks,) = specimens.values()
    places = _texts(np.nan_to_num(landmarks.points))
    statuses = np.where(np.isnan(landmarks.points[:, 0]), NOT_PLACED[1], PLACED)
    rows = [
        [row + 1, *places[row], 0, 0, 0, 1, 1, 1, 0, name, "", "", statuses[row], 0]
        for row, name in enumerate(landmarks.names)
    ]
    head = "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
    return f"{head}# columns = {FCSV_COLUMNS},positionStatus,autoCreated\n{csv_text(rows)}"


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Return a table of comma-separated values."""
    lines = io.StringIO()
    csv.writer(lines, lineterminator="\n").writerows(rows)
    return lines.getvalue()


def _format_sliders(specimens: Table) -> str:
    rows: list[tuple[object, ...]] = [("before", "slide", "after")]
    for curve in shared_curves(specimens):
        numbers = [row + 1 for row in curve]  # R counts from 1
        rows += zip(numbers[:-2], numbers[1:-1], numbers[2:], strict=True)
    return csv_text(rows)


def _format_tps(specimens: Table) -> str:
    lines = []
    for name, landmarks in specimens.items():
        rows = [" ".join(row) for row in _texts(landmarks.points)]
        lines += [f"LM3={len(rows)}", *rows, f"ID={name}"]
    return "\n".join(lines) + "\n"


def _parse_morphologika(text: str, _: str) -> Parsed:
    _, sections = sections_of(text, r"^\s*\[(.*)\]\s*$")
    keys = ("individuals", "landmarks", "dimensions")
    n, k, n_axes = [int(sections[key][0]) for key in keys]
    # Each specimen has a line before its points: an apostrophe and its number or name.
    lines = [line for line in sections["rawpoints"] if not line.startswith("'")]
    names = sections.get("names") or [str(number + 1) for number in range(n)]
    if len(lines) != n * k or len(names) != n:
        raise FileFormatError(
            f"there must be {n} names and {n} times {k} points; there are {len(names)} names and "
            f"{len(lines)} points."
        )
    points = points_of(lines, n_axes).reshape(n, k, n_axes)
    return unlabeled(zip(names, points, strict=True))


def _format_morphologika(specimens: Table) -> str:
    k = len(next(iter(specimens.values())).names)
    lines = ["[individuals]", str(len(specimens)), "[landmarks]", str(k), "[dimensions]", "3"]
    lines += ["[names]", *specimens, "[rawpoints]"]
    for number, landmarks in enumerate(specimens.values()):
        lines += [f"'#{number + 1}", *(" ".join(row) for row in _texts(landmarks.points))]
    return "\n".join(lines) + "\n"


def _parse_csv(text: str, _: str) -> Parsed:
    reader = csv.DictReader(filled_lines(text), strict=True)
    absent = set(CSV_COLUMNS[:-1]) - set(reader.fieldnames or ())
    if absent:
        raise FileFormatError(
            f"columns must be {', '.join(CSV_COLUMNS)}; {min(absent)} is missing."
        )
    found: dict[str, list[list[str]]] = {}
    for row in reader:
        if None in row or None in row.values():  # too many cells, or too few
            raise FileFormatError(
                f"a line must have as many cells as the first; one is {list(row.values())}."
            )
        specimen, *cells = [row.get(column, "NA").strip() for column in CSV_COLUMNS]
        found.setdefault(specimen, []).append(cells)
    specimens = {}
    for specimen, lines in found.items():
        names, *columns = zip(*lines, strict=True)
        *points, spread = [list(map(as_number, column)) for column in columns]
        widths = None if np.isnan(spread).all() else spread
        specimens[specimen] = Landmarks(names, np.transpose(points), widths)
    return Parsed(specimens)


def _format_csv(specimens: Table) -> str:
    rows = [CSV_COLUMNS]
    for specimen, landmarks in specimens.items():
        widths = np.nan if landmarks.spread is None else landmarks.spread
        numbers = np.insert(landmarks.points, 3, widths, axis=1)
        for name, row in zip(landmarks.names, _texts(numbers), strict=True):
            rows.append([specimen, name, *row])
    return csv_text(rows)


PARSERS = {
    ".mrk.json": _parse_markups,
    ".json": _parse_markups,
    ".fcsv": _parse_fcsv,
    ".tps": parse_tps,
    ".txt": _parse_morphologika,
    ".csv": _parse_csv,
    ".nts": parse_nts,
    ".dta": parse_nts,
    ".pts": parse_landmark_editor,
    ".pp": parse_picked_points,
    ".landmarkascii": parse_amira,
}
WRITERS = {
    ".mrk.json": _format_markups,
    ".fcsv": _format_fcsv,
    ".tps": _format_tps,
    ".txt": _format_morphologika,
    ".sliders.csv": _format_sliders,
    ".csv": _format_csv,
}
OF_ONE = (".mrk.json", ".fcsv")
# Files that a folder of landmarks may hold; other things end in .txt, .csv, .json and .dta, too.
IN_FOLDERS = (*OF_ONE, ".tps", ".nts", ".pts", ".pp", ".landmarkascii")
MOST_QUOTED = 500  # characters of a sentence that quotes a line of a file
ENDED = (*OF_ONE, ".json", ".pp")  # by a mark, or in lines of many cells
