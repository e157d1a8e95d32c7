"""Selection of the cells of a file: those of the highest dimension, or of a requested kind."""

from collections.abc import Mapping, Sequence
from typing import Literal, cast, get_args

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError, InvalidParameterError
from eigenshape.geometry.solids import N_TETRAHEDRA, split_solids
from eigenshape.io.formats.cell_kinds import CellKind
from eigenshape.io.formats.text import fans

SEGMENTS = "segments"
SOLIDS = ("hexahedra", "wedges", "pyramids")
Blocks = Mapping[str, Int[np.ndarray, "_ _"]]  # by CellKind, or SEGMENTS
SIDES = ((0, 1), (1, 2), (2, 3), (3, 0))  # of a polygon of four corners
# Largest volume of a flat cell, as a share of its size cubed; single precision gives 1e-7.
FLAT = 1e-6


def require_kind(cells: str | None) -> CellKind | None:
    """Return the kind of cells; raise an error if there is no such kind.

    Raises
    ------
    InvalidParameterError
        If the kind is unknown.
    """
    if cells is not None and cells not in get_args(CellKind):
        raise InvalidParameterError(
            f"cells must be {', '.join(get_args(CellKind))} or None; it is {cells!r}."
        )
    return cast(CellKind | None, cells)


def require_splittable(others: Sequence[str]) -> None:
    """Raise an error that names the cells that can neither be taken nor split.

    Raises
    ------
    FileFormatError
        If there are such cells.
    """
    if others:
        raise FileFormatError(
            "A file must hold simplices, quads, hexahedra, wedges or pyramids, with straight sides; "
            f"it holds {', '.join(others)}. Save it with simplices, or with straight sides."
        )


def select_cells(
    points: Float[np.ndarray, "n d"], blocks: Blocks, cells: CellKind | None
) -> Int[np.ndarray, "s corners"]:
    """Return the simplices of the requested kind, where each quad becomes two triangles.

    The kind "quads" includes the triangles between them, and "tetrahedra" those of hexahedra,
    wedges and pyramids. Without cells the shape is (0, 3).

    Raises
    ------
    FileFormatError
        If the file has no cells of the requested kind.
    InvalidShapeError
        If a hexahedron, wedge or pyramid cannot be split.
    """
    quads = fans(blocks["quads"]) if "quads" in blocks else np.empty((0, 3), dtype=np.int64)
    triangles = blocks.get("triangles", quads[:0])
    surface = np.concatenate([triangles, quads])
    tetrahedra = blocks.get("tetrahedra", np.empty((0, 4), dtype=np.int64))
    if cells in (None, "tetrahedra"):
        split = [split_solids(points, blocks[name]).simplices for name in SOLIDS if name in blocks]
        tetrahedra = np.concatenate([tetrahedra, *split])
    found = {"tetrahedra": tetrahedra, "quads": surface, "triangles": triangles}
    if cells is not None:
        if not len(found[cells]):
            held = ", ".join(name for name, block in blocks.items() if len(block)) or "points alone"
            raise FileFormatError(
                f"A file that is read with cells={cells!r} must hold {cells}; it holds {held}."
            )
        return found[cells]
    by_dimension = [tetrahedra, surface, blocks.get(SEGMENTS, surface)]
    return next((block for block in by_dimension if len(block)), surface)


def split_sentence(blocks: Blocks) -> str:
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
    if _are_flat(points, cells):
        return "quads"
    distinct = np.unique(np.sort(cells, axis=1), axis=0, return_index=True)[1]
    cells = cells[np.sort(distinct)]
    triples = np.sort(
        np.stack([np.delete(cells, corner, axis=1) for corner in range(4)], axis=1), axis=2
    )
    sides = np.sort(np.stack([cells[:, side] for side in SIDES], axis=1), axis=2)
    shares_triple = (_multiplicities(triples) > 1).any(axis=1).mean()
    of_sides = _multiplicities(sides)
    if of_sides.max() > 2:
        return "tetrahedra" if shares_triple > 0.5 else None
    shares_side = (of_sides == 2).any(axis=1).mean()
    return "quads" if shares_triple < 0.5 < shares_side else None


def _are_flat(points: Float[np.ndarray, "n d"], cells: Int[np.ndarray, "c 4"]) -> bool:
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    size = np.abs(edges).max(axis=(1, 2))
    unit = edges / np.where(size > 0, size, 1.0)[:, None, None]
    return points.shape[1] < 3 or bool((np.abs(np.linalg.det(unit)) <= FLAT).all())


def _multiplicities(rows: Int[np.ndarray, "c p corners"]) -> Int[np.ndarray, "c p"]:
    """Return, for each row of corners, how often it occurs."""
    flat = rows.reshape(-1, rows.shape[2])
    _, inverse, counts = np.unique(flat, axis=0, return_inverse=True, return_counts=True)
    return counts[inverse.ravel()].reshape(rows.shape[:2])
