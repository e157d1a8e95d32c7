"""NumPy archives: the arrays `vertices` and `faces`, and functions on them.

Read: faces of any number of corners.
Kept: functions: arrays whose names begin with vertex_ and face_.
Named: other arrays.
Refused: arrays of other shapes or types.
"""

from io import BytesIO

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.cells import Cells, list_corners
from eigenshape.io.formats.numbers import require_reasonable

VERTEX_FIELD, FACE_FIELD = "vertex_", "face_"  # how the names of functions begin
Arrays = dict[str, np.ndarray]


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray | Cells]:
    """Read vertices and faces of a .npz file, where all faces have equally many corners."""
    arrays = _read_arrays(data)
    missing = {"vertices", "faces"} - arrays.keys()
    if missing:
        raise FileFormatError(
            f"A .npz file of a mesh must hold the arrays vertices and faces; it lacks {sorted(missing)[0]}."
        )
    vertices, faces = arrays["vertices"], arrays["faces"]
    if (
        not vertices.ndim == faces.ndim == 2
        or vertices.dtype.kind not in "fiu"
        or faces.dtype.kind not in "iu"
    ):
        raise FileFormatError(
            "A .npz file of a mesh must hold vertices (n, 3) of numbers and faces (f, 3), or (f, k) of "
            f"polygons, of whole numbers; they are {vertices.shape} {vertices.dtype} and {faces.shape} {faces.dtype}."
        )
    vertices, faces = vertices.astype(np.float64), faces.astype(np.int64)
    if faces.shape[1] in (2, 3):
        return vertices, faces
    return vertices, {"polygons": list_corners(faces)}


def _read_arrays(data: bytes) -> Arrays:
    """Read all arrays by name; none may hold Python objects."""
    try:
        with np.load(BytesIO(data), allow_pickle=False) as file:
            sizes = [entry.file_size for entry in file.zip.infolist()]
            require_reasonable(sum(sizes), len(data))
            return {name: file[name] for name in file.files}
    except FileFormatError:
        raise
    except Exception as err:  # zipfile, zlib and numpy each raise their own
        raise FileFormatError(f"A .npz file must hold arrays of numbers; {err}.") from err


def parse_fields(data: bytes) -> tuple[Arrays, Arrays]:
    """Return the functions on vertices and those on faces, by name: of polygons on their triangles."""
    of_vertices, of_faces = Arrays(), Arrays()
    arrays = _read_arrays(data)
    shape = arrays.get("faces", np.empty(0)).shape
    for name, array in arrays.items():
        if name.startswith(VERTEX_FIELD):
            of_vertices[name.removeprefix(VERTEX_FIELD)] = array
        elif name.startswith(FACE_FIELD):
            are_polygons = len(shape) == 2 and shape[1] > 3 and array.shape[:1] == shape[:1]
            values = np.repeat(array, shape[1] - 2, axis=0) if are_polygons else array
            of_faces[name.removeprefix(FACE_FIELD)] = values
    return of_vertices, of_faces


def format_fields(mesh: TriangleMesh, of_vertices: Arrays, of_faces: Arrays) -> bytes:
    """Write a mesh and functions on its vertices and faces."""
    file = BytesIO()
    named = {VERTEX_FIELD + name: values for name, values in of_vertices.items()}
    named |= {FACE_FIELD + name: values for name, values in of_faces.items()}
    np.savez(file, allow_pickle=False, vertices=mesh.vertices, faces=mesh.faces, **named)
    return file.getvalue()
