"""The files that verbs write: checks of their paths, and writing them."""

from collections.abc import Sequence
from pathlib import Path

from jaxtyping import Float, Int, UInt8
from matplotlib.figure import Figure
from numpy import ndarray

from eigenshape._errors import FileFormatError, InvalidParameterError
from eigenshape.cli.console import err, escape_text, print_written
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.carrying import carry_attributes
from eigenshape.io.formats.registry import WITH_MORE, WRITTEN
from eigenshape.io.mesh_files import read_mesh, save_mesh
from eigenshape.plot.figure import require_picture_path, save_figure


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
    source: Path,
    mesh: TriangleMesh,
    path: Path,
    moved: Float[ndarray, "n 3"] | None = None,
    *,
    colors: UInt8[ndarray, "n 3"] | None = None,
    face_labels: Int[ndarray, " f"] | None = None,
) -> None:
    """Write a mesh with all else that its file holds, and print so, and what is lost, on stderr.

    Parameters
    ----------
    source : Path
        The file that the mesh was read from.
    mesh : TriangleMesh
        After repairs.
    path : Path
    moved : (n, 3) float, optional
        Where its vertices are to be written.
    colors, face_labels : optional
        Colors and labels to write, as in `write_mesh`.
    """
    attributes = None
    if source.suffix.lower() in WITH_MORE:
        try:
            attributes = carry_attributes(
                read_mesh(source, attributes=True, drop_missing=True)[1], mesh
            )
        except FileFormatError as error:  # the shape was read; only the rest is broken
            err.print(f"[yellow]lost:[/] all but the shape. {escape_text(error)}")
    written = mesh if moved is None else TriangleMesh(moved, mesh.faces)
    lost = save_mesh(written, path, colors=colors, face_labels=face_labels, attributes=attributes)
    print_written(path)
    if lost:
        err.print(f"[yellow]lost:[/] {escape_text(lost)}")


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure, and print so on stderr."""
    save_figure(figure, path)
    print_written(path)
