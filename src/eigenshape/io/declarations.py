"""What files of unstructured meshes say about themselves, looked at before meshio believes it."""

import re
from contextlib import suppress
from xml.parsers import expat

from eigenshape._errors import FileFormatError
from eigenshape.io.gmsh_sections import mesh_sections
from eigenshape.io.text import shown

DATASET = re.compile(rb"^[ \t]*DATASET[ \t]+(\S+)", re.MULTILINE | re.IGNORECASE)
CELLS = re.compile(rb"^CELLS\s+(\d+)", re.MULTILINE)
# Sections that meshio passes over line by line, however many they declare.
PASSED_OVER = re.compile(rb"(?:RequiredVertices|TangentAtVertices|Tangents|Ridges)[^\r\n]*(?:\r\n|\r|\n)([^\r\n]*)")
HEADER_TYPES = ("UInt32", "UInt64")


def checked(suffix: str, data: bytes) -> tuple[bytes, int | None]:
    """Return what meshio is to read, and how many cells it must find where the file declares that.

    Refused is what would keep meshio busy for ever, or have it make room for far more than the file holds.

    Raises
    ------
    FileFormatError
        With what the file declares.
    """
    if suffix == ".msh":
        return mesh_sections(data)
    if suffix == ".vtu":
        return data, _xml_cells(data)
    if suffix == ".vtk":
        return data, _legacy_cells(data)
    _require_few_lines(data)
    return data, None


def _legacy_cells(data: bytes) -> int | None:
    kind = DATASET.search(data[:1024])
    if kind is None or kind[1].upper() != b"UNSTRUCTURED_GRID":
        name = "no DATASET" if kind is None else f"the DATASET {kind[1][:30].decode('latin-1')}"
        raise FileFormatError(f"A VTK file must hold an UNSTRUCTURED_GRID or POLYDATA; it holds {name}.")
    declared = CELLS.search(data)
    version_5 = b"Version 5" in data[:40]  # counts offsets, one more than cells
    return int(declared[1]) - version_5 if declared else None


def _xml_cells(data: bytes) -> int:
    """Return the number of cells; of several pieces meshio keeps those of the last alone, so there may be one."""
    tags: list[tuple[str, dict[str, str]]] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda name, attributes: tags.append((name, attributes))
    with suppress(expat.ExpatError, ValueError, LookupError):  # raw bytes may follow the tags
        parser.Parse(data, True)
    header_type = tags[0][1].get("header_type", HEADER_TYPES[0]) if tags else None
    if header_type is not None and header_type not in HEADER_TYPES:
        raise FileFormatError(f"header_type of a VTU file must be UInt32 or UInt64; it is {header_type[:30]!r}.")
    if any(attributes.get("Name") in ("faces", "faceoffsets") for name, attributes in tags if name == "DataArray"):
        raise FileFormatError("Cells of a VTU file must be simplices; it holds polyhedra. Split them first.")
    counts = [attributes.get("NumberOfCells", "") for name, attributes in tags if name == "Piece"]
    if not counts or not all(re.fullmatch(r"\s*[0-9]{1,18}\s*", count) for count in counts):
        raise FileFormatError(f"A VTU file must begin with pieces that count their cells; the counts are {counts[:9]}.")
    filled = [int(count) for count in counts if int(count)]
    if len(filled) > 1:
        raise FileFormatError(
            f"A VTU file must hold one piece; it holds {len(filled)} that have cells. Merge them first."
        )
    return sum(filled)


def _require_few_lines(data: bytes) -> None:
    for match in PASSED_OVER.finditer(data):
        count = 0
        with suppress(ValueError):  # what is no number meshio refuses
            count = int(match[1].decode("utf-8"))
        if count > len(data):
            raise FileFormatError(
                f"A mesh file must hold the lines it declares; {shown((0, match[1]))} do not fit into it."
            )
