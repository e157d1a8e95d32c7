"""VTK's files in XML: unstructured grids (.vtu) and PolyData (.vtp), and functions on them.

Only what is requested is unpacked, after a check of sizes.
"""

import base64
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element
from xml.sax.saxutils import quoteattr

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.errors import FileFormatError
from eigenshape.geometry.simplicial import Mesh
from eigenshape.io.formats.cells import CellLists, ParsedFields, ParsedShape
from eigenshape.io.formats.numbers import (
    COMPRESSORS,
    require_reasonable,
    unpack_block,
    wholes,
)
from eigenshape.io.formats.vtk_cells import (
    POLY_VERTEX,
    POLYGON,
    POLYLINE,
    STRIP,
    Arrays,
    TypedCells,
    VtkShape,
    fit_fields,
    other_dataset,
    require_joined,
    sort_cells,
    surface_lists,
)
from eigenshape.io.formats.xml_arrays import decode_base64, parse_xml, text_numbers

HEADER_TYPES = {"UInt32": "u4", "UInt64": "u8"}
ORDERS = {"LittleEndian": "<", "BigEndian": ">"}
NUMBERS = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4",
    "Int64": "i8", "UInt64": "u8", "Float32": "f4", "Float64": "f8",
    "Bit": "u1",
}  # fmt: skip
SECTIONS = {POLY_VERTEX: "Verts", POLYLINE: "Lines", POLYGON: "Polys", STRIP: "Strips"}
RAW = re.compile(rb"<AppendedData[^>]*\bencoding\s*=\s*[\"']raw[\"'][^>]*>\s*_")


