"""Files of FreeSurfer: surfaces, functions on their vertices (curv), and volumes that hold such functions (MGH).

Read: surfaces of triangles and quadrangles, binary and text; functions of the new and the old
    form; MGH of n x 1 x 1, also with factored numbers.
Kept: from FreeSurfer to FreeSurfer the volume that a surface belongs to (c_ras).
Named: that volume in other formats; digits that are lost.
Refused: patches; functions in place of a surface, and the other way around.
"""

import gzip
import math
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Shaped

from certeig.kit.errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.neuro.shared import (
    UNNAMED,
    Arrays,
    narrow,
    require_axes,
    volume_function,
)
from eigenshape.io.formats.numbers import Cursor
from eigenshape.io.formats.registry import suffix_of_bytes
from eigenshape.io.formats.stl import single_precision

WHAT = "A surface of FreeSurfer"
# First bytes. Old surfaces of quadrangles begin as functions do.
SURFACE, QUADRANGLES, CURVATURE = b"\xff\xff\xfe", b"\xff\xff\xfd", b"\xff\xff\xff"
HUNDREDTHS = 100  # in a unit of numbers of 16 bits
MGH_NUMBERS = {0: ">u1", 1: ">i4", 3: ">f4", 4: ">i2", 10: ">u2"}
MGH_HEADER = 284  # bytes
MGH_PLACE = 28  # bytes before the place of the volume
# Sides, axes and center of a volume that does not say where it lies
UNPLACED = (1, 1, 1, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0, 0)
MGH_WORD = {"f": 3, "i": 1}


def parse(data: bytes) -> tuple[Any, ...]:
    """Return vertices and faces or quads in the coordinates of the file, and notes.

    What follows the faces is left out; `footer_of` returns it.
    """
    if data.startswith(SURFACE):
        cursor = Cursor(_after_text(data), WHAT)
        n_vertices, n_faces = cursor.wholes(">i4", 2).tolist()
        vertices = cursor.take(">f4", 3 * n_vertices).reshape(-1, 3)
        faces = cursor.wholes(">i4", 3 * n_faces).reshape(-1, 3)
        return vertices.astype(np.float64), faces
    if data.startswith(b"#!ascii"):
        cursor = Cursor(data, WHAT, is_text=True, place=len(data.partition(b"\n")[0]))
        n_vertices, n_faces = cursor.wholes("<i8", 2).tolist()
        # Each row ends in a mark: 1 for what was cut away; some programs store labels there.
        vertices = cursor.take("<f8", 4 * n_vertices).reshape(-1, 4)
        faces = cursor.wholes("<i8", 4 * n_faces).reshape(-1, 4)
        cursor.require_end()
        n_marked = np.count_nonzero(vertices[:, 3]) + np.count_nonzero(faces[:, 3])
        note = f"the marks behind {n_marked} of its vertices and faces, such as 1 for cut away, are not read"
        return vertices[:, :3], faces[:, :3], *[note][:n_marked]
    if suffix_of_bytes(data[:20], len(data)) == ".surf":
        cursor = Cursor(data, WHAT, place=3)
        n_vertices, n_quads = _take_threes(cursor, 2).tolist()
        kind, unit = (">f4", 1) if data.startswith(QUADRANGLES) else (">i2", HUNDREDTHS)
        vertices = cursor.take(kind, 3 * n_vertices).reshape(-1, 3) / np.float64(unit)
        return vertices, {"quads": _take_threes(cursor, 4 * n_quads).reshape(-1, 4)}
    raise FileFormatError(
        f"{WHAT} must begin with the bytes ff ff fe; it begins with {data[:3].hex(' ')}. Functions on "
        "vertices, which begin with ff ff ff, are read by es.io.read_fields."
    )


def _take_threes(cursor: Cursor, count: int) -> Int[np.ndarray, " k"]:
    """Return whole numbers of three bytes each."""
    return np.dot(cursor.wholes("u1", 3 * count).reshape(-1, 3), [65536, 256, 1])


def _after_text(data: bytes) -> bytes:
    """Return what follows the two lines of text, which may hold anything; the second one is mostly empty."""
    return data.partition(b"\n")[2].partition(b"\n")[2]


def footer_of(data: bytes) -> bytes:
    """Return what follows the triangles of a surface, such as the place of its volume, c_ras."""
    if not data.startswith(SURFACE):
        return b""
    # Two counts, then three numbers a row
    rest = _after_text(data)
    n_rows = Cursor(rest, WHAT).wholes(">i4", 2).sum()
    return rest[8 + 12 * n_rows :]


