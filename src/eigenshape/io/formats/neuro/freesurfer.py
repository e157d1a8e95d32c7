"""Files of FreeSurfer: surfaces, functions on their vertices (curv), and volumes that hold such functions (MGH).

Read: surfaces of triangles and quadrangles, binary and text; functions of the new and the old
    form; MGH of n x 1 x 1, also with factored numbers.
Kept: from FreeSurfer to FreeSurfer the volume that a surface belongs to (c_ras).
Named: that volume in other formats; digits that are lost.
Refused: patches; functions in place of a surface, and the other way around.
"""

import gzip
import zlib
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Shaped

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.neuro.shared import (
    GZIP,
    UNNAMED,
    VOLUME_SIZE,
    Arrays,
    count_vertices,
    narrow,
    one_table,
)
from eigenshape.io.formats.numbers import ALWAYS, Cursor, require_reasonable
from eigenshape.io.formats.registry import suffix_of_bytes
from eigenshape.io.formats.stl import single_precision

# First bytes. Old surfaces of quadrangles begin as functions do.
SURFACE, QUADRANGLES, CURVATURE = b"\xff\xff\xfe", b"\xff\xff\xfd", b"\xff\xff\xff"
HUNDREDTHS = 100  # in a unit of numbers of 16 bits
MGH_NUMBERS = {0: ">u1", 1: ">i4", 3: ">f4", 4: ">i2", 10: ">u2"}
MGH_HEADER = 284  # bytes
# Sides, axes and center of a volume that does not say where it lies
UNPLACED = (1, 1, 1, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0, 0)
MGH_WORD = {"f": 3, "i": 1}


