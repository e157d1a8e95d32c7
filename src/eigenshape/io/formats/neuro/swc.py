"""SWC files: skeletons of neurons, as rows of number, kind, x, y, z, radius and parent.

Read: points and their parents; points that are their own parents, radii that are not numbers.
Kept: nothing besides positions.
Named: columns after the seventh.
Refused: a parent that is not there.
"""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.errors import FileFormatError
from eigenshape._arrays import find_keys
from eigenshape.io.formats.numbers import (
    lines_of,
    number_table,
    require_distinct,
    wholes,
)


def parse(
    data: bytes,
) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "s 2"], *tuple[str, ...]]:
    """Return points, the segments from each point to its parent, and notes; radii are left out.

    Raise FileFormatError if a row is not of seven numbers or more, a number occurs twice, or there
    is no point of the number of a parent.
    """
    rows = [(line, words.split()) for line, words in lines_of(data)]
    # Radii are not read: skeletons have nan where none was measured.
    table = number_table(
        [(line, b" ".join([*words[:1], *words[2:5], *words[6:7]])) for line, words in rows]
    )
    if table is None or table.shape[1] != 5:
        raise FileFormatError(
            "An SWC file must have rows of seven numbers: number, kind, x, y, z, radius, parent; "
            f"the first is {b' '.join(rows[0][1])[:60] if rows else b''!r}."
        )
    numbers = wholes(table[:, 0], "Numbers of an SWC file")
    parents = wholes(table[:, 4], "Parents of an SWC file")
    require_distinct(numbers, "Numbers of an SWC file")
    notes = []
    if any(len(words) > 7 for _, words in rows):
        notes.append("columns after the seventh were left out")
    own = np.flatnonzero(parents == numbers)
    if own.size:
        notes.append(
            f"points that are their own parents were read as roots; point {numbers[own[0]]} is one "
            f"({own.size} such)"
        )
    (children,) = np.nonzero((parents != -1) & (parents != numbers))
    places = find_keys(numbers, parents[children])
    lost = np.flatnonzero(places < 0)
    if lost.size:
        child = children[lost[0]]
        raise FileFormatError(
            f"Parents of an SWC file must be numbers of its points; that of point {numbers[child]} "
            f"is {parents[child]}."
        )
    return table[:, 1:4], np.column_stack([children, places]), *notes
