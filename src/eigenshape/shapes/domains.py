"""Made-up flat domains of dimension 1 to 3, whose spectra are known (`geometry.exact`)."""

from collections.abc import Sequence
from itertools import permutations
from typing import SupportsIndex

import numpy as np
from scipy.spatial import Delaunay

from eigenshape._arguments import require_type
from eigenshape._arrays import positive_values, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh

MOST = 10**6


def interval(n: SupportsIndex = 50, length: float = 1.0) -> SimplicialMesh:
    """Cut an interval into n equal segments; eigenvalues are `box_eigenvalues(k, [length])`."""
    count = whole_number(n, "n", 1, MOST)
    positive_values(length, "length")
    steps = np.arange(count)
    return SimplicialMesh(
        np.linspace(0, length, count + 1)[:, None], np.column_stack([steps, steps + 1])
    )


def circle(n: SupportsIndex = 50, radius: float = 1.0) -> SimplicialMesh:
    """Inscribe a polygon of n sides in a circle; the circle's eigenvalues are `sphere_eigenvalues(k, 1)` / radius²."""
    count = whole_number(n, "n", 3, MOST)
    positive_values(radius, "radius")
    steps = np.arange(count)
    angles = 2 * np.pi * steps / count
    points = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return SimplicialMesh(points, np.column_stack([steps, (steps + 1) % count]))


def disc(n_rings: SupportsIndex = 10, radius: float = 1.0) -> TriangleMesh:
    """Triangulate a flat disc facing +z, with 6j points on ring j; eigenvalues are `disc_eigenvalues(k)` / radius²."""
    count = whole_number(n_rings, "n_rings", 1, 1000)
    positive_values(radius, "radius")
    rings = [_ring(j, j / count * radius) for j in range(1, count + 1)]
    flat = np.concatenate([np.zeros((1, 2)), *rings])
    faces = [_band(j) for j in range(1, count + 1)]
    return TriangleMesh(np.pad(flat, ((0, 0), (0, 1))), np.concatenate(faces))


def _ring(j: int, radius: float) -> np.ndarray:
    angles = 2 * np.pi * np.arange(6 * j) / (6 * j)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def _band(j: int) -> np.ndarray:
    """Return the triangles between ring j - 1 and ring j: in each sixth, j that point in and j - 1 that point out."""
    inner, outer = 1 + 3 * (j - 2) * (j - 1) if j > 1 else 0, 1 + 3 * (j - 1) * j
    sector, step = (index.ravel() for index in np.indices((6, j)))
    out = outer + sector * j + step
    out_next = outer + (sector * j + step + 1) % (6 * j)
    n_inner = max(6 * (j - 1), 1)
    below = inner + (sector * (j - 1) + step) % n_inner
    below_next = inner + (sector * (j - 1) + step + 1) % n_inner
    inward = np.column_stack([out, out_next, below])
    outward = np.column_stack([out_next, below_next, below])[step < j - 1]
    return np.concatenate([inward, outward])


def irregular_grid(
    n_x: SupportsIndex = 20,
    n_y: SupportsIndex = 20,
    *,
    jitter: float = 0.3,
    rng: np.random.Generator,
) -> TriangleMesh:
    """Triangulate the flat unit square with inner vertices moved at random by up to `jitter` steps of the grid.

    Delaunay triangles, facing +z; eigenvalues are `box_eigenvalues(k)`.
    """
    require_type(rng, np.random.Generator, "rng")
    counts = whole_number(n_x, "n_x", 1, 2000), whole_number(n_y, "n_y", 1, 2000)
    if not 0 <= jitter < 0.5:
        raise InvalidParameterError(f"jitter must be at least 0 and less than 0.5; it is {jitter}.")
    x, y = np.meshgrid(*(np.linspace(0, 1, count + 1) for count in counts), indexing="ij")
    flat = np.column_stack([x.ravel(), y.ravel()])
    inside = ((flat > 0) & (flat < 1)).all(axis=1)
    flat[inside] += rng.uniform(-jitter, jitter, (int(inside.sum()), 2)) / counts
    corners = Delaunay(flat).simplices
    sides = flat[corners[:, 1:]] - flat[corners[:, :1]]
    doubled = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    sound = np.abs(doubled) > 1e-12 / (
        counts[0] * counts[1]
    )  # points on one side of the square make flat ones
    corners[doubled < 0] = corners[doubled < 0][:, ::-1]
    return TriangleMesh(np.pad(flat, ((0, 0), (0, 1))), corners[sound])


def box(
    n_x: SupportsIndex = 6,
    n_y: SupportsIndex = 6,
    n_z: SupportsIndex = 6,
    *,
    sides: Sequence[float] = (1.0, 1.0, 1.0),
) -> SimplicialMesh:
    """Fill a box with tetrahedra, six to a cell; eigenvalues are `box_eigenvalues(k, sides)`."""
    counts = tuple(
        whole_number(n, name, 1, 500) for n, name in ((n_x, "n_x"), (n_y, "n_y"), (n_z, "n_z"))
    )
    lengths = positive_values(list(sides), "sides")
    if len(lengths) != 3:
        raise InvalidParameterError(f"sides must be three lengths; they are {len(lengths)}.")
    points = np.stack(
        np.meshgrid(*(np.arange(count + 1) for count in counts), indexing="ij"), axis=-1
    ).reshape(-1, 3)
    return SimplicialMesh(points / np.array(counts) * lengths, _kuhn(counts))


def _kuhn(counts: tuple[int, ...], turned: int = 0) -> np.ndarray:
    """Cut each cell into six tetrahedra along a main diagonal.

    The diagonal points forward along an axis, but backward in the first `turned` layers. Neighbours match all the
    same: the cut of the side between them depends on the other two axes, on which they have one place.
    """
    strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    cells = np.moveaxis(np.indices(counts), 0, -1).reshape(-1, 3)
    steps = np.where(cells < turned, -strides, strides)
    starts = cells @ strides + np.maximum(-steps, 0).sum(axis=1)
    walks = [
        np.cumsum(np.column_stack([starts, steps[:, order]]), axis=1)
        for order in permutations(range(3))
    ]
    return np.concatenate(walks)


def ball(n: SupportsIndex = 8) -> SimplicialMesh:
    """Fill the unit ball with tetrahedra: a grid of n³ cubes blown up along its rays, its boundary on the sphere.

    Every cube is cut along the diagonal that points outward, so that no tetrahedron has two sides on the boundary:
    where the edge of the cube becomes smooth, those would be flat. Eigenvalues are `ball_eigenvalues(k)`.
    """
    count = whole_number(n, "n", 2, 200)
    cube = box(count, count, count)
    points = 2 * cube.points - 1
    largest = np.abs(points).max(axis=1, keepdims=True)
    length = np.linalg.norm(points, axis=1, keepdims=True)
    blown = np.divide(largest, length, out=np.ones_like(length), where=length > 0)
    return SimplicialMesh(points * blown, _kuhn((count,) * 3, turned=count // 2))
