"""What is compared of two readings of one shape, whatever order they have their points and faces in.

Each aspect that differs is named, with the two values. Points and faces are compared as sets, since
programs split points along seams and cut polygons into triangles.
"""

from typing import Any

import numpy as np
from scipy.spatial import KDTree

Shape = dict[str, Any]
SINGLE = (
    1e-5  # of the size of the shape: a few roundings of single precision, and six digits of text
)
SHADES = 1.5  # of 255: one rounding each of the two programs
# Tetrahedra of the other cells; each side is cut once, so that volumes are right where sides are flat.
SPLITS = {
    "tetra": [[0, 1, 2, 3]],
    "pyramid": [[0, 1, 2, 4], [0, 2, 3, 4]],
    "wedge": [[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]],
    "hexahedron": [[0, 1, 3, 4], [1, 2, 3, 6], [1, 3, 4, 6], [1, 4, 5, 6], [3, 4, 6, 7]],
}


def compare(truth: Shape, found: Shape) -> dict[str, str]:
    """Return the aspects of a shape that were found to be others, each with what is and what should be."""
    size = float(np.ptp(np.array(truth["points"]), axis=0).max())
    near = SINGLE * size
    corners = [corner for cell in cells_of(found) for corner in cell]
    if not corners:
        return {"coordinates": "none"}
    if max(corners) >= len(found["points"]):
        return {"coordinates": "corners without a point"}
    right, got = used_points(truth), used_points(found)
    if not np.isfinite(got).all():
        return {"coordinates": "not finite"}
    gap = max(KDTree(got).query(right)[0].max(), KDTree(right).query(got)[0].max())
    facts = {}
    for name, measure in (("area", area), ("volume", volume), ("length", length)):
        expected, measured = measure(truth), measure(found)
        if expected is None:
            continue
        if measured is None or not abs(measured - expected) <= 10 * SINGLE * expected:
            text = "none" if measured is None else f"{measured:.5g}"
            facts[name] = f"{text} for {expected:.5g}"
    if not gap <= near:  # all else follows from where the points are
        sizes_told = "".join(f", {name} {fact}" for name, fact in facts.items())
        return {"coordinates": f"off by {gap / size:.2g} of the size{sizes_told}"}
    differences = facts
    if "texture" in truth:
        differences |= compare_at_corners(truth, found, "texture", 1e-4)
    if "colors" in truth:
        differences |= compare_at_corners(truth, found, "colors", SHADES)
    for name, each in truth.get("point_fields", {}).items():
        differences |= compare_point_field(name, each, truth, found)
    for name, each in truth.get("cell_fields", {}).items():
        differences |= compare_cell_field(name, each, truth, found)
    return differences


def cells_of(shape: Shape) -> list[list[int]]:
    """Return the faces, curves and solids of a shape, in the order of their fields."""
    solids = [cell for cells in shape.get("cells", {}).values() for cell in cells]
    return [*shape.get("polygons", []), *shape.get("lines", []), *solids]


def used_points(shape: Shape) -> np.ndarray:
    """Return the points of the cells."""
    points = np.array(shape["points"], dtype=np.float64).reshape(-1, 3)
    used = np.unique([corner for cell in cells_of(shape) for corner in cell]).astype(int)
    return points[used]


def sizes(shape: Shape) -> np.ndarray:
    """Return the areas of faces, the lengths of curves and the volumes of solids, cell by cell."""
    points = np.array(shape["points"], dtype=np.float64).reshape(-1, 3)
    found = [np.linalg.norm(area_vectors(points, shape.get("polygons", [])), axis=1)]
    for corners in shape.get("lines", []):
        found.append([np.linalg.norm(np.diff(points[corners], axis=0), axis=1).sum()])
    for kind, cells in shape.get("cells", {}).items():
        corners = points[np.array(cells)[:, SPLITS[kind]]]  # of each cell and tetrahedron
        parts = np.abs(np.linalg.det(corners[..., 1:, :] - corners[..., :1, :]))
        found.append(parts.sum(axis=1) / 6)
    return np.concatenate(found)


def area_vectors(points: np.ndarray, polygons: list[list[int]]) -> np.ndarray:
    """Return the vector areas of polygons, convex or not (Newell)."""
    vectors = np.zeros((len(polygons), 3))
    lengths = np.array([len(corners) for corners in polygons])
    for count in np.unique(lengths):
        chosen = np.flatnonzero(lengths == count)
        corners = points[np.array([polygons[number] for number in chosen])]
        arms = corners - corners[:, :1]
        vectors[chosen] = np.cross(arms, np.roll(arms, -1, axis=1)).sum(axis=1) / 2
    return vectors


