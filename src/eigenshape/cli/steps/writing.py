"""The files that verbs write: checks of their paths before any work is done, and writing them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, TypedDict

import numpy as np
from jaxtyping import Float, Int, UInt8
from matplotlib.figure import Figure

from certeig.kit.arrays import TINY
from certeig.kit.errors import FileFormatError, InvalidParameterError
from eigenshape.cli.console import err, escape_text, print_written
from eigenshape.cli.inputs import numbers_of
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.carrying import carry_attributes
from eigenshape.io.formats.registry import (
    HEMISPHERES,
    SHAPE_FORMATS,
    WITH_COLORS,
    WITH_MORE,
    WRITTEN,
    CellKind,
    is_upright,
    suffix_of,
)
from eigenshape.io.label_files import write_labels
from eigenshape.io.mesh_files import read_mesh, save_mesh, write_mesh
from eigenshape.io.shape_files import read_shape
from eigenshape.plot.camera import UP_NAMES, VIEWS, Up, View
from eigenshape.plot.fields import value_colors
from eigenshape.plot.figure import require_picture_path, save_figure

LABEL_LISTS = (".seg", ".txt")  # files with one label a line


class Side(TypedDict):
    """From which side a picture shows a shape, as figures take it."""

    view: View
    up: Up


def picture_side(view: str, up: str, *pictures: Path | None, shapes: Sequence[Path] = ()) -> Side:
    """Return the side of pictures; raise an error if one cannot be written to its path.

    --view and --up are names, or directions as three numbers separated by commas. The files of the
    shapes say which way is up if all are of formats in which y points up.
    """
    for path in pictures:
        if path is not None:
            require_picture_path(path)
    if up == "auto" and shapes and all(map(is_upright, shapes)):
        up = "y"
    return {
        "view": _name_or_direction(view, "--view", ("auto", *VIEWS)),
        "up": _name_or_direction(up, "--up", UP_NAMES),
    }


def _name_or_direction(text: str, option: str, names: tuple[str, ...]) -> str | list[float]:
    if text in names:
        return text
    numbers = numbers_of(text)
    if len(numbers) != 3 or not any(numbers):
        raise InvalidParameterError(
            f"{option} takes {', '.join(names)}, or a direction as three numbers separated by "
            f"commas, such as 1,0,2; it is {text!r}."
        )
    return numbers


def require_mesh_path(path: Path | None, more: Literal["", "colors", "labels"] = "") -> None:
    """Raise an error if no mesh can be written to a path, or none with colors or labels."""
    with_labels = (*WITH_COLORS, *LABEL_LISTS)
    suffixes = {"": WRITTEN, "colors": WITH_COLORS, "labels": with_labels}[more]
    require_output(path, suffixes, f"A mesh with {more}" if more else "A mesh")


def require_output(path: Path | None, suffixes: Sequence[str], what: str) -> None:
    """Raise an error if the path ends in none of the suffixes, or its folder does not exist."""
    if path is None:
        return
    is_freesurfer = ".surf" in suffixes and path.name.startswith(HEMISPHERES)  # as lh.pial
    if path.suffix.lower() not in suffixes and not is_freesurfer:
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
    moved: Float[np.ndarray, "n 3"] | None = None,
    *,
    colors: UInt8[np.ndarray, "n 3"] | None = None,
    face_labels: Int[np.ndarray, " f"] | None = None,
    cells: CellKind | None = None,
    scene: str | None = None,
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
    cells, scene : str, optional
        The kind of cells and the scene that were read.
    """
    attributes = None
    if suffix_of(source, None, SHAPE_FORMATS) in WITH_MORE:
        try:
            found = read_mesh(source, attributes=True, drop_missing=True, cells=cells, scene=scene)[
                1
            ]
            attributes = carry_attributes(found, mesh)
        except FileFormatError as error:
            shape = read_shape(source, drop_missing=True, cells=cells, scene=scene)
            if isinstance(shape, TriangleMesh):  # only the rest of the file is broken
                err.print(f"[yellow]lost:[/] all but the shape. {escape_text(error)}")
            else:
                err.print(
                    f"[yellow]note:[/] the surface was made of points or cells of {escape_text(source.name)}; "
                    "their colors and values, if there are any, are not kept"
                )
    written = mesh if moved is None else TriangleMesh(moved, mesh.faces)
    lost = save_mesh(written, path, colors=colors, face_labels=face_labels, attributes=attributes)
    print_written(path)
    if lost:
        err.print(f"[yellow]lost:[/] {escape_text(lost)}")


def save_labels(
    source: Path,
    mesh: TriangleMesh,
    labels: Int[np.ndarray, " f"],
    colors: UInt8[np.ndarray, "n 3"],
    path: Path,
) -> None:
    """Write labels of faces, with the mesh of a file or alone, and print so on stderr."""
    if path.suffix.lower() in LABEL_LISTS:
        write_labels(labels, path)
        print_written(path)
    else:
        save_like(source, mesh, path, colors=colors, face_labels=labels)


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure, and print so on stderr."""
    save_figure(figure, path)
    print_written(path)


def save_heat(mesh: TriangleMesh, heat: Float[np.ndarray, " n"], path: Path) -> None:
    """Write a mesh, colored by the logarithm of its heat, and print so on stderr."""
    write_mesh(mesh, path, colors=value_colors(np.log(np.maximum(heat, TINY))))
    print_written(path)
