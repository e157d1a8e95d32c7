"""Gmsh files of version 2.2 and 4.1, text or binary: nodes and elements.

All other sections are skipped. The format is described at
https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format
"""

import re

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.cells import N_CORNERS, SEGMENTS, Cells, require_splittable
from eigenshape.io.formats.numbers import Cursor, quote_line, wholes

VERSIONS = {b"2": 2, b"2.1": 2, b"2.2": 2, b"4": 4, b"4.1": 4}
POINT = 15  # elements of one node, which are ignored
KINDS = {
    1: SEGMENTS, 2: "triangles", 3: "quads", 4: "tetrahedra", 5: "hexahedra", 6: "wedges", 7: "pyramids",
}  # fmt: skip
CORNERS = {POINT: 1, **{kind: N_CORNERS[name] for kind, name in KINDS.items()}}
NODE = np.dtype([("tag", "<i4"), ("place", "<f8", 3)])  # of a binary file of version 2
RULE = "Nodes and elements of a gmsh file must be as it declares them"

Rows = list[tuple[int, Int[np.ndarray, "_ _"]]]  # gmsh's number of a type, and tags of nodes


def parse(data: bytes) -> tuple[Float[np.ndarray, "n 3"], Cells]:
    """Return points and cells by kind.

    Raise FileFormatError if a section is missing or occurs twice, nodes and elements are not as
    declared, or an element has curved sides.
    """
    words, _, order = _section(data, b"MeshFormat").partition(b"\n")
    version, form, n_bytes = [*words.split(), b"", b"", b""][:3]
    if version not in VERSIONS or form not in (b"0", b"1") or n_bytes not in (b"4", b"8"):
        raise FileFormatError(
            "A gmsh file must be of version 2.2 or 4.1; its format is "
            f"{quote_line((0, words))}. Save it anew."
        )
    is_text, size = form == b"0", f"<u{n_bytes.decode()}"
    if not is_text and order[:4] != b"\1\0\0\0":
        raise FileFormatError(
            "A binary gmsh file must have the order of bytes of this machine. Save it anew as text."
        )
    nodes, elements = (
        Cursor(_section(data, name), "A gmsh file", is_text=is_text)
        for name in (b"Nodes", b"Elements")
    )
    if VERSIONS[version] == 4:
        tags, points = _node_blocks(nodes, size)
        return points, _cells(tags, _element_blocks(elements, size))
    tags, points = _plain_nodes(nodes, _plain_count(nodes))
    read_elements = _listed_elements if is_text else _plain_elements
    return points, _cells(tags, read_elements(elements, _plain_count(elements)))


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
        kind, n_tags = words[place + 1 : place + 3] if place + 3 <= n_words else (POINT, -1)
        _require_known([kind])
        place += 3 + n_tags
        starts.setdefault(kind, []).append(place)
        place += CORNERS[kind]
        if n_tags < 0 or place > n_words:
            raise FileFormatError(f"{RULE}; element {index} of {count} is not whole.")
    if place != n_words:
        raise FileFormatError(f"{RULE}; more follows after the last of {count} elements.")
    return [
        (kind, flat[np.array(some)[:, None] + np.arange(CORNERS[kind])])
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
        width = 1 + n_tags + CORNERS[kind]
        block = section.take("<i4", height * width).reshape(height, width)
        rows.append((kind, block[:, 1 + n_tags :]))
        count -= height
    section.require_end()
    return rows


def _node_blocks(
    section: Cursor, size: str
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Read nodes of version 4: four counts, then blocks of a head, tags and coordinates."""
    n_blocks, total, _, _ = section.wholes(size, 4).tolist()
    tags, points = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))]
    for _ in range(n_blocks):
        _, _, parametric = section.wholes("<i4", 3)
        if parametric:
            raise FileFormatError(
                "Nodes of a gmsh file must have three coordinates; some have parametric ones, too. "
                "Save it without (Mesh.SaveParametric = 0)."
            )
        (height,) = section.wholes(size, 1).tolist()
        tags.append(section.wholes(size, height))
        points.append(section.take("<f8", 3 * height).reshape(-1, 3))
    section.require_end()
    _require_total(sum(map(len, tags)), total, "nodes")
    return np.concatenate(tags), np.concatenate(points)


def _element_blocks(section: Cursor, size: str) -> Rows:
    """Read elements of version 4: four counts, then blocks of a head and rows of tag and nodes."""
    n_blocks, total, _, _ = section.wholes(size, 4).tolist()
    rows: Rows = []
    for _ in range(n_blocks):
        _, _, kind = section.wholes("<i4", 3).tolist()
        (height,) = section.wholes(size, 1).tolist()
        if height:
            _require_known([kind])
            width = 1 + CORNERS[kind]
            rows.append((kind, section.wholes(size, height * width).reshape(-1, width)[:, 1:]))
    section.require_end()
    _require_total(sum(len(block) for _, block in rows), total, "elements")
    return rows


def _require_known(kinds: list[int]) -> None:
    require_splittable([f"elements of gmsh's type {kind}" for kind in kinds if kind not in CORNERS])


def _require_total(found: int, declared: int, what: str) -> None:
    if found != declared:
        raise FileFormatError(f"{RULE}; it declares {declared} {what} and holds {found}.")


def _cells(tags: Int[np.ndarray, " n"], rows: Rows) -> Cells:
    """Return cells by kind, with the order of nodes in the file instead of their tags.

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
    blocks: dict[str, np.ndarray] = {}
    for kind, name in KINDS.items():
        of_kind = [block for found, block in rows if found == kind]
        if not of_kind:
            continue
        corners = np.concatenate(of_kind)
        places = np.searchsorted(ascending, corners).clip(max=max(len(tags) - 1, 0))
        unknown = corners[ascending[places] != corners] if tags.size else corners.ravel()
        if unknown.size:
            raise FileFormatError(
                f"Elements of a gmsh file must join its nodes; no node has the tag {unknown[0]}."
            )
        blocks[name] = order[places]
    return blocks
