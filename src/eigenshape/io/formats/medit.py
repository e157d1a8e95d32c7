"""Medit files, text (.mesh) or binary (.meshb): vertices and cells with straight sides.

Keywords, their numbers and the binary layout are those of libMeshb:
https://github.com/LoicMarechal/libMeshb

Read: simplices, quads, hexahedra, wedges and pyramids with straight sides.
Kept: nothing besides points and cells.
Named: solids that were cut.
Refused: cells of higher order; a count that the file does not hold.
"""

import re

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import FileFormatError
from eigenshape.io.formats.cells import N_CORNERS, SEGMENTS, Cells, require_splittable
from eigenshape.io.formats.numbers import Cursor, numbers_of, quote_line, wholes

CELLS = {
    "Edges": SEGMENTS, "Triangles": "triangles", "Quadrilaterals": "quads", "Tetrahedra": "tetrahedra",
    "Prisms": "wedges", "Pyramids": "pyramids", "Hexahedra": "hexahedra", "Hexaedra": "hexahedra",
}  # fmt: skip
# Sections that are ignored. An unknown keyword is an error: it could be misspelt cells.
PASSED_OVER = {
    "End", "Corners", "Ridges", "Normals", "Tangents", "AngleOfCornerBound", "BoundingBox",
    "RequiredVertices", "RequiredEdges", "RequiredTriangles", "RequiredQuadrilaterals",
    "RequiredTetrahedra", "NormalAtVertices", "NormalAtTriangleVertices",
    "NormalAtQuadrilateralVertices", "TangentAtVertices", "TangentAtEdges", "SubDomainFromMesh",
    "SubDomainFromGeom", "VertexOnGeometricVertex", "VertexOnGeometricEdge", "EdgeOnGeometricEdge",
}  # fmt: skip
# Comments, and the line of free text after two keywords.
NO_NUMBERS = re.compile(rb"#[^\n]*|^[ \t]*(?:Identifier|Geometry)[ \t]*\n[^\n]*", re.MULTILINE)
KEYWORD = re.compile(rb"^[ \t]*((?!nan|inf)[a-z]\w*)", re.MULTILINE | re.IGNORECASE)

# The same keywords as numbers in a binary file.
DIMENSION, VERTICES, END, LAST = 3, 4, 54, 198
CODES = {
    5: "Edges", 6: "Triangles", 7: "Quadrilaterals", 8: "Tetrahedra",
    9: "Prisms", 10: "Hexahedra", 49: "Pyramids",
}  # fmt: skip
CURVED = {24, 25, 27, 30, 33, *range(86, 94), *range(96, 104)}  # cells of second to fourth order
POLYTOPES = {46, 47}

Found = tuple[Float[np.ndarray, "n d"], Cells]


def parse(data: bytes) -> Found:
    """Return the points, and the cells by kind; only binary files hold zero bytes.

    Raise FileFormatError if a keyword is unknown, a section does not hold what it declares, or a
    cell has curved sides or any number of corners.
    """
    return _parse_binary(data) if b"\0" in data[:8] else _parse_text(data)


def _parse_text(data: bytes) -> Found:
    text = NO_NUMBERS.sub(b"", data.replace(b"\r\n", b"\n").replace(b"\r", b"\n"))
    keywords = list(KEYWORD.finditer(text))
    before = text[: keywords[0].start()] if keywords else text
    if before.strip() or not keywords:
        raise FileFormatError(
            f"A Medit file must begin with a keyword; it begins with {quote_line((0, before))}."
        )
    ends = [match.start() for match in keywords[1:]] + [len(text)]
    single: dict[str, np.ndarray] = {}  # sections that may occur only once
    tables: dict[str, list[np.ndarray]] = {}
    for match, end in zip(keywords, ends, strict=True):
        name = match[1].decode()
        body = text[match.end() : end].split()
        if name in ("MeshVersionFormatted", "Dimension", "Vertices"):
            if name in single:
                raise FileFormatError(f"A Medit file must have one section {name}; it has two.")
            single[name] = _numbers(body, name)
        elif name in CELLS:
            # A label follows the corners.
            rows = _rows(_numbers(body, name), N_CORNERS[CELLS[name]] + 1, name)
            tables.setdefault(name, []).append(wholes(rows.ravel(), name).reshape(rows.shape))
        elif name not in PASSED_OVER:
            raise FileFormatError(
                f"Keywords of a Medit file must be known; {quote_line((0, match[1]))} is not. "
                "Leave that section out if a shape does not need it."
            )
    if b"End" not in text and "Tetrahedra" not in tables:
        raise FileFormatError(
            "A Medit file must be whole; it has no End, and no tetrahedra, after which nothing is "
            "missed."
        )
    version = _single(single, "MeshVersionFormatted", 0, 4)
    dimension = _single(single, "Dimension", 1, 3)
    if "Vertices" not in single:
        raise FileFormatError("A Medit file must have Vertices; it has none.")
    points = _rows(single["Vertices"], dimension + 1, "Vertices")[:, :dimension]
    # Version 1 means single precision, however many digits are written.
    return (points.astype(np.float32) if version < 2 else points).astype(np.float64), _blocks(
        tables
    )


