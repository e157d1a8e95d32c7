"""Broken variants of sound meshes: what scanners, modelers and converters leave behind.

Each function takes the vertices (n, 3) and faces (f, 3) of a mesh and a random generator, and returns those of a
broken copy. Random numbers choose where the damage is; the size of the damage is stated in each function.
"""

from collections.abc import Callable, Iterator

import numpy as np

import eigenshape as es

Arrays = tuple[np.ndarray, np.ndarray]
CORNER = es.TriangleMesh(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
)


def loose_vertices(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Add 300 vertices that no face uses, somewhere in the bounding box."""
    loose = rng.uniform(vertices.min(axis=0), vertices.max(axis=0), (300, 3))
    return np.concatenate([vertices, loose]), faces


def slivers(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Split 20 faces by a vertex on an edge: one of the three new faces has no area, another is thin."""
    split = rng.choice(len(faces), 20, replace=False)
    a, b, c = faces[split].T
    share = rng.choice([1e-3, 1e-6, 1e-9], (20, 1))
    new = len(vertices) + np.arange(20)
    on_edge = vertices[a] + share * (vertices[b] - vertices[a])
    pieces = [np.column_stack(corners) for corners in ((a, new, c), (new, b, c), (a, b, new))]
    kept = np.delete(faces, split, axis=0)
    return np.concatenate([vertices, on_edge]), np.concatenate([kept, *pieces])


def collapsed_faces(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Add 20 faces with two equal corners."""
    chosen = faces[rng.choice(len(faces), 20, replace=False)]
    return vertices, np.concatenate([faces, chosen[:, [0, 1, 1]]])


def duplicate_faces(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Repeat one face in twenty, half of the copies turned over."""
    chosen = faces[rng.choice(len(faces), len(faces) // 20, replace=False)]
    chosen[::2] = chosen[::2, ::-1]
    return vertices, np.concatenate([faces, chosen])


def flipped_faces(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Turn half of the faces over."""
    flipped = faces.copy()
    chosen = rng.random(len(faces)) < 0.5
    flipped[chosen] = flipped[chosen, ::-1]
    return vertices, flipped


def holes(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Cut 38 holes: all faces around a vertex go, and the vertex stays without a face."""
    centers = rng.choice(len(vertices), 38, replace=False)
    return vertices, faces[~np.isin(faces, centers).any(axis=1)]


def specks(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Add 200 tetrahedra of one five-hundredth of the box, as dust of a scan."""
    return _beside(vertices, faces, CORNER, 200, 0.002, rng)


def many_parts(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Add 40 spheres of one thirtieth of the box."""
    return _beside(vertices, faces, es.icosphere(2), 40, 0.03, rng)


def strips(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Hang ten strips of six triangles on single vertices, which are no manifold then."""
    step = 0.01 * np.ptp(vertices, axis=0).max()
    for root in rng.choice(len(vertices), 10, replace=False):
        first = len(vertices)
        zigzag = np.array([[i * step, (i % 2) * step, 0.3 * step] for i in range(1, 8)])
        path = np.concatenate([[root], first + np.arange(7)])
        triangles = np.column_stack([path[:-2], path[1:-1], path[2:]])
        vertices = np.concatenate([vertices, vertices[root] + zigzag])
        faces = np.concatenate([faces, triangles])
    return vertices, faces


def soup(vertices: np.ndarray, faces: np.ndarray, _: np.random.Generator) -> Arrays:
    """Give each face three vertices of its own."""
    return vertices[faces.ravel()], np.arange(faces.size).reshape(-1, 3)


def fins(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Put a third face on five edges."""
    chosen = faces[rng.choice(len(faces), 5, replace=False)]
    step = 0.02 * np.ptp(vertices, axis=0).max()
    tips = vertices[chosen[:, 0]] + rng.normal(0, step, (5, 3))
    new = len(vertices) + np.arange(5)
    fin = np.column_stack([chosen[:, 0], chosen[:, 1], new])
    return np.concatenate([vertices, tips]), np.concatenate([faces, fin])


def everything(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Arrays:
    """Break the mesh in six ways, one after the other."""
    for harm in (holes, many_parts, slivers, duplicate_faces, flipped_faces, soup):
        vertices, faces = harm(vertices, faces, rng)
    return vertices, faces


HARMS: tuple[Callable[[np.ndarray, np.ndarray, np.random.Generator], Arrays], ...] = (
    loose_vertices,
    slivers,
    collapsed_faces,
    duplicate_faces,
    flipped_faces,
    holes,
    specks,
    many_parts,
    strips,
    soup,
    fins,
    everything,
)


def broken_variants(meshes: dict[str, es.TriangleMesh]) -> Iterator[tuple[str, Arrays]]:
    """Break each mesh in each way; the name says which mesh and how."""
    for number, (name, mesh) in enumerate(meshes.items()):
        for kind, harm in enumerate(HARMS):
            rng = np.random.default_rng([number, kind])
            yield f"{name}-{harm.__name__}", harm(mesh.vertices, mesh.faces.copy(), rng)


def _beside(
    vertices: np.ndarray,
    faces: np.ndarray,
    piece: es.TriangleMesh,
    count: int,
    share: float,
    rng: np.random.Generator,
) -> Arrays:
    """Scatter copies of a piece, of a share of the largest side, in the bounding box."""
    side = share * np.ptp(vertices, axis=0).max()
    places = rng.uniform(vertices.min(axis=0), vertices.max(axis=0), (count, 3))
    copies = (side * piece.vertices + places[:, None]).reshape(-1, 3)
    starts = len(vertices) + piece.n_vertices * np.arange(count)
    copied_faces = (piece.faces + starts[:, None, None]).reshape(-1, 3)
    return np.concatenate([vertices, copies]), np.concatenate([faces, copied_faces])
