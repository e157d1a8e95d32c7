"""Files of landmarks: of 3D Slicer, of the tps programs, of Morphologika, and tables."""

import csv
import io
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from eigenshape._arguments import require_type
from eigenshape._errors import FileFormatError, InvalidParameterError
from eigenshape._files import as_path, read_regular, replace_file
from eigenshape.morphometrics.landmarks import Landmarks, require_name, require_same_names

Table: TypeAlias = dict[str, Landmarks]

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
MISSING = ("", "NA", "NaN", "nan")  # of a number, as R, pandas and tps programs write it


def read_landmarks(path: str | Path) -> Landmarks:
    """Read the landmarks of one specimen.

    Parameters
    ----------
    path : str or Path
        Any file of `read_specimens` with one specimen, such as a `.mrk.json` file of 3D Slicer.

    Returns
    -------
    Landmarks

    Raises
    ------
    FileFormatError
        As `read_specimens`, and if the file holds several specimens.

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
    specimens = read_specimens(path)
    if len(specimens) > 1:
        raise FileFormatError(
            f"{path} must hold one specimen; it holds {len(specimens)}. Read it by read_specimens."
        )
    return next(iter(specimens.values()))


def read_specimens(path: str | Path) -> dict[str, Landmarks]:
    r"""Read the landmarks of all specimens of a file.

    - `.mrk.json` and `.fcsv` of 3D Slicer, one specimen, which has the name of the file. Points in
      the system RAS are turned to LPS, in which Slicer writes meshes. Curves of `.mrk.json` files
      become `Landmarks.curves`.
    - `.tps`, points in space ("LM3="), multiplied by "SCALE=". A specimen has the name of its "ID=" or
      "IMAGE="; landmarks, which have no names there, are numbered from "1" on.
    - `.txt` of Morphologika; landmarks are numbered. Labels, groups and wireframes are not read.
    - `.csv` with the columns specimen, landmark, x, y, z, and spread, if it is known.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    {str: Landmarks}
        Specimens by name, in the order of the file, all with the same landmarks. Missing points
        ("NA", or not placed) are NaN.

    Raises
    ------
    FileFormatError
        If the file does not follow its format, is cut off, or its specimens have different
        landmarks.

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
    parse, _ = FORMATS[_suffix(path)]
    data = read_regular(path, "landmarks")
    try:
        specimens = parse(data.decode("utf-8-sig"), path.name[: -len(_suffix(path))])
        require_same_names(specimens)
    except (ValueError, csv.Error) as err:
        raise FileFormatError(f"{path} must hold landmarks: {err}") from err
    # JSON, or sections of Morphologika, of another structure fail in any of these ways.
    except (LookupError, TypeError, AttributeError, ArithmeticError, RecursionError) as err:
        raise FileFormatError(
            f"{path} must hold landmarks: its structure differs, {err!r}"
        ) from err
    return specimens


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
        geomorph takes.

    Raises
    ------
    FileFormatError
        If the name ends otherwise.
    InvalidParameterError
        If the format holds one specimen and there are several, there is none, landmarks of
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
    suffix = _suffix(path)
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
    _, text_of = FORMATS[suffix]
    replace_file(path, text_of(dict(landmarks)).encode())


def _suffix(path: Path) -> str:
    suffix = next((each for each in FORMATS if path.name.lower().endswith(each)), None)
    if suffix is None:
        raise FileFormatError(f"Files of landmarks end in {', '.join(FORMATS)}; it is {path}.")
    return suffix


def _number(text: str) -> float:
    """Return a number, or NaN for a missing one. `float` would take 1_000 for a thousand, too."""
    if text.strip() in MISSING:
        return np.nan
    if "_" in text:
        raise FileFormatError(f"{text!r} is no number.")
    return float(text)


def _lines(text: str) -> list[str]:
    """Return the lines of a text; raise an error if the last one may be cut off."""
    if not text.endswith("\n"):
        raise FileFormatError(
            "its last line has no end, so that a number may be cut off. If the file is whole, end it "
            "with a line break."
        )
    return [line.strip() for line in text.splitlines()]


def _numbered(lines: Sequence[str], scale: float = 1.0) -> Landmarks:
    """Return the points of lines of three numbers, named by their own numbers."""
    for line in lines:
        if len(line.split()) != 3:
            raise FileFormatError(f"a point must have three numbers; a line is {line!r}.")
    rows = [[_number(word) for word in line.split()] for line in lines]
    names = [str(number + 1) for number in range(len(rows))]
    return Landmarks(names, scale * np.reshape(rows, (-1, 3)))


