"""Ways to break a mesh, for tests of what refuses and of what repairs."""

import numpy as np

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.shapes.surfaces import icosphere


def soup(mesh):
    """Give each face, or simplex, vertices of its own."""
    simplices = np.arange(mesh.simplices.size).reshape(mesh.simplices.shape)
    return type(mesh)(mesh.points[mesh.simplices].reshape(-1, mesh.points.shape[1]), simplices)


def flipped(mesh, rng):
    """Turn half of the faces over."""
    turned = rng.random(mesh.n_faces) < 0.5
    return TriangleMesh(mesh.vertices, np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces))


def everted(mesh):
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def with_duplicates(mesh, rng, count=3):
    """Add some faces, or simplices, once more, with their corners in another order."""
    again = mesh.simplices[rng.choice(len(mesh.simplices), count)]
    return type(mesh)(mesh.points, np.concatenate([mesh.simplices, np.roll(again, 1, axis=1)]))


def with_loose_points(mesh, rng, count=3):
    """Put points that nothing uses among the others."""
    points = np.concatenate([rng.standard_normal((count, mesh.points.shape[1])), mesh.points])
    return type(mesh)(points, mesh.simplices + count)


def with_flat_simplices(mesh, rng):
    """Add a simplex with a corner twice, and one whose corners are all at one place."""
    one = mesh.simplices[rng.integers(len(mesh.simplices))]
    twice = np.concatenate([one[:1], one[:-1]])
    points = np.concatenate([mesh.points, np.tile(mesh.points[one[0]], (len(one), 1))])
    same = np.arange(mesh.n_points, len(points))
    return type(mesh)(points, [*mesh.simplices, twice, same])


def with_slivers(mesh, rng, count=1):
    """Split faces by a vertex on an edge: of three new faces one has no area."""
    split = rng.choice(mesh.n_faces, count, replace=False)
    a, b, c = mesh.faces[split].T
    share = rng.uniform(0.1, 0.9, (count, 1))
    new = mesh.n_vertices + np.arange(count)
    points = np.concatenate(
        [mesh.vertices, (1 - share) * mesh.vertices[a] + share * mesh.vertices[b]]
    )
    pieces = [np.column_stack(corners) for corners in ((a, new, c), (new, b, c), (a, b, new))]
    return TriangleMesh(points, np.concatenate([np.delete(mesh.faces, split, axis=0), *pieces]))


def without_faces(mesh, rng, count=2):
    keep = np.ones(mesh.n_faces, dtype=bool)
    keep[rng.choice(mesh.n_faces, count, replace=False)] = False
    return TriangleMesh(mesh.vertices, mesh.faces[keep])


def with_specks(mesh, rng, count=5):
    """Add tiny closed pieces around a mesh."""
    speck = icosphere(0)
    places = 5 + 9 * rng.random((count, 3))
    return disjoint_union(
        mesh, *[TriangleMesh(0.01 * speck.vertices + place, speck.faces) for place in places]
    )


def cut_open(mesh, rng):
    """Give the faces on one side of a plane vertices of their own."""
    side = mesh.vertices[mesh.faces].mean(axis=1) @ rng.standard_normal(3) > 0
    faces = mesh.faces.copy()
    faces[side] += mesh.n_vertices
    used, renumbered = np.unique(faces, return_inverse=True)
    points = np.concatenate([mesh.vertices, mesh.vertices])
    return TriangleMesh(points[used], renumbered.reshape(-1, 3))


def moebius(n=24, n_across=3):
    """Build a strip with a half turn, its last column glued to the first upside down."""
    u, v = np.meshgrid(
        2 * np.pi * np.arange(n) / n, np.linspace(-0.3, 0.3, n_across + 1), indexing="ij"
    )
    rim = 1 + v * np.cos(u / 2)
    points = np.stack([rim * np.cos(u), rim * np.sin(u), v * np.sin(u / 2)], axis=-1).reshape(-1, 3)
    at = np.arange(n * (n_across + 1)).reshape(n, -1)
    at = np.vstack([at, at[0, ::-1]])
    here, below, right, across = (
        part.ravel() for part in (at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:])
    )
    faces = np.concatenate(
        [np.column_stack([here, below, across]), np.column_stack([here, across, right])]
    )
    return TriangleMesh(points, faces)


def tetrahedra():
    """Two tetrahedra on one face."""
    points = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    return SimplicialMesh(points, [[0, 1, 2, 3], [1, 2, 3, 4]])