def parse(data: bytes) -> tuple[Any, ...]:
    """Return vertices and faces or quads in the coordinates of the file, and notes.

    What follows the faces is left out; `footer_of` returns it.
    """
    what = "A surface of FreeSurfer"
    if data.startswith(SURFACE):
        cursor = Cursor(_after_text(data), what)
        n_vertices, n_faces = cursor.wholes(">i4", 2).tolist()
        vertices = cursor.take(">f4", 3 * n_vertices).reshape(-1, 3)
        faces = cursor.wholes(">i4", 3 * n_faces).reshape(-1, 3)
        return vertices.astype(np.float64), faces
    if data.startswith(b"#!ascii"):
        cursor = Cursor(data, what, is_text=True, place=len(data.partition(b"\n")[0]))
        n_vertices, n_faces = cursor.wholes("<i8", 2).tolist()
        # Each row ends in a mark: 1 for what was cut away; some programs store labels there.
        vertices = cursor.take("<f8", 4 * n_vertices).reshape(-1, 4)
        faces = cursor.wholes("<i8", 4 * n_faces).reshape(-1, 4)
        cursor.require_end()
        n_marked = np.count_nonzero(vertices[:, 3]) + np.count_nonzero(faces[:, 3])
        note = f"the marks behind {n_marked} of its vertices and faces, such as 1 for cut away, are not read"
        return vertices[:, :3], faces[:, :3], *[note][:n_marked]
    if suffix_of_bytes(data[:20], len(data)) == ".surf":
        cursor = Cursor(data, what, place=3)
        n_vertices, n_quads = _take_threes(cursor, 2).tolist()
        kind, unit = (">f4", 1) if data.startswith(QUADRANGLES) else (">i2", HUNDREDTHS)
        vertices = cursor.take(kind, 3 * n_vertices).reshape(-1, 3) / np.float64(unit)
        return vertices, {"quads": _take_threes(cursor, 4 * n_quads).reshape(-1, 4)}
    raise FileFormatError(
        f"{what} must begin with the bytes ff ff fe; it begins with {data[:3].hex(' ')}. Functions on "
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
    vertices, faces = parse(data)
    # Two counts, then three numbers a row
    return _after_text(data)[8 + 12 * (len(vertices) + len(faces)) :]


def format_binary(mesh: TriangleMesh) -> bytes:
    """Write a surface in single precision."""
    head = SURFACE + b"created by eigenshape\n\n"
    counts = np.array([mesh.n_vertices, mesh.n_faces], ">i4").tobytes()
    points = single_precision(mesh, "A surface of FreeSurfer").astype(">f4").tobytes()
    return head + counts + points + mesh.faces.astype(">i4").tobytes()


def parse_fields(data: bytes) -> tuple[Arrays, Arrays]:
    """Return the one function of a file, under the name "values", and none on faces.

    Raise FileFormatError if the file is neither of functions nor MGH, or holds a volume.
    """
    if not data.startswith(CURVATURE):
        if suffix_of_bytes(data[:20], len(data)) == ".curv":  # the old form, without a signature
            numbers = np.frombuffer(data, ">i2", offset=6)
            return {UNNAMED: (numbers / HUNDREDTHS).astype(np.float32)}, {}
        return {UNNAMED: _mgh_values(_unpack(data) if data.startswith(GZIP) else data)}, {}
    cursor = Cursor(data, "A file of functions on vertices", place=len(CURVATURE))
    n_vertices, _, width = cursor.wholes(">i4", 3).tolist()
    if width != 1:
        raise FileFormatError(
            f"A file of functions on vertices must have one number a vertex; it has {width}."
        )
    values = cursor.take(">f4", n_vertices).astype(np.float32)
    cursor.require_end()
    return {UNNAMED: values}, {}


def _unpack(data: bytes, always: int = ALWAYS) -> bytes:
    unpacker = zlib.decompressobj(wbits=31)
    try:
        # The header tells how large the rest must be before that is unpacked.
        head = unpacker.decompress(data, MGH_HEADER)
        size = MGH_HEADER + 4 * int(np.prod(np.frombuffer(head, ">i4", 5)[1:].astype(float)))
        require_reasonable(size, len(data), always)
        # Behind the numbers, a little text tells about the scanner.
        return head + unpacker.decompress(unpacker.unconsumed_tail, max(size, 1))
    except (zlib.error, ValueError, OverflowError) as err:
        raise FileFormatError(f"A packed MGH file must be whole; {err}.") from err


def parse_volume(data: bytes) -> tuple[Shaped[np.ndarray, "a b c"], Float[np.ndarray, "4 4"]]:
    """Return the numbers of a volume, and the map from voxels to space.

    Raise FileFormatError if the file is not MGH of one frame, or does not hold what it declares.
    """
    unpacked = _unpack(data, VOLUME_SIZE) if data.startswith(GZIP) else data
    cursor = Cursor(unpacked, "An MGH file")
    version, *shape, n_frames, kind = cursor.wholes(">i4", 6).tolist()
    if version != 1 or kind not in MGH_NUMBERS or n_frames != 1 or min(shape) < 1:
        raise FileFormatError(
            f"An MGH file of a volume must have one frame; version {version}, type {kind} and "
            f"{' x '.join(map(str, shape))} x {n_frames} were found."
        )
    cursor.place += 4  # a word that means nothing here
    placed = cursor.take(">i2", 1)[0] > 0
    numbers = cursor.take(">f4", 15) if placed else np.array(UNPLACED)
    # Sides of a voxel, then where its axes point, then where the center of the volume lies.
    sides, axes, center = np.split(numbers.astype(np.float64), [3, 12])
    to_space = np.eye(4)
    to_space[:3, :3] = axes.reshape(3, 3).T * sides
    to_space[:3, 3] = center - to_space[:3, :3] @ (np.array(shape) / 2)
    if not np.isfinite(to_space).all():
        raise FileFormatError(
            f"Places of voxels in an MGH file must be finite; the map is {to_space.tolist()}."
        )
    cursor.place = MGH_HEADER
    values = cursor.take(MGH_NUMBERS[kind], int(np.prod(np.array(shape, dtype=float))))
    # The first axis is the fastest in the file.
    values = values.reshape(shape, order="F")
    return np.ascontiguousarray(values, values.dtype.newbyteorder("=")), to_space


def _mgh_values(data: bytes) -> np.ndarray:
    cursor = Cursor(data, "An MGH file")
    version, n, height, depth, n_frames, kind = cursor.wholes(">i4", 6).tolist()
    n_vertices = count_vertices((n, height, depth))
    if version != 1 or kind not in MGH_NUMBERS or min(n_vertices, n_frames) < 1:
        raise FileFormatError(
            "An MGH file of a surface must have a number for each vertex and frame, "
            f"n x 1 x 1 x frames; version {version}, type {kind} and {n} x {height} x {depth} x "
            f"{n_frames} were found. es.io.read_volume reads volumes."
        )
    cursor.place = MGH_HEADER
    values = cursor.take(MGH_NUMBERS[kind], n_vertices * n_frames)
    table = values.astype(values.dtype.newbyteorder("=")).reshape(n_frames, n_vertices).T
    return table[:, 0] if n_frames == 1 else np.ascontiguousarray(table)


def format_maps(mesh: TriangleMesh, of_vertices: Arrays, suffix: str) -> bytes:
    """Write one function, or the columns of a table as frames of an MGH file."""
    values = one_table(of_vertices, f"A file in {suffix}")
    if suffix == ".curv":
        if values.ndim > 1:
            raise FileFormatError(
                f"A file in .curv holds one number a vertex; there are {values.shape[1]}. Write .mgh."
            )
        counts = np.array([mesh.n_vertices, mesh.n_faces, 1], ">i4").tobytes()
        return CURVATURE + counts + narrow(UNNAMED, values).astype(">f4").tobytes()
    n_frames = values.shape[1] if values.ndim > 1 else 1
    shape = [1, mesh.n_vertices, 1, 1, n_frames, MGH_WORD[values.dtype.kind], 0]
    head = np.array(shape, ">i4").tobytes().ljust(MGH_HEADER, b"\0")
    data = head + values.T.astype(values.dtype.newbyteorder(">")).tobytes()
    return gzip.compress(data, mtime=0) if suffix == ".mgz" else data
