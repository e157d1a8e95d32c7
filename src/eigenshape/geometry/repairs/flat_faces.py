"""Removal of faces without area that does not open the surface."""

import numpy as np
from jaxtyping import Bool, Int

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import degenerate_simplices, size_one
from eigenshape.geometry.topology import edge_table


def flip_flat_faces(mesh: TriangleMesh) -> tuple[TriangleMesh, int]:
    """Flip the longest edge of each face without area; return the mesh and the number of flips.

    A face (a, b, m) without area has its vertex m on the edge (a, b). If the face were only
    removed, the edges (a, m) and (m, b) would separate from (a, b): heat would not cross there, and
    a closed surface would become open. So the face (a, b, d) on the other side of the edge is split
    at m into (a, m, d) and (m, b, d). The surface stays the same set of points.

    An edge is left alone if it does not have exactly two faces, if the edge (m, d) exists already,
    or if the flip would create another face without area, as where m coincides with a.
    """
    n_flips = 0
    while True:
        flat, neighbor, faces = _flips(mesh)
        if not len(flat):
            return mesh, n_flips
        changed = mesh.faces.copy()
        changed[flat], changed[neighbor] = faces
        mesh, n_flips = TriangleMesh(mesh.vertices, changed), n_flips + len(flat)


def _flips(
    mesh: TriangleMesh,
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"], Int[np.ndarray, "2 k 3"]]:
    """Return flat faces, the neighbors to be split, and the faces that replace both.

    No two of these flips share a face or create the same edge, so all can be done at once.
    """
    table = edge_table(mesh)
    is_flat = np.zeros(mesh.n_faces, dtype=bool)
    is_flat[degenerate_simplices(mesh)] = True
    flat = np.flatnonzero(is_flat)
    points, _ = size_one(mesh.vertices)
    sides = np.stack([np.roll(mesh.faces[flat], -turn, axis=1) for turn in (1, 2)], axis=2)
    lengths = np.linalg.norm(points[sides[..., 0]] - points[sides[..., 1]], axis=2)
    corner = lengths.argmax(axis=1)  # opposite to the longest side
    (a, b), m = sides[np.arange(len(flat)), corner].T, mesh.faces[flat, corner]
    edge = table.face_edges[flat, corner]
    neighbor = _across(table.face_edges, edge, flat)
    between = mesh.faces[neighbor]
    d = between.sum(axis=1) - a - b
    one = np.where(between == b[:, None], m[:, None], between)
    two = np.where(between == a[:, None], m[:, None], between)
    keys = np.minimum(m, d) * mesh.n_vertices + np.maximum(m, d)
    known = table.edges[:, 0] * mesh.n_vertices + table.edges[:, 1]
    good = (table.n_faces[edge] == 2) & ~is_flat[neighbor] & ~np.isin(keys, known)
    good &= ~_are_flat(mesh, one) & ~_are_flat(mesh, two)
    chosen = np.flatnonzero(good)
    chosen = chosen[np.unique(neighbor[chosen], return_index=True)[1]]
    chosen = chosen[np.unique(keys[chosen], return_index=True)[1]]
    return flat[chosen], neighbor[chosen], np.stack([one[chosen], two[chosen]])


def _across(
    face_edges: Int[np.ndarray, "f 3"], edges: Int[np.ndarray, " k"], faces: Int[np.ndarray, " k"]
) -> Int[np.ndarray, " k"]:
    """Return for each edge a face other than the given one, or the given one if it is alone."""
    order = np.argsort(face_edges.ravel(), kind="stable")
    ordered = face_edges.ravel()[order]
    first = order[np.searchsorted(ordered, edges)] // 3
    last = order[np.searchsorted(ordered, edges, side="right") - 1] // 3
    return np.where(first == faces, last, first)


def _are_flat(mesh: TriangleMesh, faces: Int[np.ndarray, "k 3"]) -> Bool[np.ndarray, " k"]:
    found = np.zeros(len(faces), dtype=bool)
    if len(faces):
        found[degenerate_simplices(TriangleMesh(mesh.vertices, faces))] = True
    return found
