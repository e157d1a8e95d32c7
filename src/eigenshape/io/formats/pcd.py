"""Point Cloud Data, versions .6 and .7: text, binary, and binary compressed by LZF."""

import struct
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.lzf_loops import decompress
from eigenshape.io.formats.text import Line, coordinates, lines_of, number_table, quote_line, whole
from eigenshape.io.formats.unpacking import require_reasonable

AXES = (b"x", b"y", b"z")
KINDS = {(b"F", 4): "<f4", (b"F", 8): "<f8"}
MOST_TIMES = 88  # largest compression ratio: three bytes stand for at most 264


@dataclass(frozen=True)
class Header:
    """The header of a file: the fields with their sizes, and the number of points."""

    names: tuple[bytes, ...]
    sizes: tuple[int, ...]  # bytes of all values of the field
    counts: tuple[int, ...]  # values of the field
    kinds: tuple[str | None, ...]
    n_points: int

    @property
    def record(self) -> int:
        """Bytes of a point."""
        return sum(self.sizes)


def parse(data: bytes) -> Float[np.ndarray, "n 3"]:
    """Read x, y and z; other fields are ignored. Missing returns remain NaN, as in the file."""
    lines, kind, body = _split(data)
    header = _header(lines)
    if kind == b"ascii":
        return _parse_text(header, body, first=data[: len(data) - len(body)].count(b"\n") + 1)
    if kind == b"binary":
        return _records(header, body)
    if kind == b"binary_compressed":
        return _columns(header, _unpack_body(header, body))
    raise FileFormatError(
        f"DATA of a PCD file must be ascii, binary or binary_compressed; it is {quote_line((0, kind))}."
    )


def n_rows(data: bytes) -> int:
    """Return the rows of a frame of a depth camera, or 1 for points without an order."""
    lines, _, _ = _split(data)
    words = {text.split()[0]: (number, text) for number, text in lines}
    if b"HEIGHT" not in words or b"WIDTH" not in words:
        return 1
    (height,), (width,) = (
        _numbers(words[key], "A size")[:1] or (0,) for key in (b"HEIGHT", b"WIDTH")
    )
    n_points = _header(lines).n_points
    if height > 1 and height * width != n_points:
        raise FileFormatError(
            f"A frame must have as many points as pixels; it declares {height} x {width} pixels "
            f"and {n_points} points."
        )
    return max(height, 1)


def _split(data: bytes) -> tuple[list[Line], bytes, bytes]:
    place = data.find(b"\nDATA ")
    if place < 0:
        raise FileFormatError("A PCD file must have a line DATA; it has none.")
    kind, _, body = data[place + 6 :].partition(b"\n")
    return lines_of(data[:place]), kind.strip(), body


def _header(lines: list[Line]) -> Header:
    rows = {text.split()[0]: (number, text) for number, text in lines}
    for name in (b"FIELDS", b"SIZE", b"TYPE", b"POINTS"):
        if name not in rows:
            raise FileFormatError(f"A PCD file must have a line {name.decode()}; it has none.")
    names = tuple(rows[b"FIELDS"][1].split()[1:])
    sizes = _numbers(rows[b"SIZE"], "A size")
    counts = _numbers(rows[b"COUNT"], "A count") if b"COUNT" in rows else (1,) * len(names)
    kinds = tuple(rows[b"TYPE"][1].split()[1:])
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
    types = tuple(
        KINDS.get((kind, size)) if count == 1 else None
        for kind, size, count in zip(kinds, sizes, counts, strict=True)
    )
    for axis in AXES:
        if types[names.index(axis)] is None:
            raise FileFormatError(
                f"Coordinates of a PCD file must be floats of 4 or 8 bytes; {axis.decode()} is not."
            )
    (n_points,) = _numbers(rows[b"POINTS"], "A number of points")[:1] or (0,)
    if n_points < 1:
        raise FileFormatError(f"A PCD file must hold points; it declares {n_points}.")
    fields = tuple(size * count for size, count in zip(sizes, counts, strict=True))
    return Header(names, fields, counts, types, n_points)


def _numbers(line: Line, what: str) -> tuple[int, ...]:
    return tuple(whole(word, line, what) for word in line[1].split()[1:])


def _parse_text(header: Header, body: bytes, first: int) -> Float[np.ndarray, "n 3"]:
    lines = lines_of(body, first)
    if len(lines) != header.n_points:
        raise FileFormatError(
            f"A PCD file must hold the points it declares; it declares {header.n_points} and holds {len(lines)}."
        )
    n_words = sum(header.counts)
    places = [sum(header.counts[:field]) for field in _axes(header)]
    table = number_table(lines)
    if table is not None and table.shape[1] == n_words:
        return table[:, places]
    return coordinates(
        [
            (number, b" ".join(_select_fields(number, text, places, n_words)))
            for number, text in lines
        ]
    )


def _select_fields(number: int, text: bytes, places: list[int], n_words: int) -> list[bytes]:
    words = text.split()
    if len(words) != n_words:
        raise FileFormatError(
            f"A point must have all fields and no more; line {number} is {quote_line((number, text))}."
        )
    return [words[place] for place in places]


def _require_bytes(header: Header, body: bytes | np.ndarray) -> None:
    if len(body) < header.n_points * header.record:
        raise FileFormatError(
            f"A PCD file must hold the points it declares; it declares {header.n_points} of {header.record} bytes and "
            f"holds {len(body)} bytes."
        )


def _records(header: Header, body: bytes) -> Float[np.ndarray, "n 3"]:
    _require_bytes(header, body)
    rows = np.frombuffer(body, np.uint8, header.n_points * header.record).reshape(
        header.n_points, header.record
    )
    starts = np.cumsum([0, *header.sizes])
    columns = [np.ascontiguousarray(rows[:, starts[i] : starts[i + 1]]) for i in _axes(header)]
    return np.column_stack(
        [_values(header, raw, i) for raw, i in zip(columns, _axes(header), strict=True)]
    )


def _columns(header: Header, body: np.ndarray) -> Float[np.ndarray, "n 3"]:
    """Read data that are stored by field instead of by point."""
    starts = np.cumsum([0, *header.sizes]) * header.n_points
    return np.column_stack(
        [_values(header, body[starts[i] : starts[i + 1]], i) for i in _axes(header)]
    )


def _axes(header: Header) -> list[int]:
    return [header.names.index(axis) for axis in AXES]


def _values(header: Header, raw: np.ndarray, place: int) -> np.ndarray:
    return raw.reshape(-1).view(np.dtype(header.kinds[place])).astype(np.float64)


def _unpack_body(header: Header, body: bytes) -> np.ndarray:
    if len(body) < 8:
        raise FileFormatError(
            f"Compressed points must begin with two sizes; the file ends after {len(body)} bytes."
        )
    packed, size = struct.unpack_from("<II", body)
    if (
        len(body) - 8 < packed
        or size > MOST_TIMES * packed
        or size < header.n_points * header.record
    ):
        raise FileFormatError(
            f"Compressed points must have the size they declare; {packed} bytes that unpack to {size} are declared, "
            f"{len(body) - 8} are there, and {header.n_points} points take {header.n_points * header.record}."
        )
    require_reasonable(size, len(body))
    unpacked = decompress(np.frombuffer(body, np.uint8, packed, 8), size)
    _require_bytes(header, unpacked)
    return unpacked
