"""Unstructured meshes by meshio, behind a guard: it may end the process, print, or return what was never declared."""

import io
import re
import warnings
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import meshio.gmsh
import meshio.medit
import meshio.vtk
import meshio.vtu
import numpy as np

from eigenshape._errors import FileFormatError

READERS: dict[str, Callable[[Path], Any]] = {
    ".mesh": meshio.medit.read,
    ".meshb": meshio.medit.read,
    ".msh": meshio.gmsh.read,
    ".vtk": meshio.vtk.read,
    ".vtu": meshio.vtu.read,
}
ENDS = (b"$EndNodes", b"$EndElements")  # without which a .msh was cut off
SIMPLICES = ("tetra", "triangle", "line", "vertex")


def read(path: Path, suffix: str, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Return points and the simplices of the highest dimension; (n, 0) where there are none.

    `data` is what the file holds, to see whether it is all there: meshio returns what is left of some that are not.

    Raises
    ------
    FileFormatError
        If meshio cannot read the file, it is not whole, or it holds cells that are no simplices.
    """
    found = _guarded(READERS[suffix], path)
    _require_whole(path, suffix, data, found)
    cells = [(str(block.type), np.asarray(block.data)) for block in found.cells if len(block.data)]
    others = sorted({kind for kind, _ in cells} - set(SIMPLICES))
    if others:
        raise FileFormatError(
            f"{path} must hold simplices (tetra, triangle or line); it holds {', '.join(others)}. Split them first."
        )
    points = np.asarray(found.points)
    for kind in SIMPLICES[:-1]:
        blocks = [data for name, data in cells if name == kind]
        if blocks:
            return points, np.concatenate(blocks)
    return points, np.empty((len(points), 0), dtype=np.int64)


def _require_whole(path: Path, suffix: str, data: bytes, found: Any) -> None:
    missing = [name for name in ENDS if suffix == ".msh" and name not in data]
    if missing:
        raise FileFormatError(f"{path} must be whole; it has no {missing[0].decode()}.")
    sizes = {str(block.type): len(block.data) for block in found.cells if len(block.data)}
    if suffix == ".mesh" and b"End" not in data and "tetra" not in sizes:
        raise FileFormatError(f"{path} must be whole; it has no End, and no tetrahedra, after which nothing is missed.")
    declared = re.search(rb"^CELLS\s+(\d+)", data, re.MULTILINE) if suffix == ".vtk" else None
    n_cells = sum(len(block.data) for block in found.cells)
    version_5 = b"Version 5" in data[:40]  # counts offsets, one more than cells
    if declared and int(declared[1]) - version_5 != n_cells:
        raise FileFormatError(f"{path} must be whole; it declares {int(declared[1])} cells and holds {n_cells}.")
    if suffix == ".vtk" and b"\nASCII" in data[:512] and not data[-1:].isspace():
        raise FileFormatError(f"{path} must be whole; its last number has no line break after it.")


def _guarded(reader: Callable[[Path], Any], path: Path) -> Any:
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said), warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            found = reader(path)
            return SimpleNamespace(points=found.points, cells=found.cells)
    except (SystemExit, Exception) as err:
        what = " ".join(said.getvalue().split()) or f"{type(err).__name__}: {err}"
        raise FileFormatError(f"{path} must be a readable {path.suffix} file; meshio says {what[:200]!r}.") from err