def area(shape: Shape) -> float | None:
    """Return the area of a surface."""
    return float(sizes(shape).sum()) if shape.get("polygons") else None


def volume(shape: Shape) -> float | None:
    """Return the volume that a closed surface encloses, or that of solids."""
    if shape.get("cells"):
        return float(sizes(shape).sum())
    if not shape.get("closed", True) or not shape.get("polygons"):
        return None
    points = np.array(shape["points"], dtype=np.float64).reshape(-1, 3)
    middle = points.mean(axis=0)
    arms = points[[corners[0] for corners in shape["polygons"]]] - middle
    return float((arms * area_vectors(points, shape["polygons"])).sum() / 3)


def length(shape: Shape) -> float | None:
    """Return the length of curves."""
    return float(sizes(shape).sum()) if shape.get("lines") else None


def corner_rows(shape: Shape, key: str) -> np.ndarray | None:
    """Return the values at all corners of faces, stored for corners or for points."""
    if f"corner_{key}" in shape:
        rows = [row for face in shape[f"corner_{key}"] for row in face]
        return np.array(rows, dtype=np.float64)
    if shape.get(key) is None:
        return None
    values = np.array(shape[key], dtype=np.float64)
    return values[[corner for face in shape["polygons"] for corner in face]]


def compare_at_corners(truth: Shape, found: Shape, key: str, step: float) -> dict[str, str]:
    """Compare colors or texture coordinates as pairs of a place and a value."""
    got = corner_rows(found, key)
    if got is None:
        return {key: "none"}
    width = 2 if key == "texture" else 3
    sets = []
    for shape, rows in ((truth, corner_rows(truth, key)), (found, got)):
        points = np.array(shape["points"], dtype=np.float64)
        corners = [corner for face in shape["polygons"] for corner in face]
        scale = np.ptp(np.array(truth["points"]), axis=0).max()
        # A step of a value weighs as much as a hundredth of the size: places are farther apart.
        sets.append(np.column_stack([points[corners] / scale, 0.01 * rows[:, :width] / step]))
    gap = max(KDTree(sets[0]).query(sets[1])[0].max(), KDTree(sets[1]).query(sets[0])[0].max())
    return {} if gap <= 0.0101 * np.sqrt(width) else {key: f"off by {step * gap / 0.01:.3g}"}


def compare_point_field(
    name: str, expected: dict[str, Any], truth: Shape, found: Shape
) -> dict[str, str]:
    """Compare a field at points, by their places."""
    held = found.get("point_fields", {}).get(name)
    if held is None:
        return {f"field {name}": "none"}
    points = np.array(found["points"], dtype=np.float64)
    used = np.unique([corner for cell in cells_of(found) for corner in cell]).astype(int)
    _, nearest = KDTree(np.array(truth["points"])).query(points[used])
    values, right = np.array(held["values"]), np.array(expected["values"])[nearest]
    if len(values) != len(points):
        return {f"field {name}": f"{len(values)} rows for {len(points)}"}
    got = values[used].reshape(right.shape).astype(np.float64)
    gap = np.abs(got - right.astype(np.float64)).max()
    scale = np.abs(right.astype(np.float64)).max()
    is_near = gap <= (1e-6 * scale if expected["type"].startswith("float") else 0)
    return {} if is_near else {f"field {name}": f"off by {gap:.3g} of {scale:.3g}"}


def compare_cell_field(
    name: str, expected: dict[str, Any], truth: Shape, found: Shape
) -> dict[str, str]:
    """Compare a field of cells by the area, length or volume that each value has."""
    fields = found.get("cell_fields", {})
    held = fields.get(name, fields.get(f"face_{name}"))
    if held is None:
        return {f"field {name}": "none"}
    got_sizes = sizes(found)
    right_sizes = sizes(truth)
    for fields_of_cells, cell_sizes in ((held, got_sizes), (expected, right_sizes)):
        n_rows = len(fields_of_cells["values"])
        if n_rows != len(cell_sizes):
            return {f"field {name}": f"{n_rows} rows for {len(cell_sizes)} cells"}
    shares = []
    for values, weights in ((expected["values"], right_sizes), (held["values"], got_sizes)):
        share: dict[float, float] = {}
        for value, weight in zip(np.ravel(values).astype(float), weights, strict=True):
            key = float(f"{value:.5g}")
            share[key] = share.get(key, 0.0) + weight
        shares.append(share)
    right, got = shares
    wrong = [key for key in {*right, *got} if abs(right.get(key, 0) - got.get(key, 0)) > 1e-3]
    return {} if not wrong else {f"field {name}": f"other cells have {sorted(wrong)[0]:g}"}