def _numbers(words: list[bytes], name: str) -> Float[np.ndarray, " k"]:
    try:
        return numbers_of(words)
    except ValueError as err:
        raise FileFormatError(f"{name} of a Medit file must be numbers; {err}.") from err


def _single(found: dict[str, np.ndarray], name: str, least: int, most: int) -> int:
    numbers = found.get(name, np.empty(0))
    if len(numbers) != 1 or numbers[0] not in range(least, most + 1):
        raise FileFormatError(
            f"A Medit file must have one {name} of {least} to {most}; "
            f"it has {numbers[:9].tolist()}."
        )
    return int(numbers[0])


def _rows(numbers: Float[np.ndarray, " k"], width: int, name: str) -> Float[np.ndarray, "r width"]:
    """Return the rows of a section, which begins with their number."""
    declared = float(numbers[0]) if numbers.size else -1.0
    if not declared.is_integer() or declared * width != numbers.size - 1:
        raise FileFormatError(
            f"A Medit file must hold what it declares; {name} declares {declared:.15g} rows of "
            f"{width} numbers and holds {max(numbers.size - 1, 0)} numbers."
        )
    return numbers[1:].reshape(-1, width)


def _blocks(tables: dict[str, list[np.ndarray]]) -> Cells:
    """Return the corners of cells, counted from 0 and without their labels, by kind."""
    return {
        CELLS[name]: np.concatenate(rows)[:, :-1].astype(np.int64) - 1
        for name, rows in tables.items()
    }


def _parse_binary(data: bytes) -> Found:
    """Read a file of version 1 to 4, of either byte order."""
    order = {1: "<", 2**24: ">"}.get(int.from_bytes(data[:4], "little"), "")
    cursor = Cursor(data, "A binary Medit file", place=4)
    version = cursor.one(order + "i4") if order else 0
    if not 1 <= version <= 4:
        raise FileFormatError(
            f"A binary Medit file must begin with 1 and a version of 1 to 4; it has {data[:8]!r}."
        )
    whole = order + ("i8" if version == 4 else "i4")
    position = order + ("i8" if version >= 3 else "i4")
    real = order + ("f4" if version == 1 else "f8")
    dimension, points = 0, np.empty((0, 0))
    tables: dict[str, list[np.ndarray]] = {}
    while (code := cursor.one(order + "i4")) != END:
        following = cursor.one(position)
        if code == DIMENSION:
            dimension = cursor.one(order + "i4")
            if dimension not in (2, 3):
                raise FileFormatError(
                    f"Dimension of a Medit file must be 2 or 3; it is {dimension}."
                )
        elif code == VERTICES:
            row = np.dtype([("point", real, (dimension,)), ("label", whole)])
            count = cursor.one(whole)
            points = cursor.take(row, count)["point"].astype(np.float64)
        elif code in CODES:
            name = CODES[code]
            width = N_CORNERS[CELLS[name]] + 1
            count = cursor.one(whole)
            rows = cursor.take(whole, count * width).reshape(count, width)
            tables.setdefault(name, []).append(rows)
        else:
            require_splittable(
                ["curved cells"] if code in CURVED else ["polytopes"] if code in POLYTOPES else []
            )
            if not (0 < code <= LAST and cursor.place < following <= len(data)):
                raise FileFormatError(
                    f"Sections of a binary Medit file must have a keyword of 1 to {LAST} and the "
                    f"place of the next section; one has keyword {code} and place {following} of {len(data)}."
                )
            cursor.place = following
    return points, _blocks(tables)
