"""Meshes that verbs write: where they may go, and what they keep of the file that they come from."""

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
from eigenshape.plot.save import save_figure

OBJ = ".obj"


def require_mesh_path(path: Path | None) -> None:
    """Refuse a path to which no mesh can be written, before any work is done.

    Raises
    ------
    InvalidParameterError
        If its suffix names no format that is written, or its folder is not there.
    """
    if path is None:
        return
    if path.suffix.lower() not in WRITTEN:
        raise InvalidParameterError(
            f"A mesh goes to {', '.join(WRITTEN)}; {path} ends in {path.suffix!r}."
        )
    if not path.absolute().parent.is_dir():
        raise InvalidParameterError(
            f"A mesh needs a folder to lie in; {path.absolute().parent} is not there."
        )


def save_like(
    source: Path, mesh: TriangleMesh, path: Path, moved: Float[ndarray, "n 3"] | None = None
) -> None:
    """Write a mesh and say so on stderr; from OBJ to OBJ with the polygons, textures and groups that are left.

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
