"""Triangulation of holes between the vertices around them."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Int

from eigenshape.geometry.hole_loops import triangulate
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import size_one
from eigenshape.geometry.topology import EdgeTable, boundary_loops, edge_table, half_edges


@dataclass(frozen=True, eq=False)
class Fillings:
    """Faces that close holes.

    Attributes
    ----------
    faces : tuple of (t, 3) int
        The new faces of each hole that can be closed.
    n_long : int
        Number of holes with too many edges.
    n_open : int
        Number of other holes that no sound faces close.
    """

    faces: tuple[Int[np.ndarray, "_ 3"], ...]
    n_long: int
    n_open: int


def triangulate_holes(mesh: TriangleMesh, most_edges: int) -> Fillings:
    """Triangulate each boundary loop that has at most `most_edges` edges."""
    table = edge_table(mesh)
    edges, face_of = table.edges, _faces_on_boundary(mesh, table)
    graph = sp.csr_array((np.ones(len(edges), dtype=bool), edges.T), shape=(mesh.n_vertices,) * 2)
    graph, n_long, n_open = (graph + graph.T).tocsr(), 0, 0
    added: list[Int[np.ndarray, "_ 3"]] = []
    for loop in boundary_loops(mesh):
        ahead = zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
        behind = {face_of.get(side) for side in ahead}
        # None means that the chain is not closed. The boundary of a single face would be closed by
        # that face itself, turned over.
        if len(loop) < 3 or None in behind or len(behind) == 1:
            n_open += 1
        elif len(loop) > most_edges:
            n_long += 1
        else:
            points, _ = size_one(mesh.vertices[loop] - mesh.vertices[loop[0]])
            triangles = np.empty((len(loop) - 2, 3), dtype=np.int64)
            good = triangulate(points, _mark_existing_edges(graph, loop, added), triangles)
            added += [loop[triangles]] if good else []
            n_open += not good
    return Fillings(tuple(added), n_long, n_open)


def _faces_on_boundary(mesh: TriangleMesh, table: EdgeTable) -> dict[tuple[int, int], int]:
    """Map each boundary edge, as a pair of vertices directed as in its face, to that face."""
    places = np.flatnonzero(table.n_faces[table.face_edges.T.ravel()] == 1)
    sides = map(tuple, half_edges(mesh)[places].tolist())
    return dict(zip(sides, (places % mesh.n_faces).tolist(), strict=True))


def _mark_existing_edges(
    graph: sp.csr_array, loop: Int[np.ndarray, " k"], added: list[Int[np.ndarray, "_ 3"]]
) -> Bool[np.ndarray, "k k"]:
    """Mark the pairs of loop vertices that are edges already, of the mesh or of added faces."""
    taken = np.array(graph[loop][:, loop].toarray(), dtype=bool)
    if added:
        faces = np.concatenate(added)
        places = {vertex: place for place, vertex in enumerate(loop.tolist())}
        drawn = np.concatenate([faces[:, :2], faces[:, 1:], faces[:, ::2]])
        for one, other in drawn[np.isin(drawn, loop).all(axis=1)].tolist():
            taken[places[one], places[other]] = taken[places[other], places[one]] = True
    return taken
