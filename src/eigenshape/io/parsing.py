"""Parse the bytes of a file of any format to points and simplices; errors name the file."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError, InvalidShapeError
from eigenshape._files import require_regular
from eigenshape.io import glb, gmsh, medit, npz, obj, off, ply, stl, vtk_legacy, vtu
from eigenshape.io.cell_kinds import CellKind
from eigenshape.io.cells import SEGMENTS, Blocks, select_cells

# Formats that are parsed to vertices, and triangles or segments.
PARSERS = {
    ".off": off.parse,
    ".obj": obj.parse,
    ".ply": ply.parse,
    ".stl": stl.parse,
    ".glb": glb.parse,
    ".npz": npz.parse,
}
NAMES = {2: SEGMENTS, 3: "triangles"}
# Formats that are parsed to points, and cells by kind.
GRIDS = {
    ".mesh": medit.parse_text,
    ".meshb": medit.parse_binary,
    ".msh": gmsh.parse,
    ".vtu": vtu.parse,
}
# Suffixes of the files that `read_mesh` reads.
MESH_FORMATS = (*PARSERS, ".gltf", ".vtk", *GRIDS)


def suffix_of(path: Path, file_format: str | None, known: tuple[str, ...]) -> str:
    """Return the suffix that names the format, in lower case.

    Raises
    ------
    FileFormatError
        If the suffix is not one of the known ones, or the path is a folder.
    """
    suffix = (
        path.suffix.lower() if file_format is None else f".{file_format.lower().removeprefix('.')}"
    )
    if suffix not in known:
        if path.is_dir():
            require_regular(path)
        found = f"is {suffix!r}" if suffix else "has no suffix"
        raise FileFormatError(f"{path} must be of a known format, {', '.join(known)}; it {found}.")
    return suffix


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the path before the message of an error. Overflow is found when the shape is checked."""
    try:
        with np.errstate(all="ignore"):
            yield
    except (FileFormatError, InvalidShapeError) as err:
        name = "" if str(err).startswith(str(path)) else f"{path}: "
        raise type(err)(f"{name}{err}") from err
    except MemoryError as err:
        raise FileFormatError(
            f"{path} must fit into memory; there is too little to read it."
        ) from err


def parse_mesh(
    path: Path, suffix: str, data: bytes, cells: CellKind | None
) -> tuple[Float[np.ndarray, "n d"], Int[np.ndarray, "s corners"]]:
    """Return points and the selected simplices, of shape (0, 3) if there are only points."""
    points, blocks = _blocks(path, suffix, data, cells)
    return points, select_cells(points, blocks, cells)


def _blocks(
    path: Path, suffix: str, data: bytes, cells: CellKind | None
) -> tuple[np.ndarray, Blocks]:
    if suffix in PARSERS:
        points, simplices = PARSERS[suffix](data)
        return points, {NAMES[simplices.shape[1]]: simplices}
    if suffix == ".gltf":
        points, simplices = glb.parse(data, path.parent)
        return points, {"triangles": simplices}
    return vtk_legacy.parse(data, cells) if suffix == ".vtk" else GRIDS[suffix](data)
