"""A glTF file in the making: a tree, and accessors that are added to it."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from eigenshape.io.formats.gltf import KINDS, WIDTHS, Column, Entry, pack

COMPONENTS = {kind[-2:]: number for number, kind in KINDS.items()}
TYPES = {width: name for name, width in WIDTHS.items()}
Columns = dict[str, Column]


class Document:
    """A glTF tree and the contents of its views, to which accessors are added."""

    def __init__(self, tree: Entry, contents: Iterable[bytes | memoryview] = ()) -> None:
        self.tree, self.contents = tree, list(contents)

    def add_view(self, data: bytes, **entry: Any) -> int:
        """Add a view of some bytes, and return its number."""
        self.contents.append(data)
        self.tree.setdefault("bufferViews", []).append(entry)
        return len(self.contents) - 1

    def add_accessor(self, rows: np.ndarray, view: int, **entry: Any) -> int:
        """Add an accessor of rows that a view holds, and return its number."""
        accessors: list[Any] = self.tree.setdefault("accessors", [])
        kind = {"componentType": COMPONENTS[rows.dtype.str[1:]], "type": TYPES[rows.shape[1]]}
        accessors.append({"bufferView": view, "count": len(rows), **kind, **entry})
        return len(accessors) - 1

    def add_columns(self, columns: Columns) -> dict[str, int]:
        """Add columns, and return their accessors by name."""
        found = {}
        for name, (values, is_normalized) in columns.items():
            rows = np.ascontiguousarray(values)
            octets = rows.view(np.uint8).reshape(len(rows), -1)
            # Rows of attributes begin at multiples of four bytes.
            padded = np.pad(octets, ((0, 0), (0, -octets.shape[1] % 4)))
            view = self.add_view(padded.tobytes(), byteStride=padded.shape[1], target=34962)
            facts: Entry = {"normalized": True} if is_normalized else {}
            if name == "POSITION":
                facts |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
            found[name] = self.add_accessor(rows, view, **facts)
        return found

    def add_rows(self, rows: np.ndarray, **entry: Any) -> int:
        """Add rows that are no attributes of vertices, such as matrices."""
        return self.add_accessor(rows, self.add_view(rows.tobytes()), **entry)

    def add_indices(self, indices: np.ndarray, n_vertices: int) -> int:
        """Add the corners of triangles."""
        rows = indices.astype("<u2" if n_vertices < 2**16 - 1 else "<u4").reshape(-1, 1)
        return self.add_accessor(rows, self.add_view(rows.tobytes(), target=34963))

    def pack(self) -> bytes:
        """Write the document, without views that nothing uses."""
        users = list(_view_users(self.tree))
        views: list[Entry] = []
        places = {}
        binary = bytearray()
        for index in sorted({user["bufferView"] for user in users}):
            data = self.contents[index]
            places[index] = len(views)
            place = {"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)}
            views.append({**self.tree["bufferViews"][index], **place})
            binary += data
            binary += b"\0" * (-len(binary) % 4)
        for user in users:
            user["bufferView"] = places[user["bufferView"]]
        self.tree |= {"bufferViews": views, "buffers": [{"byteLength": len(binary)}]}
        return pack(self.tree, bytes(binary))


def _view_users(value: Any) -> Iterator[Entry]:
    """Give all objects of a tree that name a view; extensions do so by the same key."""
    if isinstance(value, dict):
        if type(value.get("bufferView")) is int:
            yield value
        value = list(value.values())
    if isinstance(value, list):
        for part in value:
            yield from _view_users(part)
