"""Unstructured meshes by meshio, behind a guard: it may end the process, print, or return what was never declared."""

import io
import warnings
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import meshio.gmsh
import meshio.medit
import meshio.vtk
import meshio.vtu
import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.io.declarations import checked

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

    meshio sees a copy of `data`, what the file holds, once that is known to be safe for it.

    Raises
    ------
    FileFormatError
        If meshio cannot read the file, it is not whole, or it holds cells that are no simplices.
    """
    _require_ends(path, suffix, data)
    readable, n_cells = checked(suffix, data)
    with TemporaryDirectory() as folder:
        copy = Path(folder) / f"mesh{suffix}"  # the suffix tells meshio text from binary
        copy.write_bytes(readable)
        found = _guarded(READERS[suffix], copy, path)
    _require_whole(path, suffix, data, found, n_cells)
    cells = [(str(block.type), np.asarray(block.data)) for block in found.cells if len(block.data)]
    others = sorted({kind for kind, _ in cells} - set(SIMPLICES))
    if others:
        raise FileFormatError(
            f"{path} must hold simplices (tetra, triangle or line); it holds {', '.join(others)}. Split them first."
        )
    points = np.asarray(found.points)
    if points.ndim != 2:
        raise FileFormatError(f"{path} must hold points in rows; meshio reads an array of shape {points.shape}.")
    for kind in SIMPLICES[:-1]:
        blocks = [data for name, data in cells if name == kind]
        if blocks:
            return points, np.concatenate(blocks)
    return points, np.empty((len(points), 0), dtype=np.int64)


def _require_ends(path: Path, suffix: str, data: bytes) -> None:
    missing = [name for name in ENDS if suffix == ".msh" and name not in data]
    if missing:
        raise FileFormatError(f"{path} must be whole; it has no {missing[0].decode()}.")
    if suffix == ".vtk" and b"\nASCII" in data[:512] and not data[-1:].isspace():
        raise FileFormatError(f"{path} must be whole; its last number has no line break after it.")


def _require_whole(path: Path, suffix: str, data: bytes, found: Any, declared: int | None) -> None:
    kinds = {str(block.type) for block in found.cells if len(block.data)}
    if suffix == ".mesh" and b"End" not in data and "tetra" not in kinds:
        raise FileFormatError(f"{path} must be whole; it has no End, and no tetrahedra, after which nothing is missed.")
    if "End-of-file" in found.said:
        raise FileFormatError(f"{path} must be whole; meshio says {found.said!r}.")
    n_cells = sum(len(block.data) for block in found.cells)
    if declared not in (None, n_cells):
        raise FileFormatError(
            f"{path} must be whole and of simplices; it declares {declared} cells, of which meshio reads {n_cells}."
        )


def _guarded(reader: Callable[[Path], Any], copy: Path, path: Path) -> Any:
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said), warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            found = reader(copy)
            return SimpleNamespace(points=found.points, cells=found.cells, said=" ".join(said.getvalue().split()))
    except (SystemExit, Exception) as err:
        what = " ".join(said.getvalue().split()) or f"{type(err).__name__}: {err}"
        raise FileFormatError(f"{path} must be a readable {copy.suffix} file; meshio says {what[:200]!r}.") from err
