"""Files of the tps programs: points of each specimen, in space or in a plane, and curves."""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.morphometrics.landmark_parsers import (
    PLANAR,
    Parsed,
    as_number,
    by_name,
    filled_lines,
    numbered,
    points_of,
)

N_AXES = {"LM": 2, "LM3": 3}
CURVES, POINTS = ("CURVES", "CURVES3"), ("POINTS", "POINTS3")
UNREAD = ("OUTLINES", "OUTLINES3", "CHAIN", "RADII", "RADIIXY")  # no points that correspond


class _Rows(NamedTuple):
    """Lines below a key that counts them; points of curves and outlines have a section around them."""

    section: str
    key: str
    declared: str
    lines: list[str]


@dataclass
class _Specimen:
    """The fields of a specimen, such as ID=, and its rows."""

    fields: dict[str, str] = field(default_factory=dict)
    rows: list[_Rows] = field(default_factory=list)

    def curves(self) -> list[_Rows]:
        """Return the points of each curve."""
        return [each for each in self.rows if each.section in CURVES and each.key in POINTS]

    def require_counts(self, name: str) -> None:
        """Raise an error if rows or curves are missing, as at the end of a file that is cut off."""
        for section, key, declared, lines in self.rows:
            found = len(self.curves()) if key in CURVES else len(lines)
            if section not in UNREAD and declared != str(found):
                raise FileFormatError(
                    f"{key}= must be the number of points or curves below it; {name!r} has "
                    f"{key}={declared}, and there are {found}."
                )


def parse_tps(text: str, _: str) -> Parsed:
    """Read all specimens. Points of curves follow the landmarks."""
    specimens = _split(text)
    names, found, notes = [], [], []
    for row, own in enumerate(specimens):
        name = own.fields.get("ID") or own.fields.get("IMAGE") or str(row + 1)
        names.append(name)
        own.require_counts(name)
        if ("SCALE" in own.fields) != ("SCALE" in specimens[0].fields):
            raise FileFormatError(
                f"all specimens, or none, must have SCALE=; {name!r} differs from {names[0]!r}. "
                "Write SCALE=1 where points are in the unit already."
            )
        scale = as_number(own.fields.get("SCALE", "1"))
        if not 0 < scale < np.inf:
            raise FileFormatError(f"SCALE= must be positive; that of {name!r} is {scale}.")
        blocks = [own.rows[0], *own.curves()]
        pieces = [points_of(block.lines, N_AXES[own.rows[0].key]) for block in blocks]
        ends = np.cumsum([len(piece) for piece in pieces])
        curves = [range(first, last) for first, last in pairwise(ends)]
        found.append(numbered(scale * np.concatenate(pieces), curves))
    if any(own.rows[0].key == "LM" for own in specimens):
        notes.append(PLANAR)
    unread = {row.key for own in specimens for row in own.rows[1:] if row.section not in CURVES}
    if unread:
        notes.append(f"{' and '.join(sorted(unread))} are not read")
    return Parsed(by_name(names, found), tuple(notes))


def _split(text: str) -> list[_Specimen]:
    """Return the specimens of a file with their rows, as they stand."""
    specimens: list[_Specimen] = []
    for line in filled_lines(text):
        key, equals, value = (part.strip() for part in line.partition("="))
        key = key.upper()
        if equals and key in N_AXES:
            specimens.append(_Specimen())
        if not specimens:
            raise FileFormatError(
                f"a .tps file must begin with LM3= or LM=; it begins with {line!r}."
            )
        own = specimens[-1]
        if not equals:
            own.rows[-1].lines.append(line)
        elif key in (*N_AXES, *CURVES, *POINTS, *UNREAD):
            section = own.rows[-1].section if key in POINTS else key
            own.rows.append(_Rows(section, key, value, []))
        else:
            own.fields[key] = value
    return specimens