def _by_name(names: Sequence[str], found: Sequence[Landmarks]) -> Table:
    for number, name in enumerate(names):
        if name in names[:number]:
            raise FileFormatError(f"specimens must have different names; two are {name!r}.")
    return dict(zip(names, found, strict=True))


def _texts(landmarks: Landmarks) -> list[list[str]]:
    """Return the three numbers of each point, with all their digits."""
    return [
        ["NA" if np.isnan(number) else repr(number) for number in point]
        for point in landmarks.points.tolist()
    ]


def _parse_markups(text: str, stem: str) -> Table:
    rows: dict[str, int] = {}
    places: list[list[float]] = []
    curves = []
    for markup in json.loads(text)["markups"]:
        is_curve = markup.get("type") in ("Curve", "ClosedCurve")
        signs = _signs(markup.get("coordinateSystem", "LPS"))
        members = []
        for point in markup["controlPoints"]:
            name = str(point.get("label") or point.get("id") or len(rows) + 1).strip()
            place = [np.nan] * 3
            if point.get("positionStatus", "defined") == "defined":
                if len(point["position"]) != 3:
                    raise FileFormatError(
                        f"a point must have three numbers; {name!r} is {point['position']}."
                    )
                place = [sign * float(x) for sign, x in zip(signs, point["position"], strict=True)]
            # Points of curves may be landmarks of another list, too: one point has one row.
            if not (is_curve and name in rows and places[rows[name]] == place):
                if name in rows:
                    raise FileFormatError(f"names must differ; two points are {name!r}.")
                rows[name] = len(rows)
                places.append(place)
            members.append(rows[name])
        if is_curve:
            curves.append(members + members[:1] * (markup["type"] == "ClosedCurve"))
    return {stem: Landmarks(rows, np.reshape(places, (-1, 3)), curves=curves)}


def _format_markups(specimens: Table) -> str:
    (landmarks,) = specimens.values()
    points = []
    for name, place in zip(landmarks.names, landmarks.points.tolist(), strict=True):
        is_missing = place[0] != place[0]  # NaN
        status = "undefined" if is_missing else "defined"
        position = [0.0] * 3 if is_missing else place
        points.append({"label": name, "position": position, "positionStatus": status})
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
        raise FileFormatError(f"the coordinate system must be LPS or RAS; it is {system!r}.")
    return TO_LPS[system]


def _parse_fcsv(text: str, stem: str) -> Table:
    system, columns = "RAS", FCSV_COLUMNS.split(",")  # of files that do not name theirs
    names, places = [], []
    for line in text.splitlines():
        key, _, value = line.partition("=")
        if key.split() == ["#", "CoordinateSystem"]:
            system = value.strip()
        elif key.split() == ["#", "columns"]:
            columns = value.strip().split(",")
        elif line.strip() and not line.startswith("#"):
            cells = next(csv.reader([line]))
            row = dict(zip(columns, cells, strict=False))
            if len(row) < len(columns):
                raise FileFormatError(f"a line must have {len(columns)} cells; one is {line!r}.")
            is_placed = (cells[STATUS_COLUMN:] or [PLACED])[0] not in NOT_PLACED
            places.append([_number(row[axis]) if is_placed else np.nan for axis in "xyz"])
            names.append(row["label"].strip() or str(len(places)))
    return {stem: Landmarks(names, np.reshape(places, (-1, 3)) * _signs(system))}


