"""Whether the faces of a mesh are turned alike, and which to turn over so that they are."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Int
from scipy.sparse.csgraph import connected_components

from certeig.kit.arrays import record
from eigenshape._corners import half_edges, shared_facets
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table


def inconsistent_edges(mesh: TriangleMesh) -> Int[np.ndarray, "k 2"]:
    """Return the edges that two faces traverse in the same direction.

    One of the two faces is turned over.
    """
    sides = half_edges(mesh.faces)
    directed = np.sort(sides[:, 0] * mesh.n_vertices + sides[:, 1])
    # The usual case; this check takes a third of the time of an edge table.
    if (directed[1:] != directed[:-1]).all():
        return np.empty((0, 2), dtype=np.int64)
    forward = (sides[:, 0] < sides[:, 1]).astype(np.int64)
    table = edge_table(mesh)
    n_forward = np.bincount(table.face_edges.T.ravel(), weights=forward, minlength=len(table.edges))
    return table.edges[(table.n_faces == 2) & (n_forward != 1)]


@record
class FaceTurns:
    """Which faces to turn over so that neighbors agree.

    Two faces are neighbors if they share an edge that has no third face. A patch is a set of faces
    connected through neighbors.

    Attributes
    ----------
    turned : (f,) bool
        Whether to turn each face over. In each patch the smaller group is turned, or of equal
        groups the one without the first face. Nothing is turned in a patch that cannot be oriented,
        such as a Möbius strip.
    patches : (f,) int
        The patch of each face; the numbers have gaps.
    orientable : (f,) bool
        Whether the patch of each face can be oriented.
    """

    turned: Bool[np.ndarray, " f"]
    patches: Int[np.ndarray, " f"]
    orientable: Bool[np.ndarray, " f"]


def face_turns(mesh: TriangleMesh) -> FaceTurns:
    """Find which faces to turn over so that neighbors agree.

    The method is the orientation double cover: each face has two sides, and sides of neighbors that
    look the same way are linked. A patch can be oriented if and only if no chain of links leads
    from one side of a face to its other side.
    """
    f = mesh.n_faces
    count, labels = connected_components(double_cover(mesh), directed=False)
    as_is, over = labels[:f].astype(np.int64), labels[f:].astype(np.int64)
    # Components are numbered in the order of their first side, so of the two halves of a patch the
    # one with the lower number contains the first face unturned.
    n_kept = np.bincount(as_is, minlength=count)
    turned = np.where(n_kept[as_is] == n_kept[over], as_is > over, n_kept[as_is] < n_kept[over])
    return FaceTurns(turned, np.minimum(as_is, over), as_is != over)


@record
class Neighbors:
    """Pairs of faces that share an edge without a third face.

    Attributes
    ----------
    edges : (k,) int
        The edge of each pair.
    one, two : (k,) int
        The two faces.
    agree : (k,) bool
        Whether they traverse the edge in opposite directions, as faces that are turned alike do.
    """

    edges: Int[np.ndarray, " k"]
    one: Int[np.ndarray, " k"]
    two: Int[np.ndarray, " k"]
    agree: Bool[np.ndarray, " k"]


def face_neighbors(mesh: TriangleMesh) -> Neighbors:
    """List the pairs of neighboring faces."""
    table = edge_table(mesh)
    at_edge = table.face_edges.ravel()
    one, two = shared_facets(table.face_edges)
    is_pair = table.n_faces[at_edge[one]] == 2
    one, two = one[is_pair], two[is_pair]
    sides = half_edges(mesh.faces).reshape(3, mesh.n_faces, 2).transpose(1, 0, 2).reshape(-1, 2)
    return Neighbors(at_edge[one], one // 3, two // 3, sides[one, 0] == sides[two, 1])


def double_cover(mesh: TriangleMesh) -> sp.coo_array:
    """Link the sides of neighboring faces that look the same way; face i has the sides i and f + i."""
    pairs, f = face_neighbors(mesh), mesh.n_faces
    front = np.where(pairs.agree, pairs.two, pairs.two + f)
    back = np.where(pairs.agree, pairs.two + f, pairs.two)
    ends = (np.concatenate([pairs.one, pairs.one + f]), np.concatenate([front, back]))
    return sp.coo_array((np.ones(len(ends[0]), dtype=np.int8), ends), shape=(2 * f, 2 * f))


def turn_faces(mesh: TriangleMesh, turned: Bool[np.ndarray, " f"]) -> TriangleMesh:
    """Return the mesh with some faces turned over; the mesh itself if there are none."""
    if not turned.any():
        return mesh
    return TriangleMesh(mesh.vertices, np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces))


def orient_consistently(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh with faces turned so that neighbors agree; the mesh itself if they do."""
    if not len(inconsistent_edges(mesh)):
        return mesh
    return turn_faces(mesh, face_turns(mesh).turned)
