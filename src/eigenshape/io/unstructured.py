"""Medit and gmsh files by meshio, behind a guard: it may end the process, print, or return what was never declared."""

import io
import sys
import warnings
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock, get_ident
from types import SimpleNamespace
from typing import Any

import meshio.gmsh
import meshio.medit
import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.io.cells import SEGMENTS
from eigenshape.io.declarations import checked

READERS: dict[str, Callable[[Path], Any]] = {
    ".mesh": meshio.medit.read,
    ".meshb": meshio.medit.read,
    ".msh": meshio.gmsh.read,
}
ENDS = (b"$EndNodes", b"$EndElements")  # without which a .msh was cut off
KINDS = {"tetra": "tetrahedra", "triangle": "triangles", "quad": "quads", "line": SEGMENTS}
_ONE_READER = (
    Lock()
)  # meshio prints to the streams of the process, which only one thread at a time may redirect


def read(path: Path, suffix: str, data: bytes) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return points and cells by kind.

    meshio sees a copy of `data`, what the file holds, once that is known to be safe for it.

    Raises
    ------
    FileFormatError
        If meshio cannot read the file, it is not whole, or it holds cells that are neither simplices nor quads.
    """
    _require_ends(path, suffix, data)
    readable, n_cells = checked(suffix, data)
    with TemporaryDirectory() as folder:
        copy = Path(folder) / f"mesh{suffix}"  # the suffix tells meshio text from binary
        copy.write_bytes(readable)
        found = _guarded(READERS[suffix], copy, path)
    _require_whole(path, suffix, data, found, n_cells)
    cells = [(str(block.type), np.asarray(block.data)) for block in found.cells if len(block.data)]
    others = sorted({kind for kind, _ in cells} - {*KINDS, "vertex"})
    if others:
        raise FileFormatError(
            f"{path} must hold simplices (tetra, triangle or line) or quads; it holds {', '.join(others)}. "
            "Split them first."
        )
    points = np.asarray(found.points)
    if points.ndim != 2:
        raise FileFormatError(
            f"{path} must hold points in rows; meshio reads an array of shape {points.shape}."
        )
    blocks = {}
    for kind, name in KINDS.items():
        of_kind = [block for found_kind, block in cells if found_kind == kind]
        if of_kind:
            blocks[name] = np.concatenate(of_kind)
    return points, blocks


def _require_ends(path: Path, suffix: str, data: bytes) -> None:
    missing = [name for name in ENDS if suffix == ".msh" and name not in data]
    if missing:
        raise FileFormatError(f"{path} must be whole; it has no {missing[0].decode()}.")


def _require_whole(path: Path, suffix: str, data: bytes, found: Any, declared: int | None) -> None:
    kinds = {str(block.type) for block in found.cells if len(block.data)}
    if suffix == ".mesh" and b"End" not in data and "tetra" not in kinds:
        raise FileFormatError(
            f"{path} must be whole; it has no End, and no tetrahedra, after which nothing is missed."
        )
    if "End-of-file" in found.said:
        raise FileFormatError(f"{path} must be whole; meshio says {found.said!r}.")
    n_cells = sum(len(block.data) for block in found.cells)
    if declared not in (None, n_cells):
        raise FileFormatError(
            f"{path} must be whole and of simplices; it declares {declared} cells, of which meshio reads {n_cells}."
        )


def _guarded(reader: Callable[[Path], Any], copy: Path, path: Path) -> Any:
    with _ONE_READER:
        printed = _Printed(sys.stderr)
        try:
            with (
                redirect_stdout(printed),
                redirect_stderr(printed),
                warnings.catch_warnings(),
                np.errstate(all="ignore"),
            ):
                warnings.filterwarnings("ignore", module=r"meshio\b")  # and nobody else's warnings
                found = reader(copy)
            return SimpleNamespace(points=found.points, cells=found.cells, said=printed.words())
        except (SystemExit, Exception) as err:
            what = printed.words() or f"{type(err).__name__}: {err}"
            raise FileFormatError(
                f"{path} must be a readable {copy.suffix} file; meshio says {what[:200]!r}."
            ) from err


class _Printed(io.StringIO):
    """What this thread prints; what other threads print in the meantime is passed on."""

    def __init__(self, others: Any) -> None:
        super().__init__()
        self._others = others
        self._reader = get_ident()

    def write(self, text: str) -> int:
        return super().write(text) if get_ident() == self._reader else self._others.write(text)

    def words(self) -> str:
        return " ".join(self.getvalue().split())
