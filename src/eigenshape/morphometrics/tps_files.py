"""Files of the tps programs: points of each specimen, in space or in a plane, and curves."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape.morphometrics.landmark_parsers import (
    Parsed,
    as_number,
    filled_lines,
    points_of,
    unlabeled,
)

N_AXES = {"LM": 2, "LM3": 3}
CURVES, POINTS = ("CURVES", "CURVES3"), ("POINTS", "POINTS3")
UNREAD = ("OUTLINES", "OUTLINES3", "CHAIN", "RADII", "RADIIXY")  # no points that correspond


class _Rows(NamedTuple):
    """Lines below a key that counts them."""

    key: str
    declared: str
    lines: list[str]


def parse_tps(text: str, _: str) -> Parsed:
    """Read all specimens. Points of curves follow the landmarks."""
    specimens = _split(text)
    found: list[tuple[Any, ...]] = []
    unread: set[str] = set()
    for number, (fields, rows) in enumerate(specimens, 1):
        name = fields.get("ID") or fields.get("IMAGE") or str(number)
        unread |= {each.key for each in rows if each.key in UNREAD}
        curves = [each for each in rows if each.key in POINTS]
        for key, declared, lines in rows:
            n_found = len(curves if key in CURVES else lines)
            if key not in UNREAD and declared != str(n_found):
                raise FileFormatError(
                    f"{key}= must be the number of points or curves below it; {name!r} has "
                    f"{key}={declared}, and there are {n_found}."
                )
        if ("SCALE" in fields) != ("SCALE" in specimens[0][0]):
            raise FileFormatError(
                f"all specimens, or none, must have SCALE=; {name!r} differs from {found[0][0]!r}. "
                "Write SCALE=1 where points are in the unit already."
            )
        scale = as_number(fields.get("SCALE", "1"))
        if not 0 < scale < np.inf:
            raise FileFormatError(f"SCALE= must be positive; that of {name!r} is {scale}.")
        n_axes = N_AXES[rows[0].key]
        pieces = [points_of(each.lines, n_axes) for each in (rows[0], *curves)]
        ends = np.cumsum([len(piece) for piece in pieces])
        spans = [range(first, last) for first, last in pairwise(ends)]
        found.append((name, scale * np.concatenate(pieces), *spans))
    notes = [f"{' and '.join(sorted(unread))} are not read"] if unread else []
    return unlabeled(found, notes)


def _split(text: str) -> list[tuple[dict[str, str], list[_Rows]]]:
    """Return the fields, such as ID=, and the rows of each specimen, as they stand."""
    specimens: list[tuple[dict[str, str], list[_Rows]]] = []
    for line in filled_lines(text):
        key, equals, value = (part.strip() for part in line.partition("="))
        key = key.upper()
        if equals and key in N_AXES:
            specimens.append(({}, []))
        if not specimens:
            raise FileFormatError(
                f"a .tps file must begin with LM3= or LM=; it begins with {line!r}."
            )
        fields, rows = specimens[-1]
        if not equals:
            rows[-1].lines.append(line)
        elif key in (*N_AXES, *CURVES, *POINTS, *UNREAD):
            # Points of outlines are not those of curves.
            in_outline = key in POINTS and rows[-1].key in UNREAD
            rows.append(_Rows(rows[-1].key if in_outline else key, value, []))
        else:
            fields[key] = value
    return specimens
