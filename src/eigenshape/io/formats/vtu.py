"""XML files of unstructured grids; only what is requested is unpacked, after a check of sizes."""

import base64
import binascii
import re
import struct
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np
from jaxtyping import Float

from eigenshape._errors import FileFormatError
from eigenshape.geometry.simplicial import Mesh
from eigenshape.io.formats.cells import (
    LINE,
    TETRAHEDRON,
    TRIANGLE,
    CellLists,
    Cells,
    cells_of_types,
)
from eigenshape.io.formats.numbers import (
    COMPRESSORS,
    numbers_of,
    require_reasonable,
    unpack_block,
    wholes,
)

HEADER_TYPES = {"UInt32": "u4", "UInt64": "u8"}
ORDERS = {"LittleEndian": "<", "BigEndian": ">"}
NUMBERS = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4",
    "Int64": "i8", "UInt64": "u8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
# VTK's number of the type of cell, by its number of corners
SIMPLEX_TYPES = {2: LINE, 3: TRIANGLE, 4: TETRAHEDRON}
Arrays = dict[str, np.ndarray]
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

    def numbers(self, array: ElementTree.Element, count: int | None = None) -> np.ndarray:
        """Read an array; a known `count` is checked before anything is unpacked."""
        name = array.get("Name", "an array")
        kind = NUMBERS.get(array.get("type", ""))
        if kind is None:
            raise FileFormatError(
                f"Arrays of a VTU file must be of numbers; {name!r} is of {array.get('type')!r}."
            )
        if array.get("format", "ascii") == "ascii":
            try:
                found = numbers_of((array.text or "").encode().split())
            except ValueError as err:
                raise FileFormatError(
                    f"Arrays of a VTU file must be of numbers; {name!r} is not: {err}."
                ) from err
        else:
            dtype = np.dtype(self.order + kind)
            data = self._data(array, None if count is None else count * dtype.itemsize, name)
            if len(data) % dtype.itemsize:
                raise FileFormatError(
                    f"Arrays of a VTU file must be of whole numbers; {name!r} has {len(data)} bytes."
                )
            found = np.frombuffer(data, dtype)
        if count is not None and len(found) != count:
            raise FileFormatError(
                f"A VTU file must hold what it declares; {name!r} must have {count} numbers and has {len(found)}."
            )
        return found

    def _data(self, array: ElementTree.Element, size: int | None, name: str) -> bytes:
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
            found: list[int] = np.frombuffer(first(text, number * n_head), self.size).tolist()
            return found

        def first(text: bytes, length: int) -> bytes:
            """Return the first bytes that a text holds, raw or in base64."""
            found = text[:length]
            if not is_raw:
                try:
                    found = base64.b64decode(text[: _n_characters(length)], validate=True)[:length]
                except binascii.Error as err:
                    raise FileFormatError(
                        f"Arrays of a VTU file must be in base64; {name!r} is not: {err}."
                    ) from err
            if len(found) < length:
                raise FileFormatError(
                    f"A VTU file must hold what it declares; {name!r} lacks {length - len(found)} of {length} bytes."
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
                f"A VTU file must be compressed by {' or '.join(COMPRESSORS)}, or not at all; it is by "
                f"{self.compressor[:40]!r}. Save it uncompressed."
            )
        (n_blocks,) = counts(1)
        if n_blocks > len(text):
            raise FileFormatError(
                f"A VTU file must hold what it declares; {name!r} is of {n_blocks} blocks."
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


def _require_size(found: int, expected: int | None, name: str) -> None:
    if expected is not None and found != expected:
        raise FileFormatError(
            f"A VTU file must hold what it declares; {name!r} takes {expected} bytes, not {found}."
        )


def parse(data: bytes) -> tuple[Float[np.ndarray, "n d"], Cells]:
    """Return points and cells by kind; attribute data are not unpacked.

    Raise FileFormatError if the content differs from the tags, or they declare more than the file
    can hold.
    """
    piece, packing, n_points, n_cells = _parse_piece(data)
    array = piece.find("./Points/DataArray")
    if array is None:
        raise FileFormatError("A VTU file must have points; it has none.")
    width = (array.get("NumberOfComponents") or "3").strip()
    if width not in ("1", "2", "3"):
        raise FileFormatError(
            f"Points of a VTU file must have 1 to 3 coordinates each; they have {width[:30]!r}."
        )
    numbers = packing.numbers(array, n_points * int(width))
    points = numbers.reshape(n_points, int(width)).astype(np.float64)
    if not n_cells:
        return points, {}
    arrays = {array.get("Name"): array for array in piece.findall("./Cells/DataArray")}
    if not {"connectivity", "offsets", "types"} <= arrays.keys():
        raise FileFormatError(
            f"Cells of a VTU file must have connectivity, offsets and types; it has {', '.join(map(str, arrays))}."
        )
    types = wholes(packing.numbers(arrays["types"], n_cells), "types of a VTU file")
    ends = wholes(packing.numbers(arrays["offsets"], n_cells), "offsets of a VTU file")
    starts = np.concatenate([[0], ends])
    if (np.diff(starts) < 0).any():
        raise FileFormatError(
            f"Offsets of a VTU file must rise from 0; they begin with {ends[:9].tolist()}."
        )
    corners = wholes(
        packing.numbers(arrays["connectivity"], int(starts[-1])), "connectivity of a VTU file"
    )
    return points, cells_of_types(CellLists(starts, corners), types)


def parse_fields(data: bytes) -> tuple[Arrays, Arrays]:
    """Return the functions on points and those on cells, by name; arrays of text are left out.

    Raise FileFormatError if the content differs from the tags, or they declare more than the file
    can hold.
    """
    piece, packing, n_points, n_cells = _parse_piece(data)
    found: list[dict[str, np.ndarray]] = []
    for section, count in (("PointData", n_points), ("CellData", n_cells)):
        arrays = {}
        for array in piece.findall(f"./{section}/DataArray"):
            width = array.get("NumberOfComponents", "1")
            if array.get("type") not in NUMBERS or not re.fullmatch(r"[0-9]{1,9}", width):
                continue
            values = packing.numbers(array, count * int(width))
            values = values.astype(values.dtype.newbyteorder("="))
            name = array.get("Name", section)
            arrays[name] = values if width == "1" else values.reshape(count, int(width))
        found.append(arrays)
    return found[0], found[1]


def _parse_piece(data: bytes) -> tuple[ElementTree.Element, _Packing, int, int]:
    """Return the one piece that has cells, its encoding, and its numbers of points and cells."""
    # Raw appended data are not text, and are cut out before the tags are parsed.
    raw = RAW.search(data)
    tags, appended = data, b""
    if raw:
        end = data.rfind(b"</AppendedData")
        appended = data[raw.end() : max(end, raw.end())]
        tags = data[: raw.end()] + data[max(end, raw.end()) :]
    if b"<!DOCTYPE" in tags:
        raise FileFormatError(
            "A VTU file must be plain XML; it has a DOCTYPE, whose entities could be of any size."
        )
    try:
        root = ElementTree.fromstring(tags)
    except (ElementTree.ParseError, ValueError, LookupError) as err:
        raise FileFormatError(f"A VTU file must be whole XML; {err}.") from err
    if root.tag != "VTKFile" or root.get("type") != "UnstructuredGrid":
        raise FileFormatError(
            f"A VTU file must be a VTKFile of the type UnstructuredGrid; it is a {root.tag[:30]} of "
            f"{str(root.get('type'))[:30]!r}."
        )
    section = root.find("AppendedData")
    if section is not None and not raw:
        appended = (section.text or "").strip().removeprefix("_").encode()
    header_type = root.get("header_type", "UInt32")
    if header_type not in HEADER_TYPES:
        raise FileFormatError(
            f"header_type of a VTU file must be UInt32 or UInt64; it is {header_type[:30]!r}."
        )
    order = root.get("byte_order", "LittleEndian")
    if order not in ORDERS:
        raise FileFormatError(
            f"byte_order of a VTU file must be LittleEndian or BigEndian; it is {order[:30]!r}."
        )
    compressor = root.get("compressor") or None
    size = np.dtype(ORDERS[order] + HEADER_TYPES[header_type])
    packing = _Packing(size, ORDERS[order], compressor, appended, raw is not None, len(data))
    pieces = root.findall("./UnstructuredGrid/Piece")
    counts = [(piece.get("NumberOfPoints", ""), piece.get("NumberOfCells", "")) for piece in pieces]
    if not counts or not all(
        re.fullmatch(r"\s*[0-9]{1,18}\s*", word) for pair in counts for word in pair
    ):
        raise FileFormatError(
            f"A VTU file must hold pieces that count points and cells; the counts are {counts[:9]}."
        )
    filled = [piece for piece, (_, n_cells) in zip(pieces, counts, strict=True) if int(n_cells)]
    if len(filled) > 1:
        raise FileFormatError(
            f"A VTU file must hold one piece; it holds {len(filled)} that have cells. Merge them first."
        )
    piece = filled[0] if filled else pieces[0]
    n_points, n_cells = int(piece.get("NumberOfPoints", "")), int(piece.get("NumberOfCells", ""))
    return piece, packing, n_points, n_cells


def format_fields(mesh: Mesh, of_vertices: Arrays, of_faces: Arrays) -> bytes:
    """Write a mesh and functions on its vertices and cells."""
    names = {kind: name for name, kind in NUMBERS.items()}

    def element(name: str, values: np.ndarray) -> str:
        data = values.astype(values.dtype.newbyteorder("<")).tobytes()
        text = base64.b64encode(struct.pack("<Q", len(data)) + data).decode()
        width = f'NumberOfComponents="{values.shape[1]}" ' if values.ndim == 2 else ""
        return (
            f'<DataArray type="{names[values.dtype.str[1:]]}" Name={quoteattr(name)} '
            f'{width}format="binary">{text}</DataArray>'
        )

    n_cells, n_corners = mesh.simplices.shape
    ends = n_corners * np.arange(1, n_cells + 1)
    types = np.full(n_cells, SIMPLEX_TYPES[n_corners], np.uint8)
    places = np.zeros((mesh.n_points, 3))  # VTK has no points in the plane
    places[:, : mesh.points.shape[1]] = mesh.points
    lines = [
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        "<UnstructuredGrid>",
        f'<Piece NumberOfPoints="{mesh.n_points}" NumberOfCells="{n_cells}">',
        "<PointData>", *(element(name, values) for name, values in of_vertices.items()), "</PointData>",
        "<CellData>", *(element(name, values) for name, values in of_faces.items()), "</CellData>",
        "<Points>", element("Points", places), "</Points>",
        "<Cells>", element("connectivity", mesh.simplices.ravel()), element("offsets", ends),
        element("types", types), "</Cells>", "</Piece>", "</UnstructuredGrid>", "</VTKFile>", "",
    ]  # fmt: skip
    return "\n".join(lines).encode()
