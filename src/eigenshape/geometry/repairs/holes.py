"""The repair of holes: their triangulation between the vertices around them."""

import numpy as np
from jaxtyping import Int

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import count_nouns
from eigenshape._vectors import size_one
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.hole_loops import triangulate
from eigenshape.geometry.repairs.repair_report import RepairedMesh
from eigenshape.geometry.topology import boundary_loops, edge_table, half_edges, neighbor_links


def fill_holes(mesh: TriangleMesh, *, most_edges: int = 1000) -> RepairedMesh[TriangleMesh]:
    """Fill every hole with faces between the vertices around it; no vertex is added.

    An open surface is closed along its boundary, too. A hole is left open, and the report says so, if it
    has too many edges, or if filling it would need a face without area, a face that exists already,
    or an edge with three faces.

    Each boundary loop gets the triangulation with the least sum of areas (Barequet and Sharir,
    "Filling gaps in the boundary of a polyhedron", 1995), plus a small multiple of the squared
    sides, which avoids slivers. Raises an error
    if `most_edges` is less than 3.
    """
    if most_edges < 3:
        raise InvalidParameterError(
            f"most_edges must be at least 3, the edges of a triangle; it is {most_edges}."
        )
    table = edge_table(mesh)
    graph, n_long, n_open = neighbor_links(mesh), 0, 0
    # The face of each boundary edge, as a pair of vertices directed as in the face
    places = np.flatnonzero(table.n_faces[table.face_edges.T.ravel()] == 1)
    sides = map(tuple, half_edges(mesh)[places].tolist())
    face_of = dict(zip(sides, (places % mesh.n_faces).tolist(), strict=True))
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
            # An edge of the mesh, or of faces that were added, must not become one of another face.
            taken = np.array(graph[loop][:, loop].toarray(), dtype=bool)
            if added:
                faces = np.concatenate(added)
                drawn = np.concatenate([faces[:, :2], faces[:, 1:], faces[:, ::2]])
                drawn = drawn[np.isin(drawn, loop).all(axis=1)]
                here, there = (drawn[:, :, None] == loop).argmax(axis=2).T
                taken[here, there] = taken[there, here] = True
            triangles = triangulate(points, taken)
            added += [loop[triangles]] if len(triangles) else []
            n_open += not len(triangles)
    sealed = TriangleMesh(mesh.vertices, np.concatenate([mesh.faces, *added]))
    n_faces = sealed.n_faces - mesh.n_faces
    report = (
        f"fill_holes closed {count_nouns(len(added), 'hole')} with {count_nouns(n_faces, 'face')}"
    )
    if n_long:
        report += f", left {n_long} of more than {most_edges} edges"
    if n_open:
        report += f", left {n_open} that good faces do not close"
    return RepairedMesh(sealed, (report,), np.arange(mesh.n_vertices))
