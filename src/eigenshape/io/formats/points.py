"""Tables of points: plain text, and the binary point sets that some scanners' programs write under the same suffix.

Read: rows of three numbers.
Kept: nothing besides positions.
Named: columns after the third.
Refused: a row with fewer numbers; landmarks under the same suffix.
"""

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import FileFormatError
from eigenshape.io.formats.cells import NO_TRIANGLES
from eigenshape.io.formats.numbers import (
    coordinates,
    end_lines,
    lines_of,
    quote_line,
    rows_text,
    whole,
)

EXPE = b"[Expe/PointSet/Binary/"


def parse(data: bytes) -> tuple[Float[np.ndarray, "n 3"], np.ndarray, *tuple[str, ...]]:
    """Read the first three numbers of each line; a first line with one number alone declares how many follow."""
    if data.startswith(EXPE):
        return _parse_binary(data), NO_TRIANGLES
    if data.startswith(b"Version 1.0"):
        raise FileFormatError(
            "A file of points must hold rows of numbers; this one holds landmarks of Landmark Editor. "
            "es.morphometrics.read_landmarks reads them."
        )
    lines = lines_of(data)
    if lines and lines[0][1].isdigit():
        declared = int(lines[0][1])
        lines = lines[1:]
        if declared != len(lines):
            raise FileFormatError(
                f"A file of points must hold as many as it declares; it declares {declared} and holds {len(lines)}."
            )
    if not lines:
        raise FileFormatError("A file of points must hold points; it holds none.")
    more = len(lines[0][1].split()) - 3
    notes = [f"{more} columns after x, y and z are not read"] if more > 0 else []
    try:
        return coordinates(lines), NO_TRIANGLES, *notes
    except FileFormatError as err:
        raise FileFormatError(
            f"{err} Put # before lines of text, spaces between numbers, and a point before decimals."
        ) from err


def _parse_binary(data: bytes) -> Float[np.ndarray, "n 3"]:
    """Read records of 32-bit numbers whose header names each property with its size in bytes, as `position 12`."""
    head, mark, body = data.partition(b"\ndata\n")
    if not mark:
        raise FileFormatError("A binary point set must have a line 'data'; it has none.")
    sizes: dict[bytes, int] = {}
    declared = -1
    for line in lines_of(head)[1:]:
        words = line[1].split()
        if words[0] == b"property" and len(words) == 3:
            sizes[words[1]] = whole(words[2], line, "The size of a property")
        elif words[0] == b"nofpoints" and len(words) == 2:
            declared = whole(words[1], line, "A number of points")
        else:
            raise FileFormatError(
                f"A binary point set must declare properties; line {line[0]} is {quote_line(line)}."
            )
    if sizes.get(b"position") != 12 or min(sizes.values()) < 1:
        raise FileFormatError(
            f"A binary point set must have a position of 12 bytes; it has {sizes}."
        )
    record = np.dtype(
        [
            (name.decode("latin-1"), ("<f4", 3) if name == b"position" else f"V{size}")
            for name, size in sizes.items()
        ]
    )
    if declared < 1 or len(body) < declared * record.itemsize:
        raise FileFormatError(
            f"A binary point set must hold the points it declares; it declares {declared} of {record.itemsize} bytes "
            f"each and holds {len(body)} bytes."
        )
    return np.frombuffer(body, record, declared)["position"].astype(np.float64)


def format_points(points: Float[np.ndarray, "n 3"], suffix: str) -> bytes:
    """Write points so that they read back exactly; a .pts file has their number before them."""
    count = [str(len(points))] if suffix == ".pts" else []
    return end_lines([*count, *rows_text("", points)])
