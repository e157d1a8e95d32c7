"""Made-up surfaces whose spectra are known."""

import numpy as np
from jaxtyping import Int

from eigenshape._arrays import positive_values, whole_number
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.subdivision import subdivide


def icosphere(level: int = 3) -> TriangleMesh:
    """Subdivide an icosahedron `level` times onto the unit sphere: 10·4^level + 2 vertices.

    The sphere's eigenvalues are l(l+1), each 2l+1 times.
    """
    whole_number(level, "level", 0, 9)
    mesh = _icosahedron()
    for _ in range(level):
        mesh = subdivide(mesh)
        mesh = TriangleMesh(
            mesh.vertices / np.linalg.norm(mesh.vertices, axis=1, keepdims=True), mesh.faces
        )
    return mesh


def _icosahedron() -> TriangleMesh:
    golden = (1 + 5**0.5) / 2
    signs = np.array([(a, b * golden) for a in (-1, 1) for b in (-1, 1)])
    points = np.concatenate(
        [np.roll(np.insert(signs, 0, 0.0, axis=1), turn, axis=1) for turn in range(3)]
    )
    points = points / np.linalg.norm(points[0])
    return TriangleMesh(points, _faces_around_origin(points))


def _faces_around_origin(points: np.ndarray) -> Int[np.ndarray, "f 3"]:
    """Return the triangles of three mutually nearest points, turned outward."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    near = (distance < 1.01 * distance[distance > 0].min()) & (distance > 0)
    n = len(points)
    triples = [
        (a, b, c)
        for a in range(n)
        for b in range(a + 1, n)
        for c in range(b + 1, n)
        if near[a, b] and near[b, c] and near[a, c]
    ]
    outward = [
        (a, b, c) if np.linalg.det(points[[a, b, c]]) > 0 else (a, c, b) for a, b, c in triples
    ]
    return np.array(outward, dtype=np.int64)


def torus(
    n_around: int = 48, n_across: int = 24, *, outer: float = 1.0, inner: float = 0.4
) -> TriangleMesh:
    """Sweep a circle of radius `inner` around the z axis at distance `outer`, on a regular grid."""
    whole_number(n_around, "n_around", 3, 10**6)
    whole_number(n_across, "n_across", 3, 10**6)
    positive_values([outer, inner], "outer and inner")
    u = 2 * np.pi * np.arange(n_around)[:, None] / n_around
    v = 2 * np.pi * np.arange(n_across)[None, :] / n_across
    rim = outer + inner * np.cos(v)
    points = np.stack(
        [rim * np.cos(u), rim * np.sin(u), np.broadcast_to(inner * np.sin(v), (n_around, n_across))]
    )
    return TriangleMesh(points.reshape(3, -1).T, _wrapped_grid(n_around, n_across))


def _wrapped_grid(rows: int, columns: int) -> Int[np.ndarray, "f 3"]:
    i, j = (index.ravel() for index in np.indices((rows, columns)))
    here, right = i * columns + j, i * columns + (j + 1) % columns
    below, across = (i + 1) % rows * columns + j, (i + 1) % rows * columns + (j + 1) % columns
    return np.concatenate(
        [np.column_stack([here, below, across]), np.column_stack([here, across, right])]
    )


def grid(n_x: int = 20, n_y: int = 20, *, width: float = 1.0, height: float = 1.0) -> TriangleMesh:
    """Triangulate a flat rectangle with n_x by n_y squares; its Neumann eigenvalues are π²(p²/w² + q²/h²)."""
    whole_number(n_x, "n_x", 1, 10**6)
    whole_number(n_y, "n_y", 1, 10**6)
    positive_values([width, height], "width and height")
    x, y = np.meshgrid(
        np.linspace(0, width, n_x + 1), np.linspace(0, height, n_y + 1), indexing="ij"
    )
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    i, j = (index.ravel() for index in np.indices((n_x, n_y)))
    here = i * (n_y + 1) + j
    right, below, across = here + 1, here + n_y + 1, here + n_y + 2
    faces = np.concatenate(
        [np.column_stack([here, below, across]), np.column_stack([here, across, right])]
    )
    return TriangleMesh(points, faces)
