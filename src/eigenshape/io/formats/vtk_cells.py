"""Cells of VTK files, legacy and XML: lists of points, and the number of their type."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.cells import SEGMENTS

VERTEX, POLY_VERTEX, LINE, POLYLINE, TRIANGLE, QUAD, TETRAHEDRON = 1, 2, 3, 4, 5, 9, 10
HEXAHEDRON, WEDGE, PYRAMID = 12, 13, 14
KINDS = {
    LINE: (SEGMENTS, 2),
    TRIANGLE: ("triangles", 3),
    QUAD: ("quads", 4),
    TETRAHEDRON: ("tetrahedra", 4),
    HEXAHEDRON: ("hexahedra", 8),
    WEDGE: ("wedges", 6),
    PYRAMID: ("pyramids", 5),
}
NAMES = {
    6: "triangle strip", 7: "polygon", 8: "pixel", 11: "voxel",
    21: "quadratic edge", 22: "quadratic triangle", 23: "quadratic quad", 24: "quadratic tetrahedron", 42: "polyhedron",
}  # fmt: skip


@dataclass(frozen=True)
class CellLists:
    """Lists of points of varying length: list i is corners[starts[i] : starts[i + 1]]."""

    starts: Int[np.ndarray, " c1"]
    corners: Int[np.ndarray, " k"]

    @property
    def lengths(self) -> Int[np.ndarray, " c"]:
        """Number of points of each list."""
        return np.diff(self.starts)

    def rows(self, chosen: Int[np.ndarray, " s"], length: int) -> Int[np.ndarray, "s length"]:
        """Return lists of equal length as rows."""
        return self.corners[self.starts[chosen][:, None] + np.arange(length)]

    def pairs(self, chosen: Int[np.ndarray, " s"]) -> Int[np.ndarray, "p 2"]:
        """Return the pairs of successive points in lists."""
        owner = np.repeat(np.arange(len(self.lengths)), self.lengths)
        follows = (owner[1:] == owner[:-1]) & np.isin(owner[1:], chosen)
        return np.column_stack([self.corners[:-1][follows], self.corners[1:][follows]])


def cells_of_types(
    lists: CellLists, types: Int[np.ndarray, " c"]
) -> dict[str, Int[np.ndarray, "_ _"]]:
    """Sort cells by their kind; ignore cells that are points.

    Raises
    ------
    FileFormatError
        If a cell has another type, or its number of corners does not match its type.
    """
    others = np.setdiff1d(types, [VERTEX, POLY_VERTEX, POLYLINE, *KINDS])
    if others.size:
        named = ", ".join(NAMES.get(int(kind), f"VTK's type {kind}") for kind in others)
        raise FileFormatError(
            "Cells of a VTK file must be simplices, quads, polylines, hexahedra, wedges or pyramids; "
            f"it holds {named}. Save it with those."
        )
    blocks = {}
    for kind, (name, length) in KINDS.items():
        chosen = np.flatnonzero(types == kind)
        wrong = chosen[lists.lengths[chosen] != length]
        if wrong.size:
            count = lists.lengths[wrong[0]]
            raise FileFormatError(
                f"A VTK cell of type {kind} must have {length} corners; cell {wrong[0]} has {count}."
            )
        if chosen.size:
            blocks[name] = lists.rows(chosen, length)
    polylines = np.flatnonzero(types == POLYLINE)
    if polylines.size:
        blocks[SEGMENTS] = np.concatenate(
            [blocks.get(SEGMENTS, np.empty((0, 2), int)), lists.pairs(polylines)]
        )
    return blocks