@dataclass(frozen=True)
class _Packing:
    """The encoding of the arrays of a file, and the bytes after its tags."""

    size: np.dtype  # of the counts before each array
    order: str
    compressor: str | None
    appended: bytes
    is_raw: bool
    n_bytes: int  # of the file

    def numbers(self, array: Element, count: int) -> np.ndarray:
        """Read an array of `count` numbers, which is checked before anything is unpacked."""
        name = array.get("Name", "an array")
        kind = NUMBERS.get(array.get("type", ""))
        if kind is None:
            raise FileFormatError(
                f"Arrays of a VTK file must be of numbers; {name!r} is of {array.get('type')!r}."
            )
        if array.get("format", "ascii") == "ascii":
            found = text_numbers((array.text or "").encode(), kind, "VTK", name)
        else:
            dtype = np.dtype(self.order + kind)
            is_packed = array.get("type") == "Bit"
            data = self._data(array, -(-count // 8) if is_packed else count * dtype.itemsize, name)
            found = np.frombuffer(data, dtype)
            found = np.unpackbits(found)[:count] if is_packed else found
        if len(found) != count:
            raise FileFormatError(
                f"A VTK file must hold what it declares; {name!r} must have {count} numbers and has {len(found)}."
            )
        return found

    def _data(self, array: Element, size: int, name: str) -> bytes:
        if array.get("format") == "appended":
            offset = array.get("offset", "")
            if not re.fullmatch(r"\s*[0-9]{1,18}\s*", offset):
                raise FileFormatError(
                    f"An appended array must have an offset; that of {name!r} is {offset!r}."
                )
            text, is_raw = self.appended[int(offset) :], self.is_raw
        else:
            text, is_raw = (array.text or "").strip().encode(), False
        n_head = self.size.itemsize

        def counts(number: int) -> list[int]:
            return np.frombuffer(first(text, number * n_head), self.size).tolist()

        def first(text: bytes, length: int) -> bytes:
            """Return the first bytes that a text holds, raw or in base64."""
            found = text
            if not is_raw:
                found = decode_base64(text[: _n_characters(length)], "VTK", name)
            found = found[:length]
            if len(found) < length:
                raise FileFormatError(
                    f"A VTK file must hold what it declares; {name!r} lacks {length - len(found)} of {length} bytes."
                )
            return found

        if self.compressor is None:
            (length,) = counts(1)
            _require_size(length, size, name)
            head = text[: _n_characters(n_head)]
            if not is_raw and b"=" in head:  # the count is encoded apart from the data
                return first(text[len(head) :], length)
            return first(text, n_head + length)[n_head:]
        if self.compressor not in COMPRESSORS:
            raise FileFormatError(
                f"A VTK file must be compressed by {' or '.join(COMPRESSORS)}, or not at all; it is by "
                f"{self.compressor[:40]!r}. Save it uncompressed."
            )
        (n_blocks,) = counts(1)
        if n_blocks > len(text):
            raise FileFormatError(
                f"A VTK file must hold what it declares; {name!r} is of {n_blocks} blocks."
            )
        _, usual, last, *packed = counts(3 + n_blocks)
        sizes = [usual] * n_blocks
        if n_blocks and last:  # 0 means that the last block is as large as the others
            sizes[-1] = last
        _require_size(sum(sizes), size, name)
        require_reasonable(sum(sizes), self.n_bytes)
        # In base64, the compressed blocks are encoded apart from the counts.
        n_counts = (3 + n_blocks) * n_head
        data = first(text[n_counts if is_raw else _n_characters(n_counts) :], sum(packed))
        pieces = []
        start = 0
        for length, n_packed in zip(sizes, packed, strict=True):
            pieces.append(unpack_block(data[start : start + n_packed], length, self.compressor))
            start += n_packed
        return b"".join(pieces)


def _n_characters(length: int) -> int:
    """Return the number of base64 characters for a number of bytes."""
    return -(-length // 3) * 4


def _require_size(found: int, expected: int, name: str) -> None:
    if found != expected:
        raise FileFormatError(
            f"A VTK file must hold what it declares; {name!r} takes {expected} bytes, not {found}."
        )


@dataclass(frozen=True)
class _Piece:
    """A piece of a file, and the encoding of its arrays."""

    element: Element
    packing: _Packing

    def count(self, name: str) -> int:
        """Return the number of points or cells of a section."""
        text = self.element.get(f"NumberOf{name}", "0").strip()
        if not re.fullmatch(r"[0-9]{1,18}", text):
            raise FileFormatError(
                f"Pieces of a VTK file must count what they hold; NumberOf{name} is {text[:30]!r}."
            )
        return int(text)

    def points(self) -> Float[np.ndarray, "n 3"]:
        array = self.element.find("./Points/DataArray")
        if array is None:
            raise FileFormatError("A VTK file must have points; a piece has none.")
        width = (array.get("NumberOfComponents") or "3").strip()
        if width != "3":
            raise FileFormatError(
                f"Points of a VTK file must have three coordinates each; they have {width[:30]!r}."
            )
        numbers = self.packing.numbers(array, 3 * self.count("Points"))
        return numbers.reshape(-1, 3).astype(np.float64)

    def cells(self) -> TypedCells:
        """Return the cells, and VTK's number of their type."""
        if n_cells := self.count("Cells"):
            return self._lists("Cells", n_cells), self._wholes("Cells", "types", n_cells)
        counts = {kind: self.count(name) for kind, name in SECTIONS.items()}
        held = {kind: count for kind, count in counts.items() if count}
        return surface_lists({kind: self._lists(SECTIONS[kind], held[kind]) for kind in held})

    def _lists(self, section: str, n_cells: int) -> CellLists:
        ends = self._wholes(section, "offsets", n_cells)
        starts = np.append(0, ends)
        if (np.diff(starts) < 0).any():
            raise FileFormatError(
                f"Offsets of a VTK file must rise from 0; they begin with {ends[:9].tolist()}."
            )
        return CellLists(starts, self._wholes(section, "connectivity", int(starts[-1])))

    def _wholes(self, section: str, name: str, count: int) -> Int[np.ndarray, " count"]:
        arrays = {each.get("Name", ""): each for each in self.element.findall(f"./{section}/*")}
        if name not in arrays:
            raise FileFormatError(
                f"{section} of a VTK file must have {name}; they have {', '.join(arrays)}."
            )
        return wholes(self.packing.numbers(arrays[name], count), f"{name} of a VTK file")


def parse(data: bytes) -> ParsedShape:
    """Return points, cells by kind, and notes; functions are not unpacked.

    Raise FileFormatError if the content differs from the tags, or they declare more than the file
    can hold.
    """
    shape = _shape(_open(data))
    return shape.points, shape.cells, *shape.notes


def parse_fields(data: bytes) -> ParsedFields:
    """Return the functions on points and those on simplices, by name, and notes; see `parse`.

    Raise FileFormatError if the content differs from the tags, or they declare more than the file
    can hold.
    """
    pieces = _open(data)
    shape = _shape(pieces)
    of_points, left_out = _fields(pieces, "PointData", ("Points",))
    of_cells, more = _fields(pieces, "CellData", ("Cells", *SECTIONS.values()))
    notes = [
        f"the array {name!r} is not read: it is of text, or not in all pieces"
        for name in left_out + more
    ]
    of_points, of_cells = fit_fields(shape, of_points, of_cells)
    return of_points, of_cells, *notes


def _open(data: bytes) -> list[_Piece]:
    """Return the pieces of a file that hold anything."""
    # Raw appended data are not text, and are cut out before the tags are parsed.
    raw = RAW.search(data)
    tags, appended = data, b""
    if raw:
        end = max(data.rfind(b"</AppendedData"), raw.end())
        tags, appended = data[: raw.end()] + data[end:], data[raw.end() : end]
    root = parse_xml(tags, "VTK")
    kind = str(root.get("type"))
    if root.tag != "VTKFile":
        raise FileFormatError(f"A VTK file in XML must be a VTKFile; it is a {root.tag[:30]}.")
    if kind not in ("UnstructuredGrid", "PolyData"):
        raise other_dataset(kind)
    section = root.find("AppendedData")
    if section is not None and not raw:
        appended = (section.text or "").strip().removeprefix("_").encode()
    order = _choose(root, "byte_order", ORDERS, "LittleEndian")
    size = np.dtype(order + _choose(root, "header_type", HEADER_TYPES, "UInt32"))
    compressor = root.get("compressor") or None
    packing = _Packing(size, order, compressor, appended, raw is not None, len(data))
    pieces = [_Piece(each, packing) for each in root.findall(f"./{kind}/Piece")]
    pieces = [piece for piece in pieces if piece.count("Points")]
    if not pieces:
        raise FileFormatError("A VTK file must hold pieces with points; it holds none.")
    return pieces


def _choose(root: Element, name: str, known: dict[str, str], usual: str) -> str:
    word = root.get(name, usual)
    if word not in known:
        raise FileFormatError(
            f"{name} of a VTK file must be {' or '.join(known)}; it is {word[:30]!r}."
        )
    return known[word]


def _shape(pieces: Sequence[_Piece]) -> VtkShape:
    """Return the points and cells of all pieces."""
    points, lists, types = [], [], []
    first = 0  # point of the piece
    for piece in pieces:
        points.append(piece.points())
        of_piece, kinds = piece.cells()
        n_points = len(points[-1])
        require_joined(of_piece, n_points)
        lists.append(CellLists(of_piece.starts, of_piece.corners + first))
        types.append(kinds)
        first += n_points
    shape = sort_cells(np.concatenate(points), CellLists.join(lists), np.concatenate(types))
    if len(pieces) > 1:
        shape.notes.append(
            f"{len(pieces)} pieces were joined; points at their borders may be double, which the "
            "repair weld_seams joins"
        )
    return shape


def _fields(
    pieces: Sequence[_Piece], section: str, counted: Sequence[str]
) -> tuple[Arrays, list[str]]:
    """Return the functions that all pieces have, and the names of other arrays."""
    found: dict[str, list[np.ndarray]] = {}
    for piece in pieces:
        count = sum(map(piece.count, counted))
        for array in piece.element.findall(f"./{section}/*"):
            name = array.get("Name", section)
            parts = found.setdefault(name, [])
            width = array.get("NumberOfComponents", "1")
            if array.get("type") in NUMBERS and re.fullmatch(r"[0-9]{1,9}", width):
                values = piece.packing.numbers(array, count * int(width))
                values = values.astype(values.dtype.newbyteorder("="))
                parts.append(values if width == "1" else values.reshape(count, int(width)))
    whole = {
        name: np.concatenate(parts)
        for name, parts in found.items()
        if len(parts) == len(pieces) and len({part.shape[1:] for part in parts}) == 1
    }
    return whole, [name for name in found if name not in whole]


def format_piece(
    kind: str, section: str, mesh: Mesh, of_points: Arrays, of_cells: Arrays, types: str = ""
) -> bytes:
    """Write a file of one piece: a mesh with functions on its points and cells.

    The cells stand in a section, with the tag of their types if it needs one.
    """
    n_cells, n_corners = mesh.simplices.shape
    ends = n_corners * np.arange(1, n_cells + 1)
    # VTK has no points in the plane.
    places = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    lines = [
        f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        f"<{kind}>",
        f'<Piece NumberOfPoints="{mesh.n_points}" NumberOf{section}="{n_cells}">',
        "<PointData>", *map(array_tag, of_points, of_points.values()), "</PointData>",
        "<CellData>", *map(array_tag, of_cells, of_cells.values()), "</CellData>",
        "<Points>", array_tag("Points", places), "</Points>",
        f"<{section}>", array_tag("connectivity", mesh.simplices.ravel()),
        array_tag("offsets", ends), types, f"</{section}>",
        "</Piece>", f"</{kind}>", "</VTKFile>", "",
    ]  # fmt: skip
    return "\n".join(lines).encode()


def array_tag(name: str, values: np.ndarray) -> str:
    """Write an array in base64, with its number of bytes before it."""
    kind = next(kind for kind, code in NUMBERS.items() if code == values.dtype.str[1:])
    data = values.astype(values.dtype.newbyteorder("<")).tobytes()
    text = base64.b64encode(struct.pack("<Q", len(data)) + data).decode()
    width = f'NumberOfComponents="{values.shape[1]}" ' if values.ndim == 2 else ""
    return (
        f'<DataArray type="{kind}" Name={quoteattr(name)} {width}format="binary">{text}</DataArray>'
    )
