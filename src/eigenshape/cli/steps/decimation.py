"""Decimation of a file: colors and labels of a PLY file go along."""

from contextlib import suppress
from pathlib import Path

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape._files import read_regular
from eigenshape.cli.console import print_repairs, print_written
from eigenshape.cli.inputs import repair_names
from eigenshape.geometry.decimation import DecimatedMesh, decimate, place_on
from eigenshape.geometry.repair import repair
from eigenshape.io.mesh_files import write_mesh
from eigenshape.io.ply import parse_colors, parse_labels
from eigenshape.io.surfaces import read_surface

PLY = ".ply"


def decimate_file(
    path: Path, repairs: str, n_faces: int | None, ratio: float | None
) -> DecimatedMesh:
    """Read a surface, repair it, and decimate it; its places are on the surface of the file."""
    made = read_surface(path)
    repaired = repair(made.mesh, repair_names(repairs))
    print_repairs(made.report + repaired.report)
    done = decimate(repaired.mesh, n_faces, ratio=ratio)
    return place_on(made.mesh, done.mesh, done.report)


def save_decimated(path: Path, done: DecimatedMesh, output: Path) -> None:
    """Write a decimated mesh, from PLY to PLY with the colors and labels that the file has."""
    colors = labels = None
    if path.suffix.lower() == output.suffix.lower() == PLY:
        data = read_regular(path)
        found = parse_colors(data)
        if found is not None and len(found) == done.original.n_vertices:
            colors = np.rint(done.carry_values(found.astype(float))).astype(np.uint8)
        with suppress(FileFormatError):  # faces without labels
            labels = done.carry_labels(parse_labels(data))
    write_mesh(done.mesh, output, colors=colors, face_labels=labels)
    print_written(output)
