"""Surgery on surfaces: discs cut out, and tubes put between their rims (thesis 4.1: what anomalous regions are)."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

import eigenshape as es


@dataclass(frozen=True, eq=False)
class Surgery:
    """A surface M, what became of it, N, and the regions in which they differ.

    Attributes
    ----------
    one, two : TriangleMesh
        M and N. Faces outside the regions correspond in order, corner by corner.
    regions_one, regions_two : (f,) int
        Of each face: -1 outside, i in the anomalous region X_i of M or Y_i of N.
    """

    one: es.TriangleMesh
    two: es.TriangleMesh
    regions_one: np.ndarray
    regions_two: np.ndarray


def disc_of_faces(mesh: es.TriangleMesh, vertex: int, radius: float) -> np.ndarray:
    """Choose the faces around a vertex whose corners lie within a Euclidean radius of it: one disc.

    What else comes so near through space is left out, and holes in the choice are filled.

    Returns
    -------
    (f,) bool

    Raises
    ------
    InvalidParameterError
        If the choice is empty, or no disc.
    """
    away = np.linalg.norm(mesh.vertices - mesh.vertices[vertex], axis=1)
    inside = _at_vertex(mesh, (away[mesh.faces] <= radius).all(axis=1), vertex)
    component = es.geometry.vertex_components(mesh)[1][mesh.faces[:, 0]]
    outside = ~inside & (component == component[inside][0])
    if outside.any():
        pieces = _pieces(mesh, outside)
        inside |= outside & (pieces != np.bincount(pieces[outside]).argmax())
    part = es.TriangleMesh(mesh.vertices, mesh.faces[inside])
    loops = es.geometry.boundary_loops(part)
    if (
        es.geometry.euler_characteristic(part) != 1
        or len(loops) != 1
        or not es.geometry.is_manifold(part)
    ):
        raise es.InvalidParameterError(
            f"Faces within the radius must form a disc; those within {radius:.4g} of vertex {vertex} have Euler "
            f"characteristic {es.geometry.euler_characteristic(part)} and {len(loops)} rims. Choose another radius."
        )
    return inside


def _at_vertex(mesh: es.TriangleMesh, near: np.ndarray, vertex: int) -> np.ndarray:
    """Keep the piece that holds most of the faces at a vertex."""
    at = near & (mesh.faces == vertex).any(axis=1)
    if not at.any():
        raise es.InvalidParameterError(
            f"A face at the vertex must lie within the radius; vertex {vertex} has none. Choose a larger radius."
        )
    pieces = _pieces(mesh, near)
    return near & (pieces == np.bincount(pieces[at]).argmax())


def _pieces(mesh: es.TriangleMesh, chosen: np.ndarray) -> np.ndarray:
    """Tell apart the pieces, joined across edges, that chosen faces form: give each face the number of its piece."""
    table = es.geometry.edge_table(mesh)
    faces, edges = np.repeat(np.flatnonzero(chosen), 3), table.face_edges[chosen].ravel()
    touch = sp.coo_array(
        (np.ones(len(faces)), (faces, edges)), shape=(mesh.n_faces, len(table.edges))
    ).tocsr()
    return connected_components(touch @ touch.T, directed=False)[1]


def bridge(
    mesh: es.TriangleMesh, vertex_a: int, vertex_b: int, radius: float, *, bulge: float = 0.0
) -> Surgery:
    """Cut a disc out around each of two vertices and put a straight tube between the rims.

    The ends may lie on two surfaces, which are joined, or on one, which gains a handle. Both discs are X_0, the tube
    is Y_0. `bulge` is by what share the tube is wider in its middle.

    Raises
    ------
    InvalidParameterError
        If a disc cannot be cut out, or the discs share a vertex.
    """
    discs = [disc_of_faces(mesh, vertex, radius) for vertex in (vertex_a, vertex_b)]
    rim_a, rim_b = (
        es.geometry.boundary_loops(es.TriangleMesh(mesh.vertices, mesh.faces[disc]))[0]
        for disc in discs
    )
    shared = np.intersect1d(*(mesh.faces[disc] for disc in discs))
    if len(shared):
        raise es.InvalidParameterError(
            f"The ends of a bridge must lie apart; {len(shared)} vertices belong to both. Choose a smaller radius."
        )
    points, tube = _tube(mesh.vertices, rim_a, rim_b, bulge)
    gone = discs[0] | discs[1]
    vertices, faces = np.vstack([mesh.vertices, points]), np.vstack([mesh.faces[~gone], tube])
    used, corners = np.unique(faces, return_inverse=True)
    two = es.TriangleMesh(vertices[used], corners.reshape(-1, 3))
    regions_two = np.where(np.arange(len(faces)) < len(faces) - len(tube), -1, 0)
    return Surgery(mesh, two, np.where(gone, 0, -1), regions_two)


def attach(
    mesh: es.TriangleMesh, other: es.TriangleMesh, vertex: int, end: int, radius: float
) -> Surgery:
    """Join another surface to one by a bridge between their vertices: N grew out of a disc of M, which is X_0."""
    joined = bridge(es.geometry.disjoint_union(mesh, other), vertex, mesh.n_vertices + end, radius)
    regions_one = joined.regions_one[: mesh.n_faces]
    kept = int((regions_one < 0).sum())
    regions_two = np.where(np.arange(joined.two.n_faces) < kept, -1, 0)
    return Surgery(mesh, joined.two, regions_one, regions_two)


def moved(mesh: es.TriangleMesh, vertices: np.ndarray) -> Surgery:
    """Move vertices: a region is a piece of the surface in which a face changed."""
    changed = (vertices != mesh.vertices).any(axis=1)[mesh.faces].any(axis=1)
    regions = np.full(mesh.n_faces, -1)
    regions[changed] = np.unique(_pieces(mesh, changed)[changed], return_inverse=True)[1]
    return Surgery(mesh, es.TriangleMesh(vertices, mesh.faces), regions, regions)


def widened(surgery: Surgery, by: float) -> Surgery:
    """Count to its one region also the faces of which a corner of M lies within a distance of it; N stays as it is."""
    one, inside = surgery.one, surgery.regions_one >= 0
    region = np.unique(one.faces[inside])
    near = cKDTree(one.vertices[region]).query(one.vertices)[0] <= by
    wider = inside | near[one.faces].any(axis=1)
    regions_two = surgery.regions_two.copy()
    regions_two[np.flatnonzero(surgery.regions_two < 0)[wider[~inside]]] = 0
    return Surgery(one, surgery.two, np.where(wider, 0, -1), regions_two)


def _tube(
    vertices: np.ndarray, rim_a: np.ndarray, rim_b: np.ndarray, bulge: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the new points of a tube and its faces; rims run as in the discs that they bounded."""
    start, far = vertices[rim_a], rim_b[::-1]
    far = np.roll(far, -_best_start(start, vertices[far]))
    end = _resampled(vertices[far], _shares(start))
    n = len(rim_a)
    step = np.linalg.norm(start - np.roll(start, -1, axis=0), axis=1).mean()
    layers = max(1, round(float(np.linalg.norm(end - start, axis=1).mean() / step)))
    along = (np.arange(1, layers) / layers)[:, None, None]
    rings = (1 - along) * start + along * end
    middle = rings.mean(axis=1, keepdims=True)
    rings = middle + (rings - middle) * (1 + bulge * np.sin(np.pi * along))
    numbers = np.vstack([rim_a, len(vertices) + np.arange((layers - 1) * n).reshape(-1, n)])
    here, there = numbers[:-1], numbers[1:]
    ahead, across = np.roll(here, -1, axis=1), np.roll(there, -1, axis=1)
    bands = [
        np.stack(corners, axis=-1).reshape(-1, 3)
        for corners in ((here, ahead, across), (here, across, there))
    ]
    last = rings[-1] if layers > 1 else start
    zipped = _zip(numbers[-1], far, (_shares(last), _shares(vertices[far])))
    return rings.reshape(-1, 3), np.vstack([*bands, zipped])


