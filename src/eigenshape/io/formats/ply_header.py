"""The header of a PLY file: its tables and their columns."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.text import quote_line

TYPES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d",
    "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f", "float64": "d",
}  # fmt: skip
TEXT = "text"
ORDERS = {"ascii": TEXT, "binary_little_endian": "<", "binary_big_endian": ">"}
MOST_DIGITS = 18  # more rows than any file can hold
REMARKS = ("ply", "comment", "obj_info")
END = re.compile(rb"(?:^|(?<=[\r\n]))end_header[ \t]*(\r\n|\n|\r|$)")


@dataclass(frozen=True)
class Column:
    """A property: its name, the letter of its type, and for a list that of its length."""

    name: str
    kind: str
    length_kind: str = ""

    @property
    def is_whole(self) -> bool:
        """Whether its values are whole numbers."""
        return self.kind not in "fd"


@dataclass(frozen=True)
class Element:
    """A table: its name, its declared number of rows, and its columns."""

    name: str
    count: int
    columns: tuple[Column, ...] = ()

    @property
    def least_bytes(self) -> int:
        """Least number of bytes of a row of the table, in binary."""
        return sum(np.dtype(column.length_kind or column.kind).itemsize for column in self.columns)


@dataclass(frozen=True)
class Header:
    """The byte order (or TEXT), the tables, and the place where their rows begin."""

    order: str
    elements: tuple[Element, ...]
    end: int
    n_lines: int


def parse_header(data: bytes) -> Header:
    """Read the header, refusing tables that are larger than the file before anybody makes room for them."""
    if not re.match(rb"ply\s", data):
        raise FileFormatError(
            f"A PLY file must begin with ply; it begins with {quote_line((1, data[:10]))}."
        )
    mark = END.search(data)
    if mark is None:
        raise FileFormatError("A PLY header must end with end_header; the file has no such line.")
    lines = data[: mark.start()].splitlines()
    order, elements = _declarations(lines)
    if not order:
        raise FileFormatError("A PLY header must name its format; it has no such line.")
    # Where lines end in a carriage return alone, a line feed that follows belongs to the rows.
    end = mark.end() - (mark[1] == b"\r\n" and not re.match(rb"ply[ \t]*\r?\n", data))
    _require_room(elements, order, len(data) - end)
    return Header(order, elements, end, len(lines) + 1)


def _declarations(lines: list[bytes]) -> tuple[str, tuple[Element, ...]]:
    order, last, counts, columns = "", "", dict[str, int](), dict[str, dict[str, Column]]()
    for number, line in enumerate(lines, 1):
        words = line.decode("latin-1").split() or ["comment"]
        try:
            match words[0]:
                case "format":
                    order = ORDERS[words[1]]
                case "element":
                    last = words[1]
                    _put_new(counts, last, _count(words[2]))
                    columns[last] = {}
                case "property":
                    column = _column(words)
                    _put_new(columns[last], column.name, column)
                case other:
                    REMARKS.index(other)
        except (IndexError, KeyError, ValueError) as err:
            raise FileFormatError(
                f"A PLY header must declare format, elements and properties; "
                f"line {number} is {quote_line((number, line))}."
            ) from err
    return order, tuple(
        Element(name, count, tuple(columns[name].values())) for name, count in counts.items()
    )


def _put_new(table: dict[str, Any], name: str, value: Any) -> None:
    if name in table:
        raise ValueError(name)
    table[name] = value


def _count(word: str) -> int:
    if not word.isdecimal() or len(word) > MOST_DIGITS:
        raise ValueError(word)
    return int(word)


def _column(words: list[str]) -> Column:
    if words[1] != "list":
        return Column(words[2], TYPES[words[1]])
    column = Column(words[4], TYPES[words[3]], TYPES[words[2]])
    if column.length_kind in ("f", "d"):
        raise ValueError(words)
    return column


def _require_room(elements: tuple[Element, ...], order: str, n_bytes: int) -> None:
    for element in elements:
        least = element.least_bytes if order != TEXT else 2 * len(element.columns)
        if element.count * least > n_bytes + 1:  # the last line of a text may lack its end
            raise FileFormatError(
                f"A PLY file must hold the rows it declares; {element.count} rows of {element.name} take "
                f"{element.count * least} bytes or more and {n_bytes} follow the header."
            )
