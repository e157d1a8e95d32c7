"""Gmsh files of version 2.2 and 4.1, text or binary: nodes and elements.

All other sections are skipped. The format is described at
https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format
"""

import re

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.cells import SEGMENTS, require_splittable
from eigenshape.io.formats.text import numbers_of, quote_line, wholes

VERSIONS = {b"2": 2, b"2.1": 2, b"2.2": 2, b"4": 4, b"4.1": 4}
POINT = 15  # elements of one node, which are ignored
KINDS = {
    1: SEGMENTS, 2: "triangles", 3: "quads", 4: "tetrahedra", 5: "hexahedra", 6: "wedges", 7: "pyramids",
}  # fmt: skip
CORNERS = {1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 7: 5, POINT: 1}
NODE = np.dtype([("tag", "<i4"), ("place", "<f8", 3)])  # of a binary file of version 2
RULE = "Nodes and elements of a gmsh file must be as it declares them"

Rows = list[tuple[int, Int[np.ndarray, "_ _"]]]  # gmsh's number of a type, and tags of nodes


class _Numbers:
    """Reads the numbers of a section in order."""

    def __init__(self, body: bytes, is_text: bool) -> None:
        self.is_text, self.place = is_text, 0
        self.source: bytes | list[bytes] = body.split() if is_text else body

    def take(self, kind: str, count: int) -> np.ndarray:
        """Return the next `count` numbers; `kind` is their numpy type in a binary file.

        Raises
        ------
        FileFormatError
            If there are fewer, or a word of a text file is not a number.
        """
        size = 1 if self.is_text else np.dtype(kind).itemsize
        end = self.place + count * size
        if not self.place <= end <= len(self.source):
            raise FileFormatError(f"{RULE}; {count} numbers are declared where fewer are left.")
        if isinstance(self.source, bytes):
            found = np.frombuffer(self.source, kind, count, self.place)
        else:
            try:
                found = numbers_of(self.source[self.place : end])
            except ValueError as err:
                raise FileFormatError(f"{RULE}; a word is no number: {err}.") from err
            found = found if kind[1] == "f" else wholes(found, "Tags and counts of a gmsh file")
        self.place = end
        return found

    def count(self, kind: str) -> int:
        """Return the next number."""
        return int(self.take(kind, 1)[0])

    def require_end(self) -> None:
        """Raise an error if numbers remain."""
        rest = self.source[self.place :]
        if len(rest.strip() if isinstance(rest, bytes) else rest):
            raise FileFormatError(f"{RULE}; more follows after the last that is declared.")


def parse(data: bytes) -> tuple[Float[np.ndarray, "n 3"], dict[str, Int[np.ndarray, "_ _"]]]:
    """Return points and cells by kind.

    Raises
    ------
    FileFormatError
        If a section is missing or occurs twice, nodes and elements are not as declared, or an
        element has curved sides.
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
    nodes, elements = _section(data, b"Nodes"), _section(data, b"Elements")
    if VERSIONS[version] == 2:
        tags, points = _plain_nodes(nodes, is_text)
        rows = _listed_elements(elements) if is_text else _plain_elements(elements)
    else:
        tags, points = _node_blocks(_Numbers(nodes, is_text), size)
        rows = _element_blocks(_Numbers(elements, is_text), size)
    return points, _cells(tags, rows)


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


def _plain_nodes(
    body: bytes, is_text: bool
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Read nodes of version 2: a count, then a tag and three coordinates for each node."""
    if is_text:
        numbers = _Numbers(body, is_text)
        table = numbers.take("<f8", 4 * numbers.count("<i8")).reshape(-1, 4)
        numbers.require_end()
        return wholes(table[:, 0], "Node tags of a gmsh file"), table[:, 1:]
    count, numbers = _split_count(body)
    found = numbers.take("|u1", count * NODE.itemsize).view(NODE)
    numbers.require_end()
    return found["tag"].astype(np.int64), found["place"].astype(np.float64)


def _split_count(body: bytes) -> tuple[int, _Numbers]:
    """Return the count before a binary section of version 2, which is text, and the section."""
    head, _, rest = body.partition(b"\n")
    return _Numbers(head, is_text=True).count("<i8"), _Numbers(rest, is_text=False)


