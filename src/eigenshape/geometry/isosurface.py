"""The surface where a smooth function is zero, as a closed mesh of even triangles."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table, is_closed, is_manifold, vertex_components

Field = Callable[[Float[np.ndarray, "p 3"]], Float[np.ndarray, " p"]]

ROUNDS = 12  # of smoothing along the surface
# Places of the grid against the surface, in cells, none a symmetric one: sheets that meet in a cell at one place of it
# are apart at another.
PLACES = np.array([[0.5, 0.5, 0.5]]) + np.arange(12)[:, None] * np.array([[0.7548777, 0.5698403, 0.3247180]])


def isosurface(field: Field, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"], spacing: float) -> TriangleMesh:
    """Mesh the zero set of a function that is negative inside, by surface nets, drawn onto the surface and evened out.

    One vertex a cell cannot tell two sheets in one cell apart, so the result is checked, and another place of the grid
    is tried where the first was not a manifold (Gibson 1998 gives the nets).

    Raises
    ------
    InvalidShapeError
        If no place of the grid gives a closed connected manifold: the surface has details finer than the grid.
    """
    for place in PLACES % 1:
        mesh = _nets(field, low - spacing * (1 + place), high + 2 * spacing, spacing)
        if is_closed(mesh) and is_manifold(mesh) and vertex_components(mesh)[0] == 1:
            return _evened(field, mesh, spacing)
    raise InvalidShapeError(f"A surface must be smooth at the size of the grid; at spacing {spacing:.3g} it is not.")


def _nets(field: Field, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"], spacing: float) -> TriangleMesh:
    axes = [np.arange(start, stop, spacing) for start, stop in zip(low, high, strict=True)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = field(lattice.reshape(-1, 3)).reshape(lattice.shape[:3])
    number, points = _cell_points(values)
    quads = np.concatenate([_quads(values, number, axis) for axis in range(3)])
    split = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return TriangleMesh(low + spacing * points, split)


def _cell_points(values: Float[np.ndarray, "x y z"]) -> tuple[Int[np.ndarray, "a b c"], Float[np.ndarray, "p 3"]]:
    """Put a point into each cell that the surface crosses: the mean of where it crosses the cell's edges."""
    cells = np.array(values.shape) - 1
    sums = np.zeros((*cells, 3))
    counts = np.zeros(cells, dtype=np.int64)
    for axis in range(3):
        here, there = _ends(values, axis)
        crosses = (here < 0) != (there < 0)
        share = np.where(crosses, here / np.where(crosses, here - there, 1.0), 0.0)
        for shift in np.ndindex(2, 2):
            corner = np.insert(shift, axis, 0)
            window = tuple(slice(start, start + length) for start, length in zip(corner, cells, strict=True))
            for other in range(3):
                sums[..., other] += crosses[window] * (share[window] if other == axis else corner[other])
            counts += crosses[window]
    crossed = counts > 0
    number = np.full(cells, -1, dtype=np.int64)
    number[crossed] = np.arange(crossed.sum())
    return number, np.argwhere(crossed) + sums[crossed] / counts[crossed, None]


def _ends(values: Float[np.ndarray, "x y z"], axis: int) -> tuple[np.ndarray, np.ndarray]:
    n = values.shape[axis]
    return values.take(np.arange(n - 1), axis), values.take(np.arange(1, n), axis)


def _quads(values: Float[np.ndarray, "x y z"], number: Int[np.ndarray, "a b c"], axis: int) -> Int[np.ndarray, "q 4"]:
    """Join the points of the four cells around each lattice edge along `axis` that the surface crosses."""
    here, there = _ends(values, axis)
    edges = np.argwhere((here < 0) != (there < 0))
    leaves = here[tuple(edges.T)] < 0
    one, two = np.eye(3, dtype=np.int64)[[(axis + 1) % 3, (axis + 2) % 3]]
    around = [edges - one - two, edges - two, edges, edges - one]
    quads = np.column_stack([number[tuple(cell.T)] for cell in around])
    return np.where(leaves[:, None], quads, quads[:, ::-1])


def _evened(field: Field, mesh: TriangleMesh, spacing: float) -> TriangleMesh:
    one, two = edge_table(mesh).edges.T
    degree = np.bincount(np.concatenate([one, two]), minlength=mesh.n_vertices)
    points = _drawn(field, mesh.vertices, spacing)
    for _ in range(ROUNDS):
        sums = [
            np.bincount(one, points[two, axis], mesh.n_vertices) + np.bincount(two, points[one, axis], mesh.n_vertices)
            for axis in range(3)
        ]
        pull = np.column_stack(sums) / degree[:, None] - points
        normal = _gradient(field, points, spacing)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        pull -= np.einsum("ij,ij->i", pull, normal)[:, None] * normal
        points = _drawn(field, points + 0.6 * pull, spacing, steps=1)
    return TriangleMesh(points, mesh.faces)


def _drawn(field: Field, points: Float[np.ndarray, "p 3"], spacing: float, steps: int = 3) -> Float[np.ndarray, "p 3"]:
    """Move points onto the zero set by Newton's steps along the gradient, none longer than half a cell."""
    for _ in range(steps):
        gradient = _gradient(field, points, spacing)
        step = field(points) / np.einsum("ij,ij->i", gradient, gradient)
        points = points - np.clip(step, -0.5 * spacing, 0.5 * spacing)[:, None] * gradient
    return points


def _gradient(field: Field, points: Float[np.ndarray, "p 3"], spacing: float) -> Float[np.ndarray, "p 3"]:
    width = 1e-3 * spacing
    moves = width * np.eye(3)
    return np.column_stack([(field(points + move) - field(points - move)) / (2 * width) for move in moves])
