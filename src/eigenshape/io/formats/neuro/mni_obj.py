"""MNI objects, such as the surfaces of CIVET: polygons with normals and colors, in text or binary.

Read: polygons, text and binary.
Kept: nothing besides positions and faces.
Named: colors of items and vertices.
Refused: several objects in one file; lines.
"""

from typing import Any

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape.io.formats.cells import CellLists
from eigenshape.io.formats.numbers import Cursor

ONE_EACH = {1: "polygons", 2: "vertices"}  # what has a color, by the number that says so


def parse(data: bytes) -> tuple[Any, ...]:
    """Return points, and triangles or polygons; and a note if each of something has a color."""
    is_text = data.startswith(b"P")
    # Binary numbers have the byte order of the machine that wrote them. The sixth one counts the
    # points, each of which takes 24 bytes.
    order = ">" if 24 * int.from_bytes(data[21:25], "big") < len(data) else "<"
    real, whole = f"{order}f4", f"{order}i4"
    cursor = Cursor(data, "An MNI object", is_text=is_text, place=1)
    cursor.take(real, 5)  # how the surface shines
    n_points = cursor.one(whole)
    points = cursor.take(real, 3 * n_points).astype(np.float64)
    cursor.take(real, 3 * n_points)  # normals
    n_polygons, coloring = cursor.wholes(whole, 2).tolist()
    cursor.take("u1", 4 * {1: n_polygons, 2: n_points}.get(coloring, 1))
    starts = np.append(0, cursor.wholes(whole, n_polygons))
    polygons = CellLists(starts, cursor.wholes(whole, int(starts[-1])))
    cursor.require_end()
    bad = np.flatnonzero(polygons.lengths < 3)
    if bad.size:
        raise FileFormatError(
            "Polygons of an MNI object must have three corners or more; polygon "
            f"{bad[0]} has {polygons.lengths[bad[0]]}."
        )
    notes = [f"the colors of its {ONE_EACH[coloring]} are not read"] if coloring in ONE_EACH else []
    if (polygons.lengths == 3).all():
        return points.reshape(-1, 3), polygons.corners.reshape(-1, 3), *notes
    return points.reshape(-1, 3), {"polygons": polygons}, *notes
