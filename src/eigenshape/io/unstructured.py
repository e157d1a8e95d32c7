"""Unstructured meshes by meshio, behind a guard: it may end the process, print, or return what was never declared."""

import io
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
SIMPLICES = ("tetra", "triangle", "line", "vertex")


def read(path: Path, suffix: str) -> tuple[np.ndarray, np.ndarray]:
    """Return points and the simplices of the highest dimension; (n, 0) where there are none.

    Raises
    ------
    FileFormatError
        If meshio cannot read the file, or it holds cells that are no simplices.
    """
    found = _guarded(READERS[suffix], path)
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
