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

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.cells import CellLists, Cells, require_splittable
from eigenshape.io.formats.numbers import Cursor, quote_line, wholes
from eigenshape.io.formats.vtk_cells import (
    HEXAHEDRON,
    LINE,
    PYRAMID,
    QUAD,
    TETRAHEDRON,
    TRIANGLE,
    VERTEX,
    WEDGE,
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
NODE = np.dtype([("tag", "<i4"), ("place", "<f8", 3)])  # of a binary file of version 2
RULE = "Nodes and elements of a gmsh file must be as it declares them"

Rows = list[tuple[int, Int[np.ndarray, "_ _"]]]  # gmsh's number of a type, and tags of nodes


def parse(data: bytes) -> tuple[Float[np.ndarray, "n 3"], Cells, *tuple[str, ...]]:
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
    if is_text and b"$ParametricNodes" in data:
        # Places on curves and surfaces follow the coordinates.
        lines = _section(data, b"ParametricNodes").splitlines()
        in_nodes = b"\n".join([b" ".join(line.split()[:4]) for line in lines]) + b"\n"
    else:
        if b"$ParametricNodes" in data:
            raise FileFormatError(
                "Nodes of a binary gmsh file of version 2 must have three coordinates; these have "
                "parametric ones, too. Save it without (Mesh.SaveParametric = 0)."
            )
        in_nodes = _section(data, b"Nodes")
    nodes = Cursor(in_nodes, "A gmsh file", is_text=is_text)
    elements = Cursor(_section(data, b"Elements"), "A gmsh file", is_text=is_text)
    if version >= 4:
        tags, points = _node_blocks(nodes, size, version)
        rows = _element_blocks(elements, size, version)
    else:
        tags, points = _plain_nodes(nodes, _plain_count(nodes))
        read_elements = _listed_elements if is_text else _plain_elements
        rows = read_elements(elements, _plain_count(elements))
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


def _plain_count(section: Cursor) -> int:
    """Return the count before a section of version 2, which is text in binary files, too."""
    head = (
        section if section.is_text else Cursor(section.line() + b"\n", section.what, is_text=True)
    )
    return int(head.wholes("<i8", 1)[0])


def _plain_nodes(
    section: Cursor, count: int
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Read nodes of version 2: a tag and three coordinates for each node."""
    if section.is_text:
        table = section.take("<f8", 4 * count).reshape(-1, 4)
        tags, points = wholes(table[:, 0], "Node tags of a gmsh file"), table[:, 1:]
    else:
        nodes = section.take(NODE, count)
        tags, points = nodes["tag"].astype(np.int64), nodes["place"].astype(np.float64)
    section.require_end()
    return tags, points


def _listed_elements(section: Cursor, count: int) -> Rows:
    """Read text of version 2: for each element tag, type, number of tags, tags, nodes."""
    n_words = len(section.data[section.place :].split())
    flat = section.wholes("<i8", n_words)
    words, place = flat.tolist(), 0
    starts: dict[int, list[int]] = {}
    for index in range(count):
        kind, n_tags = words[place + 1 : place + 3] if place + 3 <= n_words else (1, -1)
        _require_known([kind])
        place += 3 + n_tags
        starts.setdefault(kind, []).append(place)
        place += ELEMENTS[kind][1]
        if n_tags < 0 or place > n_words:
            raise FileFormatError(f"{RULE}; element {index} of {count} is not whole.")
    if place != n_words:
        raise FileFormatError(f"{RULE}; more follows after the last of {count} elements.")
    return [
        (kind, flat[np.array(some)[:, None] + np.arange(ELEMENTS[kind][1])])
        for kind, some in starts.items()
    ]


def _plain_elements(section: Cursor, count: int) -> Rows:
    """Read blocks of binary version 2: a head with type, number of elements and number of tags.

    Each element is its own tag, then its tags, then its nodes.
    """
    rows: Rows = []
    while count > 0:
        kind, height, n_tags = section.take("<i4", 3).tolist()
        _require_known([kind])
        if not (0 < height <= count and n_tags >= 0):
            raise FileFormatError(
                f"{RULE}; a block declares {height} elements with {n_tags} tags each."
            )
        width = 1 + n_tags + ELEMENTS[kind][1]
        block = section.take("<i4", height * width).reshape(height, width)
        rows.append((kind, block[:, 1 + n_tags :]))
        count -= height
    section.require_end()
    return rows


def _node_blocks(
    section: Cursor, size: str, version: float
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Read nodes of version 4: counts, then blocks of a head, tags and coordinates.

    In version 4.0 each tag stands before its coordinates.
    """
    n_blocks, total, *_ = section.wholes(size, 4 if version > 4 else 2).tolist()
    tags, points = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))]
    for _ in range(n_blocks):
        head = section.wholes("<i4", 3).tolist()
        dim = head[0] if version > 4 else head[1]
        # Places on a curve or surface follow the coordinates.
        width = 3 + (dim if head[2] and 0 <= dim <= 3 else 0)
        (height,) = section.wholes(size, 1).tolist()
        if version > 4:
            tags.append(section.wholes(size, height))
            places = section.take("<f8", width * height).reshape(-1, width)
        elif section.is_text:
            table = section.take("<f8", (1 + width) * height).reshape(-1, 1 + width)
            tags.append(wholes(table[:, 0], "Node tags of a gmsh file"))
            places = table[:, 1:]
        else:
            rows = section.take([("tag", "<i4"), ("place", "<f8", width)], height)
            tags.append(rows["tag"].astype(np.int64))
            places = rows["place"]
        points.append(places[:, :3])
    section.require_end()
    _require_total(sum(map(len, tags)), total, "nodes")
    return np.concatenate(tags), np.concatenate(points)


