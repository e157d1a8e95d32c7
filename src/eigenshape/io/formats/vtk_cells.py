"""Cells of VTK's files by their types, and the points and functions that go with them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError
from eigenshape.geometry.solids import N_TETRAHEDRA
from eigenshape.io.formats.cells import (
    FOUR_CORNERED,
    N_CORNERS,
    SEGMENTS,
    SOLIDS,
    CellLists,
    Cells,
    four_cornered,
    straighten,
    strip_triangles,
)
from eigenshape.io.formats.registry import VTK_REMEDY

# The types of cells, as vtkCellType.h numbers them
EMPTY, VERTEX, POLY_VERTEX, LINE, POLYLINE, TRIANGLE, STRIP, POLYGON, PIXEL, QUAD = range(10)
TETRAHEDRON, VOXEL, HEXAHEDRON, WEDGE, PYRAMID = range(10, 15)
LINEAR = {
    LINE: SEGMENTS, TRIANGLE: "triangles", QUAD: "quads", PIXEL: "quads", TETRAHEDRON: "tetrahedra",
    HEXAHEDRON: "hexahedra", VOXEL: "hexahedra", WEDGE: "wedges", PYRAMID: "pyramids",
}  # fmt: skip
# Cells of higher order, those of Lagrange and Bézier last; their corners come first.
CURVED = {
    kind: name
    for name, kinds in {
        SEGMENTS: (21, 35, 68, 75), "triangles": (22, 34, 69, 76), "quads": (23, 28, 30, 70, 77),
        "tetrahedra": (24, 71, 78), "hexahedra": (25, 29, 33, 72, 79),
        "wedges": (26, 31, 32, 73, 80), "pyramids": (27, 37, 74, 81),
    }.items()
    for kind in kinds
}  # fmt: skip
# Pixels and voxels list their corners row by row, quads and hexahedra around them.
AROUND = {PIXEL: [0, 1, 3, 2], VOXEL: [0, 1, 3, 2, 4, 5, 7, 6]}
OTHER_NAMES = {
    15: "pentagonal prism", 16: "hexagonal prism", 36: "quadratic polygon", 41: "convex point set", 42: "polyhedron",
}  # fmt: skip
Arrays = dict[str, np.ndarray]


@dataclass(frozen=True)
class VtkShape:
    """Points and cells by kind, and where they stand in the file."""

    points: Float[np.ndarray, "m d"]
    cells: Cells
    kept: Int[np.ndarray, " m"]  # the numbers of the points
    numbers: dict[str, Int[np.ndarray, " _"]]  # of the cells, by kind as `cells`
    n_points: int  # of the file, as `n_cells`
    n_cells: int
    notes: list[str]


def other_dataset(found: str) -> FileFormatError:
    """Return the error for a file of VTK that holds neither an unstructured grid nor PolyData."""
    return FileFormatError(
        f"A VTK file must hold an unstructured grid or PolyData; it holds {found[:40]!r}.{VTK_REMEDY}"
    )


def surface_lists(sections: dict[int, CellLists]) -> tuple[CellLists, Int[np.ndarray, " c"]]:
    """Return the cells of PolyData by their type, in the order in which VTK counts them."""
    order = [kind for kind in (POLY_VERTEX, POLYLINE, POLYGON, STRIP) if kind in sections]
    counts = [len(sections[kind].lengths) for kind in order]
    types = np.repeat(np.array(order, dtype=np.int64), counts)
    return CellLists.join([sections[kind] for kind in order]), types


def sort_cells(
    points: Float[np.ndarray, "n d"], lists: CellLists, types: Int[np.ndarray, " c"]
) -> VtkShape:
    """Sort cells by their kind, without cells that are points; read curved cells by their corners.

    Each cell is a list of points with VTK's number of its type.

    Raise FileFormatError if a cell has another type, or its number of corners does not match its
    type.
    """
    found = np.unique(types).tolist()
    known = {EMPTY, VERTEX, POLY_VERTEX, POLYLINE, STRIP, POLYGON, *LINEAR, *CURVED}
    others = [OTHER_NAMES.get(kind, f"VTK's type {kind}") for kind in found if kind not in known]
    if others:
        raise FileFormatError(
            "Cells of a VTK file must be simplices, polygons, strips, polylines, hexahedra, voxels, "
            f"wedges or pyramids; it holds {', '.join(others)}.{VTK_REMEDY}"
        )
    cells: Cells = {}
    numbers: dict[str, np.ndarray] = {}
    blocks: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}  # corners, and cells
    for kind in found:
        chosen = np.flatnonzero(types == kind)
        some = lists.take(chosen)
        lengths = some.lengths
        if kind in LINEAR or kind in CURVED:
            name = LINEAR.get(kind) or CURVED[kind]
            n_corners = N_CORNERS[name]
            if kind in LINEAR:
                _require_none(chosen[lengths != n_corners], kind, f"{n_corners} corners", lists)
            else:
                few = chosen[lengths <= n_corners]
                _require_none(few, kind, f"more points than {n_corners} corners", lists)
            around = AROUND.get(kind, range(n_corners))
            blocks.setdefault(name, []).append((lists.rows(chosen, n_corners)[:, around], chosen))
        elif kind == POLYLINE:
            owners = np.repeat(chosen, (lengths - 1).clip(0))
            blocks.setdefault(SEGMENTS, []).append((some.pairs(), owners))
        elif kind == STRIP:
            _require_none(chosen[lengths < 3], kind, "3 corners or more", lists)
            triangles, owners = strip_triangles(some)
            blocks.setdefault("triangles", []).append((triangles, chosen[owners]))
        elif kind == POLYGON:
            _require_none(chosen[lengths < 3], kind, "3 corners or more", lists)
            n_corners = int(lengths[0])
            if n_corners in (3, 4) and (lengths == n_corners).all():
                name = "triangles" if n_corners == 3 else "quads"
                blocks.setdefault(name, []).append((lists.rows(chosen, n_corners), chosen))
            else:
                cells["polygons"], numbers["polygons"] = some, chosen
    for name, parts in blocks.items():
        # Several types become one kind, in the order of the file.
        owners = np.concatenate([owners for _, owners in parts])
        order = np.argsort(owners, kind="stable")
        cells[name] = np.concatenate([corners for corners, _ in parts])[order]
        numbers[name] = owners[order]
    curved = lists.take(np.flatnonzero(np.isin(types, list(CURVED))))
    corners, cells, kept, notes = straighten(points, cells, curved)
    return VtkShape(corners, cells, kept, numbers, len(points), len(types), notes)


def _require_none(cells: Int[np.ndarray, " w"], kind: int, rule: str, lists: CellLists) -> None:
    """Raise an error that names the first of the cells that break a rule."""
    if cells.size:
        raise FileFormatError(
            f"A VTK cell of type {kind} must have {rule}; cell {cells[0]} has "
            f"{lists.lengths[cells[0]]}."
        )


def fit_fields(shape: VtkShape, of_points: Arrays, of_cells: Arrays) -> tuple[Arrays, Arrays]:
    """Return the functions of a file on the points and simplices that `select_cells` takes.

    Each simplex has the value of the cell that it is a part of. A function that has another number
    of rows than the file has points or cells stays as it is.
    """
    cells, numbers = dict(shape.cells), dict(shape.numbers)
    if FOUR_CORNERED in cells:
        four = cells.pop(FOUR_CORNERED)
        kind = four_cornered(shape.points, four) or "tetrahedra"
        cells[kind], numbers[kind] = four, numbers.pop(FOUR_CORNERED)
    rows = np.arange(shape.n_cells)
    for group in (("tetrahedra", *SOLIDS), ("polygons", "triangles", "quads"), (SEGMENTS,)):
        owners = [
            np.repeat(numbers[kind], _n_simplices(kind, cells[kind]))
            for kind in group
            if kind in cells
        ]
        if any(map(len, owners)):
            rows = np.concatenate(owners)
            break

    def chosen(fields: Arrays, count: int, rows: np.ndarray) -> Arrays:
        return {
            name: values[rows] if len(values) == count else values
            for name, values in fields.items()
        }

    return chosen(of_points, shape.n_points, shape.kept), chosen(of_cells, shape.n_cells, rows)


def _n_simplices(
    kind: str, cells: Int[np.ndarray, "c _"] | CellLists
) -> int | Int[np.ndarray, " c"]:
    """Return how many simplices each cell becomes."""
    if isinstance(cells, CellLists):
        return cells.lengths - 2
    return {"quads": 2}.get(kind, N_TETRAHEDRA.get(cells.shape[1], 1))
