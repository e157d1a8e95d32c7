"""The sections of a gmsh file that describe the mesh, checked before meshio makes room for what they declare."""

import re
import struct
from collections.abc import Sequence

import numpy as np
from jaxtyping import Int

from eigenshape._errors import FileFormatError
from eigenshape.io.text import shown

SECTIONS = (b"MeshFormat", b"Nodes", b"Elements")
VERSIONS = {b"2": 2, b"2.1": 2, b"2.2": 2, b"4": 4, b"4.1": 4}
LARGEST_TAG = (
    10**7
)  # meshio makes a table of that length; a file with more nodes than that may have larger tags
LEAST_BYTES = 8  # of a node in a file
RULE = "Nodes and elements of a gmsh file must be as it declares them"


def mesh_sections(data: bytes) -> tuple[bytes, int]:
    """Return format, nodes and elements alone, and how many elements are declared.

    meshio reads node tags of 0, or tags that two nodes share, as other nodes, and leaves what it lacks as it finds it
    in memory; so they are refused here.

    Raises
    ------
    FileFormatError
        If a section is missing or there twice, the version is another, or nodes are not as declared.
    """
    found = {name: _section(data, name) for name in SECTIONS}
    words = found[b"MeshFormat"].split(b"\n")[0].split()
    if (
        len(words) != 3
        or words[0] not in VERSIONS
        or words[1] not in (b"0", b"1")
        or words[2] not in (b"4", b"8")
    ):
        raise FileFormatError(
            f"A gmsh file must be of version 2.2 or 4.1; its format is {shown((0, b' '.join(words)))}. Save it anew."
        )
    version, is_text, size = VERSIONS[words[0]], words[1] == b"0", int(words[2])
    try:
        _require_tags(_node_tags(found[b"Nodes"], version, is_text, size), len(data))
        n_elements = _n_elements(found[b"Elements"], version, is_text, size)
    except FileFormatError:
        raise
    except (ValueError, OverflowError, struct.error) as err:
        raise FileFormatError(f"{RULE}; a number is missing, or not whole: {err}.") from err
    return b"".join(b"$%b\n%b$End%b\n" % (name, found[name], name) for name in SECTIONS), n_elements


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


def _node_tags(body: bytes, version: int, is_text: bool, size: int) -> Int[np.ndarray, " n"]:
    if version == 2:
        return _plain_tags(body, is_text)
    return _text_block_tags(body.split()) if is_text else _binary_block_tags(body, size)


def _plain_tags(body: bytes, is_text: bool) -> np.ndarray:
    """Read the tags of version 2: a count, then a tag and three coordinates a node."""
    if is_text:
        words = body.split()
        _require_equal(len(words) - 1, 4 * int(words[0] if words else b""), "words of nodes")
        return np.array([int(word) for word in words[1::4]])
    head, _, rows = body.partition(b"\n")
    record = np.dtype([("tag", "<i4"), ("place", "<f8", 3)])
    _require_equal(len(rows) // record.itemsize, int(head), "nodes")
    return np.frombuffer(rows, record, int(head))["tag"].astype(np.int64)


def _text_block_tags(words: Sequence[bytes]) -> np.ndarray:
    """Read the tags of version 4: four counts, then blocks of a head of four, the tags, and the coordinates."""
    n_blocks, total, place = (
        int(words[0]) if words else 0,
        int(words[1]) if len(words) > 1 else -1,
        4,
    )
    tags: list[int] = []
    for _ in range(min(n_blocks, len(words))):
        count = int(b"".join(words[place + 3 : place + 4]))
        _require_room(count, len(words))
        tags += [int(word) for word in words[place + 4 : place + 4 + count]]
        place += 4 + 4 * count
    _require_equal(len(words), place, "words of nodes")
    _require_equal(len(tags), total, "nodes")
    return np.array(tags, dtype=np.int64)


def _binary_block_tags(body: bytes, size: int) -> np.ndarray:
    n_blocks, total, _, _ = _sizes(body, size, 4)
    place, tags = 4 * size, [np.empty(0, dtype=np.int64)]
    for _ in range(min(n_blocks, len(body))):
        (count,) = _sizes(body[place + 12 : place + 12 + size], size, 1)
        _require_room(count, len(body))
        place += 12 + size
        tags.append(np.frombuffer(body, f"<u{size}", count, place).astype(np.int64))
        place += count * (size + 24)
    _require_equal(len(body[:place]) + len(body[place:].strip()), place, "bytes of nodes")
    _require_equal(sum(map(len, tags)), total, "nodes")
    return np.concatenate(tags)


def _sizes(body: bytes, size: int, count: int) -> tuple[int, ...]:
    return struct.unpack_from(f"<{count}{'Q' if size == 8 else 'I'}", body)


def _require_room(count: int, room: int) -> None:
    if not 0 <= count <= room:
        raise FileFormatError(f"{RULE}; a block declares {count} nodes.")


def _require_equal(found: int, declared: int, what: str) -> None:
    if found != declared:
        raise FileFormatError(f"{RULE}; it declares {declared} {what} and holds {found}.")


def _require_tags(tags: Int[np.ndarray, " n"], n_bytes: int) -> None:
    most = max(LARGEST_TAG, n_bytes // LEAST_BYTES)
    if tags.size and not (tags.min() > 0 and tags.max() <= most):
        raise FileFormatError(
            f"Node tags of a gmsh file must lie in 1..{most}; they go from {tags.min()} to {tags.max()}."
        )
    once, counts = np.unique(tags, return_counts=True)
    if len(once) < len(tags):
        raise FileFormatError(
            f"Nodes of a gmsh file must have tags of their own; {counts.max()} have the tag {once[np.argmax(counts)]}."
        )


def _n_elements(body: bytes, version: int, is_text: bool, size: int) -> int:
    if version == 4:
        return int(b"".join(body.split()[1:2])) if is_text else _sizes(body, size, 4)[1]
    lines = body.split(b"\n", 1)
    if is_text:
        rows = [line for line in body.splitlines() if line.strip()]
        _require_equal(len(rows) - 1, int(lines[0]), "elements")
    return int(lines[0])