def _element_blocks(section: Cursor, size: str, version: float) -> Rows:
    """Read elements of version 4: counts, then blocks of a head and rows of tag and nodes."""
    n_blocks, total, *_ = section.wholes(size, 4 if version > 4 else 2).tolist()
    rows: Rows = []
    for _ in range(n_blocks):
        _, _, kind = section.wholes("<i4", 3).tolist()
        (height,) = section.wholes(size, 1).tolist()
        if height:
            _require_known([kind])
            width = 1 + ELEMENTS[kind][1]
            block = section.wholes(size if version > 4 else "<i4", height * width)
            rows.append((kind, block.reshape(-1, width)[:, 1:]))
    section.require_end()
    _require_total(sum(len(block) for _, block in rows), total, "elements")
    return rows


def _require_known(kinds: list[int]) -> None:
    require_splittable(
        [f"elements of gmsh's type {kind}" for kind in kinds if kind not in ELEMENTS]
    )


def _require_total(found: int, declared: int, what: str) -> None:
    if found != declared:
        raise FileFormatError(f"{RULE}; it declares {declared} {what} and holds {found}.")


def _cells(tags: Int[np.ndarray, " n"], rows: Rows) -> tuple[CellLists, Int[np.ndarray, " c"]]:
    """Return the elements and VTK's numbers of their types.

    Nodes have their place in the file instead of their tags.

    Raise FileFormatError if tags are not positive and distinct, or an element refers to a tag
    without node.
    """
    if tags.size and tags.min() < 1:
        raise FileFormatError(
            f"Node tags of a gmsh file must be 1 or more; the least is {tags.min()}."
        )
    order = np.argsort(tags, kind="stable")
    ascending = tags[order]
    twice = np.flatnonzero(ascending[1:] == ascending[:-1])
    if twice.size:
        raise FileFormatError(
            "Nodes of a gmsh file must have tags of their own; two have the tag "
            f"{ascending[twice[0]]}."
        )
    rows = [(kind, nodes) for kind, nodes in rows if ELEMENTS[kind][0] != VERTEX]
    lists = CellLists.join(
        [CellLists(nodes.shape[1] * np.arange(len(nodes) + 1), nodes.ravel()) for _, nodes in rows]
    )
    places = np.searchsorted(ascending, lists.corners).clip(max=max(len(tags) - 1, 0))
    is_unknown = ascending[places] != lists.corners if tags.size else places >= 0
    unknown = lists.corners[is_unknown]
    if unknown.size:
        raise FileFormatError(
            f"Elements of a gmsh file must join its nodes; no node has the tag {unknown[0]}."
        )
    types = [np.full(len(nodes), ELEMENTS[kind][0]) for kind, nodes in rows]
    none = np.empty(0, dtype=np.int64)
    return CellLists(lists.starts, order[places]), np.concatenate([none, *types])