def format_binary(mesh: TriangleMesh) -> bytes:
    """Write a surface in single precision."""
    head = SURFACE + b"created by eigenshape\n\n"
    counts = np.array([mesh.n_vertices, mesh.n_faces], ">i4").tobytes()
    points = single_precision(mesh, WHAT).astype(">f4").tobytes()
    return head + counts + points + mesh.faces.astype(">i4").tobytes()


def parse_fields(data: bytes) -> tuple[Arrays, Arrays]:
    """Return the one function of a file, under the name "values", and none on faces.

    Raise FileFormatError if the file is neither of functions nor MGH, or holds a volume.
    """
    if not data.startswith(CURVATURE):
        if suffix_of_bytes(data[:20], len(data)) == ".curv":  # the old form, without a signature
            numbers = np.frombuffer(data, ">i2", offset=6)
            return {UNNAMED: (numbers / HUNDREDTHS).astype(np.float32)}, {}
        return {UNNAMED: volume_function(_read_mgh(data, is_volume=False))}, {}
    cursor = Cursor(data, "A file of functions on vertices", place=len(CURVATURE))
    n_vertices, _, width = cursor.wholes(">i4", 3).tolist()
    if width != 1:
        raise FileFormatError(
            f"A file of functions on vertices must have one number a vertex; it has {width}."
        )
    values = cursor.take(">f4", n_vertices).astype(np.float32)
    cursor.require_end()
    return {UNNAMED: values}, {}


def parse_volume(data: bytes) -> tuple[Shaped[np.ndarray, "a b c"], Float[np.ndarray, "4 4"]]:
    """Return the numbers of a volume, and the map from voxels to space.

    Raise FileFormatError if the file is not MGH of one frame, or does not hold what it declares.
    """
    values = _read_mgh(data, is_volume=True)
    cursor = Cursor(data, "An MGH file", place=MGH_PLACE)
    placed = cursor.take(">i2", 1)[0] > 0
    numbers = cursor.take(">f4", 15) if placed else np.array(UNPLACED)
    # Sides of a voxel, then where its axes point, then where the center of the volume lies.
    sides, axes, center = np.split(numbers.astype(np.float64), [3, 12])
    to_space = np.eye(4)
    to_space[:3, :3] = axes.reshape(3, 3).T * sides
    to_space[:3, 3] = center - to_space[:3, :3] @ (np.array(values.shape[:3]) / 2)
    if not np.isfinite(to_space).all():
        raise FileFormatError(
            f"Places of voxels in an MGH file must be finite; the map is {to_space.tolist()}."
        )
    return np.ascontiguousarray(values[..., 0]), to_space


def _read_mgh(data: bytes, *, is_volume: bool) -> Shaped[np.ndarray, "a b c frames"]:
    cursor = Cursor(data, "An MGH file")
    version, *axes, kind = cursor.wholes(">i4", 6).tolist()
    if version != 1 or kind not in MGH_NUMBERS:
        raise FileFormatError(
            f"An MGH file must be of version 1 and of numbers; it is of version {version} and type {kind}."
        )
    require_axes("An MGH file", axes, is_volume=is_volume)
    cursor.place = MGH_HEADER
    values = cursor.take(MGH_NUMBERS[kind], math.prod(axes))
    # The first axis is the fastest in the file.
    native = values.astype(values.dtype.newbyteorder("="))
    return native.reshape(axes, order="F")


def format_maps(mesh: TriangleMesh, of_vertices: Arrays, suffix: str) -> bytes:
    """Write one function, or the columns of a table as frames of an MGH file."""
    if len(of_vertices) != 1:
        raise FileFormatError(
            f"A file in {suffix} holds one function, without a name; there are {len(of_vertices)}. "
            "Write each to a file of its own."
        )
    (values,) = (narrow(name, table) for name, table in of_vertices.items())
    table = values.reshape(mesh.n_vertices, -1)
    n_frames = table.shape[1]
    if suffix == ".curv":
        if n_frames > 1:
            raise FileFormatError(
                f"A file in .curv holds one number a vertex; there are {n_frames}. Write .mgh."
            )
        counts = np.array([mesh.n_vertices, mesh.n_faces, 1], ">i4").tobytes()
        return CURVATURE + counts + values.astype(">f4").tobytes()
    shape = [1, mesh.n_vertices, 1, 1, n_frames, MGH_WORD[values.dtype.kind], 0]
    head = np.array(shape, ">i4").tobytes().ljust(MGH_HEADER, b"\0")
    data = head + values.T.astype(values.dtype.newbyteorder(">")).tobytes()
    return gzip.compress(data, mtime=0) if suffix == ".mgz" else data
