"""The files that verbs write: checks of their paths, and writing them."""

from collections.abc import Sequence
from pathlib import Path

from jaxtyping import Float
from matplotlib.figure import Figure
from numpy import ndarray

from eigenshape._errors import InvalidParameterError
from eigenshape._files import read_regular, replace_file
from eigenshape.cli.console import print_written
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.mesh_files import WRITTEN, write_mesh
from eigenshape.io.obj_sheet import format_sheet, read_sheet
from eigenshape.plot.save import require_picture_path, save_figure

OBJ = ".obj"


def require_picture(path: Path | None) -> None:
    """Raise an error if no picture can be written to a path, before any work is done."""
    if path is not None:
        require_picture_path(path)


def require_mesh_path(path: Path | None) -> None:
    """Raise an error if no mesh can be written to a path, before any work is done."""
    require_output(path, WRITTEN, "A mesh")


def require_output(path: Path | None, suffixes: Sequence[str], what: str) -> None:
    """Raise an error if a file cannot be written to a path, before any work is done.

    Raises
    ------
    InvalidParameterError
        If the path ends in none of the suffixes, or its folder does not exist.
    """
    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        raise InvalidParameterError(
            f"{what} must be written to a file that ends in {', '.join(suffixes)}; {path} ends in "
            f"{path.suffix!r}."
        )
    if not path.absolute().parent.is_dir():
        raise InvalidParameterError(
            f"{what} must be written to a folder that exists; {path.absolute().parent} does not."
        )


def save_like(
    source: Path, mesh: TriangleMesh, path: Path, moved: Float[ndarray, "n 3"] | None = None
) -> None:
    """Write a mesh and print so on stderr. From OBJ to OBJ, polygons, textures and groups are kept.

    Parameters
    ----------
    source : Path
        The file that the mesh was read from.
    mesh : TriangleMesh
        After repairs, which leave vertices in place.
    path : Path
    moved : (n, 3) float, optional
        Where its vertices are to be written.
    """
    if source.suffix.lower() == path.suffix.lower() == OBJ:
        replace_file(path, format_sheet(read_sheet(read_regular(source)), mesh, moved))
    else:
        write_mesh(mesh if moved is None else TriangleMesh(moved, mesh.faces), path)
    print_written(path)


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure, and print so on stderr."""
    save_figure(figure, path)
    print_written(path)
