"""Files of FreeSurfer: surfaces, functions on their vertices (curv), and volumes that hold such functions (MGH)."""

import gzip
import zlib

import numpy as np
from jaxtyping import Float, Int, Shaped

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.neuro.shared import GZIP, VOLUME_SIZE, Arrays, narrow, one_table
from eigenshape.io.formats.numbers import ALWAYS, Cursor, require_reasonable
from eigenshape.io.formats.stl import single_precision

SURFACE, CURVATURE = b"\xff\xff\xfe", b"\xff\xff\xff"  # first bytes
MGH_NUMBERS = {0: ">u1", 1: ">i4", 3: ">f4", 4: ">i2"}
MGH_HEADER = 284  # bytes
# Sides, axes and center of a volume that does not say where it lies
UNPLACED = (1, 1, 1, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0, 0)
MGH_WORD = {"f": 3, "i": 1}
UNNAMED = "values"


def parse(data: bytes) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "f 3"]]:
    """Return vertices and faces in the coordinates of the file; what follows them is left out."""
    if not data.startswith(SURFACE):
        raise FileFormatError(
            f"A surface of FreeSurfer must begin with the bytes ff ff fe; it begins with "
            f"{data[:3].hex(' ')}. Functions on vertices, which begin with ff ff ff, are read by "
            "es.io.read_fields."
        )
    # Two lines of text may hold anything; the second one is mostly empty.
    first_line, _, rest = data.partition(b"\n")
    second_line = rest.partition(b"\n")[0]
    place = min(len(first_line) + len(second_line) + 2, len(data))
    cursor = Cursor(data, "A surface of FreeSurfer", place=place)
    n_vertices, n_faces = cursor.wholes(">i4", 2).tolist()
    vertices = cursor.take(">f4", 3 * n_vertices).reshape(-1, 3)
    faces = cursor.wholes(">i4", 3 * n_faces).reshape(-1, 3)
    return vertices.astype(np.float64), faces


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
    if version != 1 or kind not in MGH_NUMBERS or height != 1 or depth != 1 or min(n, n_frames) < 1:
        raise FileFormatError(
            "An MGH file of a surface must have a number for each vertex and frame, "
            f"n x 1 x 1 x frames; version {version}, type {kind} and {n} x {height} x {depth} x "
            f"{n_frames} were found. es.io.read_volume reads volumes."
        )
    cursor.place = MGH_HEADER
    values = cursor.take(MGH_NUMBERS[kind], n * n_frames)
    table = values.astype(values.dtype.newbyteorder("=")).reshape(n_frames, n).T
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
