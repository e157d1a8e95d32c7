"""Pieces with one side only, such as a Möbius strip, cut open so that they have two."""

import numpy as np
from jaxtyping import Bool, Int
from scipy.sparse.csgraph import dijkstra

from eigenshape._arrays import label_components
from eigenshape._errors import count_nouns
from eigenshape.geometry.face_turns import double_cover, face_neighbors, face_turns, turn_faces
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_report import RepairedMesh
from eigenshape.geometry.topology import edge_table


def cut_one_sided(mesh: TriangleMesh) -> RepairedMesh[TriangleMesh]:
    """Cut pieces with one side only, such as Möbius strips, so that their faces can be oriented.

    In each such piece, faces are turned alike outward from the first face, and edges where they
    meet turned against each other are cut. Vertices on a cut occur once for each side of it.
    """
    turns = face_turns(mesh)
    patches, roots = np.unique(turns.patches[~turns.orientable], return_index=True)
    roots = np.flatnonzero(~turns.orientable)[roots]
    turned = np.zeros(mesh.n_faces, dtype=bool)
    cut = np.zeros(len(edge_table(mesh).edges), dtype=bool)
    if len(roots):
        # Each face shows the side that fewer steps join with the front of the first face.
        cover = double_cover(mesh).tocsr()
        steps = dijkstra(cover, directed=False, indices=roots, unweighted=True, min_only=True)
        front, back = steps[: mesh.n_faces], steps[mesh.n_faces :]
        turned = ~turns.orientable & (back < front)
        pairs = face_neighbors(mesh)
        against = (turned[pairs.one] == turned[pairs.two]) != pairs.agree
        cut[pairs.edges[against & ~turns.orientable[pairs.one]]] = True
    opened = cut_edges(mesh, cut)
    n_new = opened.mesh.n_vertices - mesh.n_vertices
    report = (
        f"cut_one_sided cut {count_nouns(len(patches), 'piece')} with one side only along "
        f"{count_nouns(int(cut.sum()), 'edge')}, and added {count_nouns(n_new, 'vertex')}"
    )
    return RepairedMesh(turn_faces(opened.mesh, turned), (report,), opened.source_vertices)


def cut_edges(
    mesh: TriangleMesh, cut: Bool[np.ndarray, " e"], apart: Int[np.ndarray, " k"] | None = None
) -> RepairedMesh[TriangleMesh]:
    """Cut a mesh open along some of its edges, and at vertices `apart` where only corners touch.

    Corners of faces stay one vertex if edges that are not cut join them around it. The first such
    group of a vertex keeps its number, and the others follow after the last vertex.
    """
    table, n = edge_table(mesh), mesh.n_vertices
    vertices = mesh.faces.ravel()
    # Side k of a face, opposite to its corner k, ends at its corners k + 1 and k + 2.
    face, side = np.divmod(np.arange(len(vertices)), 3)
    ends = 3 * face[:, None] + (side[:, None] + np.array([1, 2])) % 3
    at_edge = table.face_edges.ravel()
    # Corners are linked through a node for each end of each edge, of which one lies at the vertex.
    is_second = vertices[ends] == table.edges[at_edge, 1][:, None]
    nodes = len(vertices) + 2 * at_edge[:, None] + is_second
    kept = ~cut[at_edge]
    # Other vertices stay one, also where only corners touch.
    whole = np.ones(n, dtype=bool)
    whole[table.edges[cut]] = False
    if apart is not None:
        whole[apart] = False
    corners = np.flatnonzero(whole[vertices])
    first = len(vertices) + 2 * len(cut)
    rows = np.concatenate([ends[kept].ravel(), corners])
    columns = np.concatenate([nodes[kept].ravel(), first + vertices[corners]])
    group = label_components(first + n, rows, columns)[1][: len(vertices)]
    _, first_corner, group = np.unique(group, return_index=True, return_inverse=True)
    # Groups are numbered by their first corner; all but the first of a vertex become new ones.
    owner = vertices[first_corner]
    number = owner.copy()
    further = np.delete(np.arange(len(owner)), np.unique(owner, return_index=True)[1])
    number[further] = n + np.arange(len(further))
    source = np.concatenate([np.arange(n), owner[further]])
    opened = TriangleMesh(mesh.vertices[source], number[group].reshape(-1, 3))
    return RepairedMesh(opened, (), source)
