"""Selection of the cells of a file: those of the highest dimension, or of a requested kind."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, Literal, get_args

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.errors import FileFormatError, InvalidParameterError
from eigenshape.geometry.polygons import triangulate_polygons
from eigenshape.geometry.solids import N_TETRAHEDRA, split_solids
from eigenshape.io.formats.registry import CellKind

SEGMENTS = "segments"
FOUR_CORNERED = "polygons of four corners"  # quads or tetrahedra: LaPy writes both as polygons
N_CORNERS = {
    SEGMENTS: 2, "triangles": 3, "quads": 4, "tetrahedra": 4, "hexahedra": 8, "wedges": 6, "pyramids": 5,
}  # fmt: skip
SOLIDS = ("hexahedra", "wedges", "pyramids")
NO_TRIANGLES = np.empty((0, 3), dtype=np.int64)
# Corners by CellKind or another kind of cell: arrays of rows, and CellLists of "polygons"
Cells = dict[str, Any]
# Points, cells and notes; functions on points, functions on cells, and notes
ParsedShape = tuple[Float[np.ndarray, "n 3"], Cells, *tuple[str, ...]]
ParsedFields = tuple[dict[str, np.ndarray], dict[str, np.ndarray], *tuple[str, ...]]
# Of four corners, the sides of a polygon and the faces of a tetrahedron
SIDES = [[0, 1], [1, 2], [2, 3], [3, 0]]
FACES = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]
# Largest volume of a flat cell, as a share of its size cubed; single precision gives 1e-7.
FLAT = 1e-6


@dataclass(frozen=True)
class CellLists:
    """Lists of points of varying length: list i is corners[starts[i] : starts[i + 1]]."""

    starts: Int[np.ndarray, " c1"]
    corners: Int[np.ndarray, " k"]

    @property
    def lengths(self) -> Int[np.ndarray, " c"]:
        """Number of points of each list."""
        return np.diff(self.starts)

    def take(self, chosen: Int[np.ndarray, " s"]) -> "CellLists":
        """Return the chosen lists."""
        lengths = self.lengths[chosen]
        ends = np.cumsum(lengths)
        places = np.arange(lengths.sum()) + np.repeat(self.starts[chosen] - ends + lengths, lengths)
        return CellLists(np.append(0, ends), self.corners[places])

    def pairs(self) -> Int[np.ndarray, "p 2"]:
        """Return the pairs of successive points in each list."""
        owner = np.repeat(np.arange(len(self.lengths)), self.lengths)
        follows = owner[1:] == owner[:-1]
        return np.column_stack([self.corners[:-1][follows], self.corners[1:][follows]])

    @staticmethod
    def join(parts: Sequence["CellLists"]) -> "CellLists":
        """Return the lists of all parts, one after the other."""
        lengths = [np.zeros(1, dtype=np.int64), *(part.lengths for part in parts)]
        corners = [np.zeros(0, dtype=np.int64), *(part.corners for part in parts)]
        return CellLists(np.cumsum(np.concatenate(lengths)), np.concatenate(corners))


def require_kind(cells: str | None) -> None:
    """Raise an error if there is no such kind of cells."""
    if cells is not None and cells not in get_args(CellKind):
        raise InvalidParameterError(
            f"cells must be {', '.join(get_args(CellKind))} or None; it is {cells!r}."
        )


def require_splittable(others: Sequence[str]) -> None:
    """Raise an error that names the cells that can neither be taken nor split."""
    if others:
        raise FileFormatError(
            "A file must hold simplices, quads, hexahedra, wedges or pyramids, with straight sides; "
            f"it holds {', '.join(others)}. Save it with simplices, or with straight sides."
        )


def select_cells(
    points: Float[np.ndarray, "n d"], blocks: Cells, cells: CellKind | None
) -> Int[np.ndarray, "s corners"]:
    """Return the simplices of the requested kind, where quads and polygons become triangles.

    The kind "triangles" includes those of polygons, "quads" all triangles, and "tetrahedra" those of
    hexahedra, wedges and pyramids. Without cells the shape is (0, 3).

    Raise FileFormatError if the file has no cells of the requested kind, and InvalidShapeError if a
    polygon crosses itself, or a hexahedron, wedge or pyramid cannot be split.
    """
    blocks = dict(blocks)
    if FOUR_CORNERED in blocks:
        four = blocks.pop(FOUR_CORNERED)
        kind: str | None = "tetrahedra" if cells == "tetrahedra" else "quads"
        if cells is None:
            kind = four_cornered(points, four)
        if kind is None:
            raise FileFormatError(
                f"Polygons of four corners must be known to be quads or tetrahedra; these {len(four)} could be either; "
                f'the first is {four[0].tolist()}. cells="quads" or cells="tetrahedra" says which in read_shape and '
                "read_mesh, and --cells in the commands info, spectrum and repair."
            )
        blocks[kind] = four
    tetrahedra = blocks.get("tetrahedra", np.empty((0, 4), dtype=np.int64))
    if cells in (None, "tetrahedra"):
        split = [split_solids(points, blocks[name]).simplices for name in SOLIDS if name in blocks]
        tetrahedra = np.concatenate([tetrahedra, *split])
        if cells is None and len(tetrahedra):
            return tetrahedra
    triangles = blocks.get("triangles", NO_TRIANGLES)
    if "polygons" in blocks:
        polygons = blocks.pop("polygons")
        cut, _ = triangulate_polygons(points, polygons.starts, polygons.corners)
        blocks["triangles"] = triangles = np.concatenate([cut, triangles])
    quads = NO_TRIANGLES
    if cells in (None, "quads") and "quads" in blocks:
        quads = polygon_triangles(points, blocks["quads"])
    surface = np.concatenate([triangles, quads])
    if cells is None:
        return surface if len(surface) else blocks.get(SEGMENTS, surface)
    found = {"tetrahedra": tetrahedra, "quads": surface, "triangles": triangles}[cells]
    if not len(found):
        held = ", ".join(name for name, block in blocks.items() if len(block)) or "points alone"
        raise FileFormatError(
            f"A file that is read with cells={cells!r} must hold {cells}; it holds {held}."
        )
    return found


def split_sentence(blocks: Cells) -> str:
    """Say which cells of a file were split into tetrahedra; nothing if there are none."""
    solids = {name: blocks[name] for name in SOLIDS if name in blocks and len(blocks[name])}
    if not solids:
        return ""
    counts = [f"{len(cells):,} {name}" for name, cells in solids.items()]
    n_made = sum(len(cells) * N_TETRAHEDRA[cells.shape[1]] for cells in solids.values())
    return f"{' and '.join(counts)} were split into {n_made:,} tetrahedra"


def four_cornered(
    points: Float[np.ndarray, "n d"], cells: Int[np.ndarray, "c 4"]
) -> Literal["quads", "tetrahedra"] | None:
    """Return whether cells of four corners are quads or tetrahedra; None if they could be either.

    They are quads if all are flat, or if they join like the faces of a surface: most share a side
    with another cell, no side belongs to more than two, and few cells share three corners. They are
    tetrahedra if most share three corners with another, and some side belongs to more than two.
    """
    if not len(cells) or cells.min() < 0 or cells.max() >= len(points):
        return "quads"  # the mesh that is built from them raises an error with the index
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    size = np.abs(edges).max(axis=(1, 2))
    unit = edges / np.where(size > 0, size, 1.0)[:, None, None]
    if points.shape[1] < 3 or (np.abs(np.linalg.det(unit)) <= FLAT).all():
        return "quads"
    cells = cells[np.unique(np.sort(cells, axis=1), axis=0, return_index=True)[1]]
    shares_triple = (_multiplicities(cells[:, FACES]) > 1).any(axis=1).mean()
    of_sides = _multiplicities(cells[:, SIDES])
    if of_sides.max() > 2:
        return "tetrahedra" if shares_triple > 0.5 else None
    shares_side = (of_sides == 2).any(axis=1).mean()
    return "quads" if shares_triple < 0.5 < shares_side else None


def _multiplicities(rows: Int[np.ndarray, "c p corners"]) -> Int[np.ndarray, "c p"]:
    """Return, for each row of corners, how often it occurs in any order."""
    flat = np.sort(rows.reshape(-1, rows.shape[2]), axis=1)
    _, inverse, counts = np.unique(flat, axis=0, return_inverse=True, return_counts=True)
    return counts[inverse.ravel()].reshape(rows.shape[:2])


def polygon_triangles(
    points: Float[np.ndarray, "n d"],
    polygons: Sequence[Sequence[int]] | Int[np.ndarray, "p c"],
) -> Int[np.ndarray, "f 3"]:
    """Cut polygons, lists of corners or rows of a table, into triangles."""
    if isinstance(polygons, np.ndarray) and polygons.shape[1] == 3:
        return polygons
    lists = list_corners(polygons)
    return triangulate_polygons(points, lists.starts, lists.corners)[0]


def list_corners(lists: Sequence[Sequence[int]] | Int[np.ndarray, "p c"]) -> CellLists:
    """Put lists of corners, or rows of a table, one behind the other."""
    starts = np.cumsum([0, *map(len, lists)])
    if isinstance(lists, np.ndarray):
        return CellLists(starts, lists.ravel())
    return CellLists(starts, np.array([*chain.from_iterable(lists)]).astype(np.int64))


def strip_triangles(
    strips: CellLists,
) -> tuple[Int[np.ndarray, "f 3"], Int[np.ndarray, " f"]]:
    """Split strips into triangles, every second one reversed so that all agree, and name their strips.

    A strip changes its direction by a repeated point. The triangles without area that result from
    this are left out.
    """
    counts = (strips.lengths - 2).clip(0)
    owners = np.repeat(np.arange(len(counts)), counts)
    steps = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)  # in the strip
    odd = steps % 2
    first = strips.starts[owners] + steps
    triangles = strips.corners[np.column_stack([first + odd, first + 1 - odd, first + 2])]
    one, two, three = triangles.T
    is_real = (one != two) & (two != three) & (three != one)
    return triangles[is_real], owners[is_real]