def _format_fcsv(specimens: Table) -> str:
    (landmarks,) = specimens.values()
    rows = []
    for number, (name, place) in enumerate(zip(landmarks.names, _texts(landmarks), strict=True)):
        status = NOT_PLACED[1] if "NA" in place else PLACED
        place = [text.replace("NA", "0.0") for text in place]  # noqa: PLW2901
        rows.append([number + 1, *place, 0, 0, 0, 1, 1, 1, 0, name, "", "", status, 0])
    head = "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
    return f"{head}# columns = {FCSV_COLUMNS},positionStatus,autoCreated\n{csv_text(rows)}"


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Return a table of comma-separated values."""
    lines = io.StringIO()
    csv.writer(lines, lineterminator="\n").writerows(rows)
    return lines.getvalue()


def _parse_tps(text: str, _: str) -> Table:
    blocks: list[tuple[dict[str, str], list[str]]] = []
    for line in filter(None, _lines(text)):
        key, equals, value = line.partition("=")
        key = key.strip().upper()
        if equals and key.startswith("LM"):
            blocks.append(({}, []))
        if not blocks:
            raise FileFormatError(f"a .tps file must begin with LM3=; it begins with {line!r}.")
        if not equals:
            blocks[-1][1].append(line)
        elif key in ("LM", "CURVES", "OUTLINES"):
            raise FileFormatError(
                f"points must be in space and in one list, LM3=; there is {line!r}."
            )
        else:
            blocks[-1][0][key] = value.strip()
    names, found = [], []
    for number, (fields, lines) in enumerate(blocks):
        if fields.keys() != blocks[0][0].keys():
            odd = min(fields.keys() ^ blocks[0][0].keys())
            raise FileFormatError(
                f"all specimens, or none, must have {odd}=; specimen {number} differs."
            )
        scale = _number(fields.get("SCALE", "1"))
        if fields["LM3"] != str(len(lines)) or not scale > 0:
            raise FileFormatError(
                f"LM3= must be the number of points, and SCALE= positive; specimen {number} has "
                f"LM3={fields['LM3']}, {len(lines)} points and a scale of {scale}."
            )
        names.append(fields.get("ID") or fields.get("IMAGE") or str(number + 1))
        found.append(_numbered(lines, scale))
    return _by_name(names, found)


def _format_tps(specimens: Table) -> str:
    lines = []
    for name, landmarks in specimens.items():
        rows = [" ".join(row) for row in _texts(landmarks)]
        lines += [f"LM3={len(rows)}", *rows, f"ID={name}"]
    return "\n".join(lines) + "\n"


def _parse_morphologika(text: str, _: str) -> Table:
    sections: dict[str, list[str]] = {}
    section = sections.setdefault("", [])
    for line in filter(None, _lines(text)):
        if line.startswith("["):
            section = sections.setdefault(line.strip("[]").strip().lower(), [])
        else:
            section.append(line)
    n, k = int(sections["individuals"][0]), int(sections["landmarks"][0])
    # Each specimen has a line before its points: an apostrophe and its number or name.
    lines = [line for line in sections["rawpoints"] if not line.startswith("'")]
    names = sections.get("names") or [str(number + 1) for number in range(n)]
    if len(lines) != n * k or len(names) != n or sections["dimensions"] != ["3"]:
        raise FileFormatError(
            f"there must be {n} names and {n} times {k} points in 3 dimensions; there are "
            f"{len(names)} names and {len(lines)} points in {sections['dimensions'][0]}."
        )
    return _by_name(names, [_numbered(lines[row : row + k]) for row in range(0, n * k, k)])


def _format_morphologika(specimens: Table) -> str:
    k = len(next(iter(specimens.values())).names)
    lines = ["[individuals]", str(len(specimens)), "[landmarks]", str(k), "[dimensions]", "3"]
    lines += ["[names]", *specimens, "[rawpoints]"]
    for number, landmarks in enumerate(specimens.values()):
        lines += [f"'#{number + 1}", *(" ".join(row) for row in _texts(landmarks))]
    return "\n".join(lines) + "\n"


def _parse_csv(text: str, _: str) -> Table:
    reader = csv.DictReader(_lines(text), strict=True)
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
        numbers = np.array([[_number(cell) for cell in cells[1:]] for cells in lines])
        points, spread = numbers[:, :3], numbers[:, 3]
        names = [cells[0] for cells in lines]
        specimens[specimen] = Landmarks(names, points, None if np.isnan(spread).all() else spread)
    return specimens


def _format_csv(specimens: Table) -> str:
    rows: list[list[object]] = [list(CSV_COLUMNS)]
    for specimen, landmarks in specimens.items():
        widths = (
            np.full(len(landmarks.names), np.nan) if landmarks.spread is None else landmarks.spread
        )
        for name, place, width in zip(
            landmarks.names, _texts(landmarks), widths.tolist(), strict=True
        ):
            rows.append([specimen, name, *place, "NA" if np.isnan(width) else width])
    return csv_text(rows)


FORMATS: dict[str, tuple[Callable[[str, str], Table], Callable[[Table], str]]] = {
    ".mrk.json": (_parse_markups, _format_markups),
    ".fcsv": (_parse_fcsv, _format_fcsv),
    ".tps": (_parse_tps, _format_tps),
    ".txt": (_parse_morphologika, _format_morphologika),
    ".csv": (_parse_csv, _format_csv),
}
OF_ONE = (".mrk.json", ".fcsv")