def _listed_elements(body: bytes) -> Rows:
    """Read text of version 2: for each element tag, type, number of tags, tags, nodes."""
    numbers = _Numbers(body, is_text=True)
    count = numbers.count("<i8")
    flat = numbers.take("<i8", len(numbers.source) - 1)
    words, place = flat.tolist(), 0
    starts: dict[int, list[int]] = {}
    for index in range(count):
        kind, n_tags = words[place + 1 : place + 3] if place + 3 <= len(words) else (POINT, -1)
        _require_known([kind])
        place += 3 + n_tags
        starts.setdefault(kind, []).append(place)
        place += CORNERS[kind]
        if n_tags < 0 or place > len(words):
            raise FileFormatError(f"{RULE}; element {index} of {count} is not whole.")
    if place != len(words):
        raise FileFormatError(f"{RULE}; more follows after the last of {count} elements.")
    return [
        (kind, flat[np.array(some)[:, None] + np.arange(CORNERS[kind])])
        for kind, some in starts.items()
    ]


def _plain_elements(body: bytes) -> Rows:
    """Read blocks of binary version 2: a head with type, number of elements and number of tags.

    Each element is its own tag, then its tags, then its nodes.
    """
    count, numbers = _split_count(body)
    rows: Rows = []
    while count > 0:
        kind, height, n_tags = (numbers.count("<i4") for _ in range(3))
        _require_known([kind])
        if not (0 < height <= count and n_tags >= 0):
            raise FileFormatError(
                f"{RULE}; a block declares {height} elements with {n_tags} tags each."
            )
        width = 1 + n_tags + CORNERS[kind]
        rows.append(
            (kind, numbers.take("<i4", height * width).reshape(height, width)[:, 1 + n_tags :])
        )
        count -= height
    numbers.require_end()
    return rows


def _node_blocks(
    numbers: _Numbers, size: str
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Read nodes of version 4: four counts, then blocks of a head, tags and coordinates."""
    n_blocks, total, _, _ = (numbers.count(size) for _ in range(4))
    tags, points = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))]
    for _ in range(n_blocks):
        _, _, parametric = numbers.take("<i4", 3)
        if parametric:
            raise FileFormatError(
                "Nodes of a gmsh file must have three coordinates; some have parametric ones, too. "
                "Save it without (Mesh.SaveParametric = 0)."
            )
        height = numbers.count(size)
        tags.append(numbers.take(size, height).astype(np.int64))
        points.append(numbers.take("<f8", 3 * height).reshape(-1, 3))
    numbers.require_end()
    _require_total(sum(map(len, tags)), total, "nodes")
    return np.concatenate(tags), np.concatenate(points)


def _element_blocks(numbers: _Numbers, size: str) -> Rows:
    """Read elements of version 4: four counts, then blocks of a head and rows of tag and nodes."""
    n_blocks, total, _, _ = (numbers.count(size) for _ in range(4))
    rows: Rows = []
    for _ in range(n_blocks):
        kind = int(numbers.take("<i4", 3)[2])
        height = numbers.count(size)
        if height:
            _require_known([kind])
            width = 1 + CORNERS[kind]
            rows.append(
                (
                    kind,
                    numbers.take(size, height * width)
                    .reshape(height, width)[:, 1:]
                    .astype(np.int64),
                )
            )
    numbers.require_end()
    _require_total(sum(len(block) for _, block in rows), total, "elements")
    return rows


def _require_known(kinds: list[int]) -> None:
    require_splittable([f"elements of gmsh's type {kind}" for kind in kinds if kind not in CORNERS])


def _require_total(found: int, declared: int, what: str) -> None:
    if found != declared:
        raise FileFormatError(f"{RULE}; it declares {declared} {what} and holds {found}.")


def _cells(tags: Int[np.ndarray, " n"], rows: Rows) -> dict[str, Int[np.ndarray, "_ _"]]:
    """Return cells by kind, with the order of nodes in the file instead of their tags.

    Raises
    ------
    FileFormatError
        If tags are not positive and distinct, or an element refers to a tag without node.
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
