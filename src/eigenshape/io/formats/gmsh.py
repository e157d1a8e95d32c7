"""Gmsh files of version 2 and 4, text or binary: nodes, and elements by their corners.

All other sections are left out, and those that a shape could need are named. The format is described at
https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format

Read: elements by their corners, of versions 2 and 4, text and binary; nodes with parameters.
Kept: nothing besides points and cells.
Named: names of physical groups, partitions and functions; elements of higher order; solids that
    were cut.
Refused: versions 1 and 3; a mesh of Ansys, with the call of meshio that converts it.
"""

import re
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.errors import FileFormatError
from eigenshape._arrays import find_keys
from eigenshape.io.formats.cells import CellLists, ParsedShape, require_splittable
from eigenshape.io.formats.numbers import (
    Cursor,
    quote_line,
    require_distinct,
    whole,
    wholes,
)
from eigenshape.io.formats.vtk_cells import (
    HEXAHEDRON,
    LINE,
    PYRAMID,
    QUAD,
    TETRAHEDRON,
    TRIANGLE,
    VERTEX,
    WEDGE,
    TypedCells,
    sort_cells,
)

# Gmsh writes 4.0 as 4.
VERSIONS = {b"2": 2.2, b"2.1": 2.2, b"2.2": 2.2, b"4": 4.0, b"4.0": 4.0, b"4.1": 4.1}
# VTK's number of the type of an element, and its number of nodes, by gmsh's number of the type
ELEMENTS = {
    1: (LINE, 2), 2: (TRIANGLE, 3), 3: (QUAD, 4), 4: (TETRAHEDRON, 4), 5: (HEXAHEDRON, 8),
    6: (WEDGE, 6), 7: (PYRAMID, 5), 15: (VERTEX, 1),
    # Of second order
    8: (21, 3), 9: (22, 6), 10: (28, 9), 11: (24, 10), 12: (29, 27), 13: (32, 18), 14: (37, 14),
    16: (23, 8), 17: (25, 20), 18: (26, 15), 19: (27, 13),
    # Of third order
    21: (69, 10), 26: (68, 4), 29: (71, 20), 36: (70, 16), 92: (72, 64), 90: (73, 40),
}  # fmt: skip
# Sections that a shape does not keep
LEFT_OUT = {
    b"PhysicalNames": "names of physical groups",
    b"PartitionedEntities": "partitions",
    b"NodeData": "fields on nodes",
    b"ElementData": "fields on elements",
    b"ElementNodeData": "fields on corners of elements",
}
RULE = "Nodes and elements of a gmsh file must be as it declares them"

Nodes = tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n width"]]  # tags, and places
Rows = list[tuple[int, Int[np.ndarray, "_ _"]]]  # gmsh's number of a type, and tags of nodes


def parse(data: bytes) -> ParsedShape:
    """Return points, cells by kind, and notes.

    Raise FileFormatError if a section is missing or occurs twice, or nodes and elements are not as
    declared.
    """
    if data.lstrip()[:1] == b"(":
        raise FileFormatError(
            "A .msh file must be gmsh's; this one is a mesh of Ansys Fluent. meshio reads it: "
            'meshio.read(path, file_format="ansys").write("a.vtu").'
        )
    words, _, order = _section(data, b"MeshFormat").partition(b"\n")
    name, form, n_bytes = [*words.split(), b"", b"", b""][:3]
    if name not in VERSIONS or form not in (b"0", b"1") or n_bytes not in (b"4", b"8"):
        raise FileFormatError(
            "A gmsh file must be of version 2 or 4; its format is "
            f"{quote_line((0, words))}. Save it anew, as gmsh a.msh -save -format msh41 -o b.msh does."
        )
    version, is_text, size = VERSIONS[name], form == b"0", f"<u{n_bytes.decode()}"
    if not is_text and order[:4] != b"\1\0\0\0":
        raise FileFormatError(
            "A binary gmsh file must have the order of bytes of this machine. Save it anew as text."
        )
    is_parametric = b"$ParametricNodes" in data
    if is_parametric and not is_text:
        raise FileFormatError(
            "Nodes of a binary gmsh file of version 2 must have three coordinates; these have "
            "parametric ones, too. Save it without (Mesh.SaveParametric = 0)."
        )
    in_nodes = _section(data, b"ParametricNodes" if is_parametric else b"Nodes")
    if is_parametric:
        # Places on curves and surfaces follow the coordinates.
        lines = in_nodes.splitlines()
        in_nodes = b"\n".join([*[b" ".join(line.split()[:4]) for line in lines], b""])
    nodes = Cursor(in_nodes, "A gmsh file", is_text=is_text)
    elements = Cursor(_section(data, b"Elements"), "A gmsh file", is_text=is_text)
    if version >= 4:
        tags, points = _node_blocks(nodes, size, version)
        rows = _element_blocks(elements, size, version)
    else:
        tags, points = _tagged_nodes(nodes, _count(nodes))
        nodes.require_end()
        read_elements = _listed_elements if is_text else _plain_elements
        rows = read_elements(elements, _count(elements))
    lost = [what for section, what in LEFT_OUT.items() if b"$" + section in data]
    notes = [f"its {', '.join(lost)} are not kept"] if lost else []
    shape = sort_cells(points, *_cells(tags, rows))
    return shape.points, shape.cells, *(notes + shape.notes)


def _section(data: bytes, name: bytes) -> bytes:
    starts = [match.end() for match in re.finditer(rb"\$%b[ \t]*\r?\n" % name, data)]
    if len(starts) != 1:
        raise FileFormatError(
            f"A gmsh file must have one section {name.decode()}; it has {len(starts)}."
        )
    end = data.find(b"$End" + name, starts[0])
    if end < 0:
        raise FileFormatError(f"A gmsh file must be whole; it has no $End{name.decode()}.")
    return data[starts[0] : end]


