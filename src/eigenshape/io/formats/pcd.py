"""Point Cloud Data, versions .6 and .7: text, binary, and binary compressed by LZF.

Read: text, binary and compressed; a grid of a depth camera.
Kept: nothing besides positions.
Named: other fields, such as colors and intensities; points that are not finite, if they are left
    out.
Refused: fields of positions of other sizes.
"""

import struct
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import FileFormatError
from eigenshape.io.formats.cells import NO_TRIANGLES
from eigenshape.io.formats.numbers import (
    Line,
    coordinates,
    lines_of,
    number_table,
    quote_line,
    require_reasonable,
    whole,
)

AXES = (b"x", b"y", b"z")
KINDS = {(b"F", 4): "<f4", (b"F", 8): "<f8"}
MOST_TIMES = 88  # largest compression ratio: three bytes stand for at most 264


@dataclass(frozen=True)
class Header:
    """The header of a file: how a point is stored, and the number of points."""

    record: np.dtype  # of x, y and z in a binary file
    places: list[int]  # of x, y and z among the words of a text file
    n_words: int
    n_points: int
    others: tuple[bytes, ...]  # fields besides x, y and z


def parse(data: bytes) -> tuple[Float[np.ndarray, "n 3"], np.ndarray, *tuple[str, ...]]:
    """Read x, y and z; other fields are named. Missing returns remain NaN, as in the file."""
    lines, kind, body = _split(data)
    header = _header(lines)
    n_points, record = header.n_points, header.record
    notes = (
        [f"the fields {b', '.join(header.others).decode('latin-1')} are not read"]
        if header.others
        else []
    )
    if kind == b"ascii":
        first = data[: len(data) - len(body)].count(b"\n") + 1
        return _parse_text(header, lines_of(body, first)), NO_TRIANGLES, *notes
    if kind == b"binary":
        _require_bytes(header, body)
        rows = np.frombuffer(body, record, n_points)
        columns = [rows[axis] for axis in "xyz"]
    elif kind == b"binary_compressed":  # by field instead of by point
        if len(body) < 8:
            raise FileFormatError(
                f"Compressed points must begin with two sizes; the file ends after {len(body)} bytes."
            )
        packed, size = struct.unpack_from("<II", body)
        needed = n_points * record.itemsize
        if len(body) - 8 < packed or size > MOST_TIMES * packed or size < needed:
            raise FileFormatError(
                f"Compressed points must have the size they declare; {packed} bytes that unpack to {size} are "
                f"declared, {len(body) - 8} are there, and {header.n_points} points take {needed}."
            )
        require_reasonable(size, len(body))
        body = decompress(body[8 : 8 + packed], size)
        _require_bytes(header, body)
        fields = [record.fields[axis] for axis in "xyz"] if record.fields else []
        columns = [
            np.frombuffer(body, kind_of, n_points, n_points * offset)
            for kind_of, offset, *_ in fields
        ]
    else:
        raise FileFormatError(
            f"DATA of a PCD file must be ascii, binary or binary_compressed; it is {quote_line((0, kind))}."
        )
    return np.column_stack([column.astype(np.float64) for column in columns]), NO_TRIANGLES, *notes


def n_rows(data: bytes) -> int:
    """Return the rows of a depth scan, or 1 for points without an order."""
    lines, _, _ = _split(data)
    if b"HEIGHT" not in lines or b"WIDTH" not in lines:
        return 1
    (height,), (width,) = (
        _numbers(lines[key], "A size")[:1] or (0,) for key in (b"HEIGHT", b"WIDTH")
    )
    n_points = _header(lines).n_points
    if height > 1 and height * width != n_points:
        raise FileFormatError(
            f"A frame must have as many points as pixels; it declares {height} x {width} pixels "
            f"and {n_points} points."
        )
    return max(height, 1)


def _split(data: bytes) -> tuple[dict[bytes, Line], bytes, bytes]:
    """Return the lines of the header by their first word, the kind of the data, and the data."""
    place = data.find(b"\nDATA ")
    if place < 0:
        raise FileFormatError("A PCD file must have a line DATA; it has none.")
    kind, _, body = data[place + 6 :].partition(b"\n")
    lines = {line[1].split()[0]: line for line in lines_of(data[:place])}
    return lines, kind.strip(), body


