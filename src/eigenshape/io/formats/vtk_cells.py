"""Cells of VTK's files by their types, and the points and functions that go with them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.errors import FileFormatError
from eigenshape.io.formats.cells import (
    FOUR_CORNERED,
    N_CORNERS,
    SEGMENTS,
    SOLIDS,
    CellLists,
    Cells,
    four_cornered,
    strip_triangles,
)
from eigenshape.io.formats.registry import VTK_REMEDY

# The types of cells, as vtkCellType.h numbers them
EMPTY, VERTEX, POLY_VERTEX, LINE, POLYLINE, TRIANGLE, STRIP, POLYGON, PIXEL, QUAD = range(10)
TETRAHEDRON, VOXEL, HEXAHEDRON, WEDGE, PYRAMID = range(10, 15)
SIMPLEX_TYPES = {2: LINE, 3: TRIANGLE, 4: TETRAHEDRON}  # by their number of corners
FIRST_CURVED = 21  # number of the first type of higher order
# By what they are read as; from 21 on those of higher order, whose corners come first, with those of
# Lagrange and Bézier last
KINDS = {
    kind: name
    for name, kinds in {
        SEGMENTS: (LINE, POLYLINE, 21, 35, 68, 75), "triangles": (TRIANGLE, STRIP, 22, 34, 69, 76),
        "quads": (QUAD, PIXEL, 23, 28, 30, 70, 77), "tetrahedra": (TETRAHEDRON, 24, 71, 78),
        "hexahedra": (HEXAHEDRON, VOXEL, 25, 29, 33, 72, 79), "polygons": (POLYGON,),
        "wedges": (WEDGE, 26, 31, 32, 73, 80), "pyramids": (PYRAMID, 27, 37, 74, 81),
    }.items()
    for kind in kinds
}  # fmt: skip
# Pixels and voxels list their corners row by row, quads and hexahedra around them.
AROUND = {PIXEL: [0, 1, 3, 2], VOXEL: [0, 1, 3, 2, 4, 5, 7, 6]}
OTHER_NAMES = {
    15: "pentagonal prism", 16: "hexagonal prism", 36: "quadratic polygon", 41: "convex point set", 42: "polyhedron",
}  # fmt: skip
N_SIMPLICES = {"quads": 2, "hexahedra": 6, "wedges": 3, "pyramids": 2}  # of a cell
Arrays = dict[str, np.ndarray]
TypedCells = tuple[CellLists, Int[np.ndarray, " c"]]  # and VTK's number of their type


@dataclass(frozen=True)
class VtkShape:
    """Points and cells by kind, and where they stand in the file."""

    points: Float[np.ndarray, "m d"]
    cells: Cells
    kept: Int[np.ndarray, " m"]  # the numbers of the points
    numbers: dict[str, Int[np.ndarray, " _"]]  # the cell of each simplex, by kind as `cells`
    n_points: int  # of the file, as `n_cells`
    n_cells: int
    notes: list[str]


def other_dataset(found: str) -> FileFormatError:
    """Return the error for a file of VTK that holds neither an unstructured grid nor PolyData."""
    return FileFormatError(
        f"A VTK file must hold an unstructured grid or PolyData; it holds {found[:40]!r}.{VTK_REMEDY}"
    )


def surface_lists(sections: dict[int, CellLists]) -> TypedCells:
    """Return the cells of PolyData, which are given by type in the order in which VTK counts them."""
    counts = [len(lists.lengths) for lists in sections.values()]
    types = np.repeat(np.array(list(sections), dtype=np.int64), counts)
    return CellLists.join(list(sections.values())), types


def require_joined(lists: CellLists, n_points: int) -> None:
    """Raise an error if a cell joins a point that there is not."""
    beyond = np.flatnonzero((lists.corners < 0) | (lists.corners >= n_points))
    if beyond.size:
        cell = np.searchsorted(lists.starts, beyond[0], side="right") - 1
        raise FileFormatError(
            f"Cells of a VTK file must join its {n_points} points, counted from 0; cell {cell} joins "
            f"point {lists.corners[beyond[0]]}."
        )


def sort_cells(
    points: Float[np.ndarray, "n d"], lists: CellLists, types: Int[np.ndarray, " c"]
) -> VtkShape:
    """Sort cells by their kind, without cells that are points; read curved cells by their corners.

    Each cell is a list of points with VTK's number of its type.

    Raise FileFormatError if a cell has another type, or its number of corners does not match its
    type.
    """
    found = np.setdiff1d(types, [EMPTY, VERTEX, POLY_VERTEX]).tolist()
    others = [OTHER_NAMES.get(kind, f"VTK's type {kind}") for kind in found if kind not in KINDS]
    if others:
        raise FileFormatError(
            "Cells of a VTK file must be simplices, polygons, strips, polylines, hexahedra, voxels, "
            f"wedges or pyramids; it holds {', '.join(others)}.{VTK_REMEDY}"
        )
    require_joined(lists, len(points))
    n_cells = len(types)
    lists, middles, notes = _straighten(lists, types)
    kept = np.delete(np.arange(len(points)), middles)
    lists = CellLists(lists.starts, np.searchsorted(kept, lists.corners))
    cells: Cells = {}
    numbers: dict[str, np.ndarray] = {}
    parts: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}  # corners, and their cells
    for kind in found:
        name, chosen = KINDS[kind], np.flatnonzero(types == kind)
        some = lists.take(chosen)
        lengths = some.lengths
        least = N_CORNERS.get(name, 3)
        is_open = kind in (POLYLINE, STRIP, POLYGON)
        wrong = chosen[lengths < least if is_open else lengths != least]
        if wrong.size:
            raise FileFormatError(
                f"A VTK cell of type {kind} must have {least} points{' or more' * is_open}; cell "
                f"{wrong[0]} has {lists.lengths[wrong[0]]}."
            )
        if kind == POLYGON:
            cells[name], numbers[name] = some, np.repeat(chosen, lengths - 2)
            continue
        if kind == POLYLINE:
            corners, owners = some.pairs(), np.repeat(chosen, lengths - 1)
        elif kind == STRIP:
            corners, strips = strip_triangles(some)
            owners = chosen[strips]
        else:
            corners, owners = some.corners.reshape(-1, least), chosen
        around = AROUND.get(kind, slice(None))
        parts.setdefault(name, []).append((corners[:, around], owners))
    for name, found_parts in parts.items():
        # Several types become one kind, in the order of the file.
        owners = np.concatenate([owners for _, owners in found_parts])
        order = np.argsort(owners, kind="stable")
        cells[name] = np.concatenate([corners for corners, _ in found_parts])[order]
        numbers[name] = np.repeat(owners[order], N_SIMPLICES.get(name, 1))
    return VtkShape(points[kept], cells, kept, numbers, len(points), n_cells, notes)


def _straighten(
    lists: CellLists, types: Int[np.ndarray, " c"]
) -> tuple[CellLists, Int[np.ndarray, " m"], list[str]]:
    """Return the cells by their corners, the points that are between corners alone, and a note."""
    lengths = lists.lengths
    for kind in set(KINDS) - set(range(FIRST_CURVED)):
        lengths = np.where(types == kind, lengths.clip(max=N_CORNERS[KINDS[kind]]), lengths)
    n_curved = int((lengths < lists.lengths).sum())
    if not n_curved:
        return lists, np.empty(0, dtype=np.int64), []
    owners = np.repeat(np.arange(len(types)), lists.lengths)
    is_corner = np.arange(len(owners)) - lists.starts[owners] < lengths[owners]
    corners = lists.corners[is_corner]
    middles = np.setdiff1d(lists.corners[~is_corner], corners)
    note = (
        f"cells with curved sides were read by their corners ({n_curved:,}), and the points between "
        f"corners were left out ({len(middles):,})"
    )
    return CellLists(np.append(0, np.cumsum(lengths)), corners), middles, [note]


def fit_fields(shape: VtkShape, of_points: Arrays, of_cells: Arrays) -> tuple[Arrays, Arrays]:
    """Return the functions of a file on the points and simplices that `select_cells` takes.

    Each simplex has the value of the cell that it is a part of. A function that has another number
    of rows than the file has points or cells stays as it is.
    """
    numbers = dict(shape.numbers)
    if FOUR_CORNERED in numbers:
        four = numbers.pop(FOUR_CORNERED)
        kind = four_cornered(shape.points, shape.cells[FOUR_CORNERED]) or "tetrahedra"
        numbers[kind] = np.repeat(four, N_SIMPLICES.get(kind, 1))
    rows = np.arange(shape.n_cells)
    for group in (("tetrahedra", *SOLIDS), ("polygons", "triangles", "quads"), (SEGMENTS,)):
        owners = [numbers[kind] for kind in group if kind in numbers]
        if any(map(len, owners)):
            rows = np.concatenate(owners)
            break

    def chosen(fields: Arrays, count: int, rows: np.ndarray) -> Arrays:
        return {
            name: values[rows] if len(values) == count else values
            for name, values in fields.items()
        }

    return chosen(of_points, shape.n_points, shape.kept), chosen(of_cells, shape.n_cells, rows)
