"""NumPy archives: the arrays `vertices` and `faces`, and functions on them."""

from io import BytesIO

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.unpacking import require_reasonable


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices and faces of a .npz file."""
    arrays = read_arrays(data)
    missing = {"vertices", "faces"} - arrays.keys()
    if missing:
        raise FileFormatError(
            f"A .npz file of a mesh must hold the arrays vertices and faces; it lacks {sorted(missing)[0]}."
        )
    vertices, faces = arrays["vertices"], arrays["faces"]
    if (
        vertices.ndim != 2
        or faces.ndim != 2
        or vertices.dtype.kind not in "fiu"
        or faces.dtype.kind not in "iu"
    ):
        raise FileFormatError(
            "A .npz file of a mesh must hold vertices (n, 3) of numbers and faces (f, 3) of whole numbers; they are "
            f"{vertices.shape} {vertices.dtype} and {faces.shape} {faces.dtype}."
        )
    return vertices.astype(np.float64), faces.astype(np.int64)


def read_arrays(data: bytes) -> dict[str, np.ndarray]:
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
