"""Regions, rotations and translations as they are written on the command line."""

import re
from pathlib import Path

import numpy as np

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._progress import Progress
from eigenshape.cli.inputs import REGIONS
from eigenshape.deformation.handles import Rotation, Translation
from eigenshape.deformation.region import (
    BoxRegion,
    BrushRegion,
    Region,
    region_boundary,
    region_mask,
)
from eigenshape.features.parts import find_parts
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh

CONDITION = re.compile(r"\s*([xyz])\s*([<>])\s*(-?[\d.]+(?:e-?\d+)?)\s*(%?)\s*")
VERTEX = re.compile(r"\s*vertex\s+(\d+)\s+within\s+([\d.]+(?:e-?\d+)?)\s*(%?)\s*")
PART = re.compile(r"\s*part\s+(\d+)\s*")
TURN = re.compile(r"\s*([^@]+?)\s+by\s+(-?[\d.]+)(?:\s*@\s*(.+))?\s*")


def parse_region(text: str, mesh: TriangleMesh, progress: Progress) -> Region:
    """Return the region that a text describes.

    Raises
    ------
    InvalidParameterError
        If the text describes no region.
    """
    if found := VERTEX.fullmatch(text):
        vertex = whole_number(int(found[1]), "A vertex of a region", 0, mesh.n_vertices - 1)
        radius = float(found[2]) * (surface_area(mesh) ** 0.5 / 100 if found[3] else 1.0)
        return BrushRegion(mesh.vertices[vertex], radius)
    if found := PART.fullmatch(text):
        return _part(mesh, int(found[1]), progress)
    conditions = [CONDITION.fullmatch(piece) for piece in text.split(",")]
    if all(conditions):
        return _box([found for found in conditions if found], mesh)
    if Path(text).is_file():
        return _read_list(Path(text))
    raise InvalidParameterError(f"A region is one of these: {REGIONS} It is {text!r}.")


def _box(conditions: list[re.Match[str]], mesh: TriangleMesh) -> BoxRegion:
    ends = np.array([np.full(3, -np.inf), np.full(3, np.inf)])
    low, span = mesh.vertices.min(axis=0), np.ptp(mesh.vertices, axis=0)
    for found in conditions:
        axis, side = "xyz".index(found[1]), "><".index(found[2])
        value = float(found[3])
        ends[side, axis] = low[axis] + value / 100 * span[axis] if found[4] else value
    return BoxRegion(*ends)


def _part(mesh: TriangleMesh, number: int, progress: Progress) -> Region:
    labels = find_parts(mesh, progress=progress).parts.labels
    whole_number(number, "A part", 0, int(labels.max()))
    return np.unique(mesh.faces[labels == number])


def _read_list(path: Path) -> Region:
    try:
        return np.array([int(line) for line in path.read_text().split()], dtype=np.int64)
    except ValueError as err:
        raise InvalidParameterError(
            f"A file with a region has one vertex index a line; {path} does not: {err}."
        ) from err


def parse_rotation(text: str, mesh: TriangleMesh, region: Region) -> Rotation:
    """Return the rotation that a text describes, by default about the middle of the region's boundary.

    Raises
    ------
    InvalidParameterError
        If the text describes no rotation.
    """
    found = TURN.fullmatch(text)
    if found is None:
        raise InvalidParameterError(
            f"A rotation is 'x by 90', '0,1,1 by -30', or 'z by 45 @ 0,0.1,0' (degrees, and a point of the axis); "
            f"it is {text!r}."
        )
    named = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1]}
    axis = (
        np.array(named[found[1]], dtype=float)
        if found[1] in named
        else _three(found[1], "An axis other than x, y and z")
    )
    if found[3]:
        return Rotation(_three(found[3], "A pivot"), axis, np.deg2rad(float(found[2])))
    rim = region_boundary(mesh, region_mask(mesh, region))
    middle = mesh.vertices[rim].mean(axis=0) if len(rim) else np.zeros(3)
    return Rotation(middle, axis, np.deg2rad(float(found[2])))


def parse_translation(text: str) -> Translation:
    """Return the translation by three numbers.

    Raises
    ------
    InvalidParameterError
        If the text is not three numbers.
    """
    return Translation(_three(text, "A move"))


def _three(text: str, name: str) -> np.ndarray:
    try:
        x, y, z = (float(piece) for piece in text.split(","))
    except ValueError as err:
        raise InvalidParameterError(
            f"{name} is three numbers separated by commas; it is {text!r}."
        ) from err
    return np.array([x, y, z])
