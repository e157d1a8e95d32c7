"""Parse the bytes of a file of any format to points and simplices; errors name the file."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError, InvalidShapeError
from eigenshape._files import require_regular
from eigenshape.geometry.repair_report import PLURALS, count_nouns
from eigenshape.io.formats import glb, gmsh, medit, npz, obj, off, ply, stl, vtk, vtu
from eigenshape.io.formats.cell_kinds import CellKind
from eigenshape.io.formats.cells import SEGMENTS, Blocks, select_cells, split_sentence

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
    """Return points and the selected simplices, of shape (0, 3) if there are only points.

    Warns
    -----
    UserWarning
        If hexahedra, wedges or pyramids were split.
    """
    points, blocks = _blocks(path, suffix, data, cells)
    simplices = select_cells(points, blocks, cells)
    if simplices.shape[1] == 4 and (sentence := split_sentence(blocks)):
        warnings.warn(f"{path}: {sentence}", stacklevel=4)
    return points, simplices


def require_finite(
    points: Float[np.ndarray, "n d"],
    simplices: Int[np.ndarray, "s corners"],
    *,
    drop_missing: bool,
) -> tuple[
    Float[np.ndarray, "m d"],
    Int[np.ndarray, "r corners"],
    Int[np.ndarray, " m"],
    tuple[str, ...],
]:
    """Leave out points that are not finite, and the simplices at them, if that is requested.

    Returns the points and simplices that stay, the indices of these points in the file, and a
    report of one sentence or none.

    Raises
    ------
    InvalidShapeError
        If a point is not finite, and such points are not to be left out, or no face is without one.
    """
    is_surface = len(simplices) > 0 and simplices.shape[1] == points.shape[1] == 3
    noun = "vertex" if is_surface else "point"
    missing = np.flatnonzero(~np.isfinite(points).all(axis=1))
    stays = ~np.isin(simplices, missing).any(axis=1)
    nothing_stays = len(simplices) > 0 and not stays.any()
    if missing.size and (nothing_stays or not drop_missing):
        first = int(missing[0])
        remedy = (
            "Without them no face is left."
            if nothing_stays
            else "Scanners write such points if they measured nothing: drop_missing=True, or "
            "--repair drop_missing, leaves them out, and the faces at them."
        )
        raise InvalidShapeError(
            f"{PLURALS.get(noun, 'points')} must be finite; {noun} {first} is {points[first].tolist()} "
            f"({missing.size} such). {remedy}"
        )
    kept = np.delete(np.arange(len(points)), missing)
    if not missing.size:
        return points, simplices, kept, ()
    # An index is lower by the number of missing points before it.
    renumbered = simplices[stays] - np.searchsorted(missing, simplices[stays])
    sentence = f"drop_missing left out {count_nouns(missing.size, noun)} without finite coordinates"
    if len(simplices):
        cell = "face" if is_surface else "cell"
        sentence += f" and {count_nouns(int((~stays).sum()), cell)} at them"
    return points[kept], renumbered, kept, (sentence,)


def _blocks(
    path: Path, suffix: str, data: bytes, cells: CellKind | None
) -> tuple[np.ndarray, Blocks]:
    if suffix in PARSERS:
        points, simplices = PARSERS[suffix](data)
        return points, {NAMES[simplices.shape[1]]: simplices}
    if suffix == ".gltf":
        points, simplices = glb.parse(data, path.parent)
        return points, {"triangles": simplices}
    return vtk.parse(data, cells) if suffix == ".vtk" else GRIDS[suffix](data)
