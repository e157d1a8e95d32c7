"""SWC files: skeletons of neurons, as rows of number, kind, x, y, z, radius and parent."""

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.neuro.shared import find_keys
from eigenshape.io.formats.numbers import lines_of, number_table, wholes

N_COLUMNS = 7  # number, kind, x, y, z, radius, parent


def parse(data: bytes) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "s 2"]]:
    """Return points and the segments from each point to its parent; radii are left out.

    Raise FileFormatError if a row is not of seven numbers, a number occurs twice, or there is no
    point of the number of a parent.
    """
    lines = lines_of(data)
    table = number_table(lines)
    if table is None or table.shape[1] != N_COLUMNS:
        raise FileFormatError(
            "An SWC file must have rows of seven numbers: number, kind, x, y, z, radius, parent; "
            f"the first is {lines[0][1][:60] if lines else b''!r}."
        )
    numbers = wholes(table[:, 0], "Numbers of an SWC file")
    parents = wholes(table[:, 6], "Parents of an SWC file")
    different, counts = np.unique(numbers, return_counts=True)
    if (counts > 1).any():
        raise FileFormatError(
            f"Numbers of an SWC file must differ; {different[counts.argmax()]} occurs twice or more."
        )
    (children,) = np.nonzero(parents != -1)
    places = find_keys(numbers, parents[children])
    lost = np.flatnonzero(places < 0)
    if lost.size:
        child = children[lost[0]]
        raise FileFormatError(
            f"Parents of an SWC file must be numbers of its points; that of point {numbers[child]} "
            f"is {parents[child]}."
        )
    return table[:, 2:5], np.column_stack([children, places])