def _count(section: Cursor) -> int:
    """Return the count before a section of version 2, which is text in binary files, too."""
    line = section.line()
    return whole(line, (1, line), "The count of a section")


def _tagged_nodes(section: Cursor, count: int, width: int = 3) -> Nodes:
    """Read nodes of version 2 and 4.0: a tag and coordinates for each node."""
    if section.is_text:
        table = section.take("<f8", (1 + width) * count).reshape(-1, 1 + width)
        return wholes(table[:, 0], "Node tags of a gmsh file"), table[:, 1:]
    nodes = section.take([("tag", "<i4"), ("place", "<f8", width)], count)
    return nodes["tag"].astype(np.int64), nodes["place"].astype(np.float64)


def _listed_elements(section: Cursor, count: int) -> Rows:
    """Read text of version 2: for each element tag, type, number of tags, tags, nodes."""
    n_words = len(section.data[section.place :].split())
    flat = section.wholes("<i8", n_words)
    words, place = flat.tolist(), 0
    starts: dict[int, list[int]] = {}
    for index in range(count):
        kind, n_tags = words[place + 1 : place + 3] if place + 3 <= n_words else (1, -1)
        place += 3 + n_tags
        starts.setdefault(kind, []).append(place)
        place += _n_nodes(kind)
        if n_tags < 0 or place > n_words:
            raise FileFormatError(f"{RULE}; element {index} of {count} is not whole.")
    if place != n_words:
        raise FileFormatError(f"{RULE}; more follows after the last of {count} elements.")
    return [
        (kind, flat[np.array(some)[:, None] + np.arange(_n_nodes(kind))])
        for kind, some in starts.items()
    ]


def _plain_elements(section: Cursor, count: int) -> Rows:
    """Read blocks of binary version 2: a head with type, number of elements and number of tags.

    Each element is its own tag, then its tags, then its nodes.
    """
    rows: Rows = []
    while count > 0:
        kind, height, n_tags = section.take("<i4", 3).tolist()
        if not (0 < height <= count and n_tags >= 0):
            raise FileFormatError(
                f"{RULE}; a block declares {height} elements with {n_tags} tags each."
            )
        width = 1 + n_tags + _n_nodes(kind)
        block = section.take("<i4", height * width).reshape(height, width)
        rows.append((kind, block[:, 1 + n_tags :]))
        count -= height
    section.require_end()
    return rows


def _blocks(
    section: Cursor, size: str, version: float, what: str
) -> Iterator[tuple[list[int], int]]:
    """Yield the head of each block of version 4, and the number of its rows."""
    n_blocks, total, *_ = section.wholes(size, 4 if version > 4 else 2).tolist()
    found = 0
    for _ in range(n_blocks):
        head = section.wholes("<i4", 3).tolist()
        height = section.one(size)
        found += height
        yield head, height
    section.require_end()
    if found != total:
        raise FileFormatError(f"{RULE}; it declares {total} {what} and holds {found}.")


def _node_blocks(section: Cursor, size: str, version: float) -> Nodes:
    """Read blocks of tags and coordinates; in version 4.0 each tag stands before its coordinates."""
    tags, points = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))]
    for head, height in _blocks(section, size, version, "nodes"):
        dim = head[0] if version > 4 else head[1]
        # Places on a curve or surface follow the coordinates.
        width = 3 + (dim if head[2] and 0 <= dim <= 3 else 0)
        if version > 4:
            found = section.wholes(size, height)
            places = section.take("<f8", width * height).reshape(-1, width)
        else:
            found, places = _tagged_nodes(section, height, width)
        tags.append(found)
        points.append(places[:, :3])
    return np.concatenate(tags), np.concatenate(points)


def _element_blocks(section: Cursor, size: str, version: float) -> Rows:
    """Read blocks of rows of tag and nodes."""
    rows: Rows = []
    for (_, _, kind), height in _blocks(section, size, version, "elements"):
        if height:
            width = 1 + _n_nodes(kind)
            block = section.wholes(size if version > 4 else "<i4", height * width)
            rows.append((kind, block.reshape(-1, width)[:, 1:]))
    return rows


def _n_nodes(kind: int) -> int:
    if kind not in ELEMENTS:
        require_splittable([f"elements of gmsh's type {kind}"])
    return ELEMENTS[kind][1]


def _cells(tags: Int[np.ndarray, " n"], rows: Rows) -> TypedCells:
    """Return the elements and VTK's numbers of their types.

    Nodes have their place in the file instead of their tags.

    Raise FileFormatError if two nodes have one tag, or an element refers to a tag without node.
    """
    if (tags < 1).any():
        raise FileFormatError(
            f"Node tags of a gmsh file must be 1 or more; the least is {tags.min()}."
        )
    rows = [(kind, nodes) for kind, nodes in rows if ELEMENTS[kind][0] != VERTEX]
    require_distinct(tags, "Node tags of a gmsh file")
    lists = CellLists.join(
        [CellLists(nodes.shape[1] * np.arange(len(nodes) + 1), nodes.ravel()) for _, nodes in rows]
    )
    places = find_keys(tags, lists.corners)
    unknown = lists.corners[places < 0]
    if unknown.size:
        raise FileFormatError(
            f"Elements of a gmsh file must join its nodes; no node has the tag {unknown[0]}."
        )
    types = np.array([ELEMENTS[kind][0] for kind, _ in rows], dtype=np.int64)
    return CellLists(lists.starts, places), np.repeat(types, [len(nodes) for _, nodes in rows])
