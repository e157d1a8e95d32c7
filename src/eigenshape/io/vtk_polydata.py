"""Legacy VTK files of POLYDATA, text or binary: points with lines or polygons."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError
from eigenshape.io.text import fans

KINDS = {b"float": ">f4", b"double": ">f8", b"int": ">i4", b"vtktypeint64": ">i8", b"long": ">i8"}
CELLS = {b"VERTICES": 1, b"LINES": 2, b"POLYGONS": 3}  # fewest points of each
EXACT = 2**53  # whole numbers below it are exact in double precision


class _Cursor:
    """A place in the file, and how numbers are written there."""

    def __init__(self, data: bytes) -> None:
        self.data, self.place = data, 0
        self.line()
        self.line()
        self.binary = self.line().upper() == b"BINARY"

    def line(self) -> bytes:
        """Return the next line that is not blank, or nothing at the end."""
        while self.place < len(self.data):
            end = self.data.find(b"\n", self.place)
            end = len(self.data) if end < 0 else end
            text, self.place = self.data[self.place : end].strip(), end + 1
            if text:
                return text
        return b""

    def numbers(self, count: int, kind: bytes) -> np.ndarray:
        """Return the next numbers; so many must be there."""
        if kind not in KINDS:
            raise FileFormatError(f"Numbers of a VTK file must be {b', '.join(KINDS).decode()}; they are {kind!r}.")
        if not 0 <= count <= len(self.data):
            raise FileFormatError(f"A VTK file must hold what it declares; {count} numbers do not fit into it.")
        if self.binary:
            size = count * np.dtype(KINDS[kind]).itemsize
            if self.place + size > len(self.data):
                raise FileFormatError(f"A VTK file must hold what it declares; it ends within {count} numbers.")
            found = np.frombuffer(self.data, KINDS[kind], count, self.place)
            self.place += size
            return found
        words = self.data[self.place :].split(None, count)
        try:
            # Python would read 1_0 as ten.
            found = np.array([float(word.replace(b"_", b"?")) for word in words[:count]])
        except ValueError as err:
            raise FileFormatError(f"A VTK file must hold {count} numbers at byte {self.place}; it does not.") from err
        if len(found) < count:
            raise FileFormatError(f"A VTK file must hold what it declares; it ends within {count} numbers.")
        self.place = len(self.data) - len(words[count]) if len(words) > count else len(self.data)
        return found

    def wholes(self, count: int, kind: bytes) -> Int[np.ndarray, " k"]:
        """Return the next numbers, all of them whole."""
        found = self.numbers(count, kind)
        odd = (found != np.floor(found)) | (np.abs(found.astype(np.float64)) >= EXACT)
        bad = np.flatnonzero(odd)
        if bad.size:
            raise FileFormatError(f"Cells of a VTK file must be whole numbers; number {bad[0]} is {found[bad[0]]}.")
        return found.astype(np.int64)


def is_polydata(data: bytes) -> bool:
    """Tell whether a legacy VTK file is of this kind."""
    return b"DATASET POLYDATA" in data[:512].upper()


def parse(data: bytes) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "s corners"]]:
    """Return points and simplices: triangles where there are polygons, else segments; none where there are neither."""
    cursor = _Cursor(data)
    cursor.line()  # DATASET POLYDATA
    points, cells = np.empty((0, 3)), {}
    seen: set[bytes] = set()
    while text := cursor.line():
        words = text.split()
        name = words[0].upper()
        if name in (b"POINT_DATA", b"CELL_DATA"):
            break
        if len(words) != 3 or name not in (b"POINTS", b"TRIANGLE_STRIPS", *CELLS):
            continue
        if name == b"TRIANGLE_STRIPS":
            raise FileFormatError("Triangle strips of a VTK file are not read; convert them to POLYGONS.")
        if name in seen:
            raise FileFormatError(f"A VTK file must have one section {name.decode()}; it has two.")
        seen.add(name)
        if name == b"POINTS":
            points = cursor.numbers(3 * _count(words[1]), words[2].lower()).reshape(-1, 3).astype(np.float64)
        else:
            cells[name] = _cells(cursor, name, _count(words[1]), _count(words[2]))
    if cells.get(b"POLYGONS"):
        return points, fans(cells[b"POLYGONS"])
    return points, _segments(cells.get(b"LINES", []))


def _count(word: bytes) -> int:
    try:
        return int(word)
    except ValueError as err:
        raise FileFormatError(f"A VTK file must count its cells by whole numbers; it says {word[:30]!r}.") from err


def _cells(cursor: _Cursor, name: bytes, count: int, size: int) -> list[list[int]]:
    """Read cells as lists of points; version 5 has offsets and connectivity instead of counts before each cell."""
    start = cursor.place
    words = cursor.line().split()
    if words and words[0].upper() == b"OFFSETS":
        cells = _cells_by_offsets(cursor, words, count, size)
    else:
        cursor.place = start
        cells = _cells_by_counts(cursor.wholes(size, b"int"), count)
    for index, cell in enumerate(cells):
        if len(cell) < CELLS[name]:
            raise FileFormatError(
                f"A cell of {name.decode()} must have {CELLS[name]} points or more; cell {index} is {cell}."
            )
    return cells


def _cells_by_offsets(cursor: _Cursor, words: Sequence[bytes], count: int, size: int) -> list[list[int]]:
    offsets = cursor.wholes(count, _kind(words))
    flat = cursor.wholes(size, _kind(cursor.line().split()))
    if not count or offsets[0] != 0 or offsets[-1] != size or (np.diff(offsets) < 0).any():
        raise FileFormatError(f"Offsets of a VTK file must rise from 0 to {size}; they are {offsets[:9].tolist()}.")
    return [flat[a:b].tolist() for a, b in pairwise(offsets)]


def _kind(words: Sequence[bytes]) -> bytes:
    return words[1].lower() if len(words) > 1 else b""


def _cells_by_counts(flat: Int[np.ndarray, " k"], count: int) -> list[list[int]]:
    cells: list[list[int]] = []
    place, size = 0, len(flat)
    for _ in range(count):
        if place >= size or not 0 <= flat[place] < size - place:
            raise FileFormatError(
                f"Cells of a VTK file must fill {size} numbers; cell {len(cells)} of {count} does not."
            )
        cells.append(flat[place + 1 : place + 1 + flat[place]].tolist())
        place += 1 + int(flat[place])
    if place != size:
        raise FileFormatError(f"Cells of a VTK file must fill {size} numbers; {count} cells fill {place}.")
    return cells


def _segments(lines: Sequence[Sequence[int]]) -> Int[np.ndarray, "s 2"]:
    pairs = [pair for line in lines for pair in pairwise(line)]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)