def _shares(loop: np.ndarray) -> np.ndarray:
    """Return how far along a loop each of its points lies, from 0 to below 1."""
    lengths = np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)
    return np.concatenate([[0], np.cumsum(lengths)[:-1]]) / lengths.sum()


def _resampled(loop: np.ndarray, shares: np.ndarray) -> np.ndarray:
    closed, places = np.vstack([loop, loop[:1]]), np.append(_shares(loop), 1.0)
    return np.column_stack([np.interp(shares, places, axis) for axis in closed.T])


def _best_start(near: np.ndarray, far: np.ndarray) -> int:
    """Return from which point on the far loop runs closest to the near one, both seen from their middles."""
    near, far, shares = near - near.mean(axis=0), far - far.mean(axis=0), _shares(near)
    costs = [
        ((_resampled(np.roll(far, -first, axis=0), shares) - near) ** 2).sum()
        for first in range(len(far))
    ]
    return int(np.argmin(costs))


def _zip(near: np.ndarray, far: np.ndarray, shares: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Fill the band between two loops that run side by side, in the order in which their points come."""
    ends = [np.append(part[1:], 1.0) for part in shares]
    i = j = 0
    faces = []
    while i < len(near) or j < len(far):
        a, b = near[i % len(near)], far[j % len(far)]
        if j == len(far) or (i < len(near) and ends[0][i] <= ends[1][j]):
            i += 1
            faces.append((a, near[i % len(near)], b))
        else:
            j += 1
            faces.append((a, far[j % len(far)], b))
    return np.array(faces)