def _header(lines: dict[bytes, Line]) -> Header:
    for name in (b"FIELDS", b"SIZE", b"TYPE", b"POINTS"):
        if name not in lines:
            raise FileFormatError(f"A PCD file must have a line {name.decode()}; it has none.")
    names = tuple(lines[b"FIELDS"][1].split()[1:])
    sizes = _numbers(lines[b"SIZE"], "A size")
    counts = _numbers(lines[b"COUNT"], "A count") if b"COUNT" in lines else (1,) * len(names)
    kinds = tuple(lines[b"TYPE"][1].split()[1:])
    if (
        not len(names) == len(sizes) == len(counts) == len(kinds)
        or min((*sizes, *counts), default=0) < 1
    ):
        raise FileFormatError(
            "FIELDS, SIZE, TYPE and COUNT of a PCD file must be of one length; they are not."
        )
    missing = [axis.decode() for axis in AXES if axis not in names]
    if missing:
        raise FileFormatError(
            f"A PCD file must have the fields x, y and z; {missing[0]} is missing."
        )
    axes = [names.index(axis) for axis in AXES]
    types = [
        KINDS.get((kinds[place], sizes[place])) if counts[place] == 1 else None for place in axes
    ]
    if None in types:
        raise FileFormatError(
            f"Coordinates of a PCD file must be floats of 4 or 8 bytes; {'xyz'[types.index(None)]} is not."
        )
    (n_points,) = _numbers(lines[b"POINTS"], "A number of points")[:1] or (0,)
    if n_points < 1:
        raise FileFormatError(f"A PCD file must hold points; it declares {n_points}.")
    n_bytes = [size * count for size, count in zip(sizes, counts, strict=True)]
    offsets = [sum(n_bytes[:place]) for place in axes]
    record = np.dtype(
        {"names": [*"xyz"], "formats": types, "offsets": offsets, "itemsize": sum(n_bytes)}
    )
    others = tuple(name for name in names if name not in (*AXES, b"_"))  # _ fills gaps
    return Header(record, [sum(counts[:place]) for place in axes], sum(counts), n_points, others)


def _numbers(line: Line, what: str) -> tuple[int, ...]:
    return tuple(whole(word, line, what) for word in line[1].split()[1:])


def _parse_text(header: Header, lines: list[Line]) -> Float[np.ndarray, "n 3"]:
    if len(lines) != header.n_points:
        raise FileFormatError(
            f"A PCD file must hold the points it declares; it declares {header.n_points} and holds {len(lines)}."
        )
    table = number_table(lines)
    if table is not None and table.shape[1] == header.n_words:
        return table[:, header.places]
    points = []
    for line in lines:
        words = line[1].split()
        if len(words) != header.n_words:
            raise FileFormatError(
                f"A point must have all fields and no more; line {line[0]} is {quote_line(line)}."
            )
        points.append((line[0], b" ".join([words[place] for place in header.places])))
    return coordinates(points)


def _require_bytes(header: Header, body: bytes) -> None:
    if len(body) < header.n_points * header.record.itemsize:
        raise FileFormatError(
            f"A PCD file must hold the points it declares; it declares {header.n_points} of {header.record.itemsize} "
            f"bytes and holds {len(body)} bytes."
        )


def decompress(data: bytes, size: int) -> bytes:
    """Unpack LZF data to `size` bytes, or fewer if it ends early or refers to bytes before its start."""
    out = bytearray()
    place = 0
    while place < len(data):
        control = data[place]
        if control < 32:  # a run of control + 1 literal bytes
            piece = data[place + 1 : place + 2 + control]
            if len(piece) <= control:
                break
            place += 2 + control
        else:  # a copy of bytes that were unpacked before
            is_long = control >= 7 << 5
            if place + is_long + 1 >= len(data):
                break
            count = (control >> 5) + 2 + (data[place + 1] if is_long else 0)
            place += 2 + is_long
            start = len(out) - ((control & 31) << 8) - data[place - 1] - 1
            if start < 0:
                break
            piece = bytes(out[start : start + count])
            piece = (piece * (count // len(piece) + 1))[:count]  # it may repeat itself
        if len(out) + len(piece) > size:
            break
        out += piece
    return bytes(out)
