"""How the triangles of a mesh hang together."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Int
from scipy.sparse.csgraph import connected_components

from eigenshape._errors import InvalidShapeError, try_auto
from eigenshape.geometry.conversion import MeshLike, as_mesh, as_simplicial
from eigenshape.geometry.facets import boundary_facets, facet_table
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh

MIXER = np.uint64(
    0x9E3779B97F4A7C15
)  # 2^64 over the golden ratio, odd: the multiplier of Fibonacci hashing


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """The edges of a mesh and the sides of its faces that lie on them.

    Attributes
    ----------
    edges : (e, 2) int
        Vertex pairs, the lower index first, in ascending order.
    face_edges : (f, 3) int
        Edge of each face opposite to its corner 0, 1, 2.
    n_faces : (e,) int
        Faces at each edge: 1 on a boundary, 2 inside, more where the mesh is not a manifold.
    """

    edges: Int[np.ndarray, "e 2"]
    face_edges: Int[np.ndarray, "f 3"]
    n_faces: Int[np.ndarray, " e"]


def edge_table(mesh: MeshLike) -> EdgeTable:
    """List the edges of the mesh once each, with the faces' way to them."""
    table = facet_table(as_mesh(mesh))
    return EdgeTable(table.facets, table.simplex_facets, table.n_simplices)


def face_pairs(table: EdgeTable) -> tuple[Int[np.ndarray, "p 2"], Int[np.ndarray, " p"]]:
    """Return the pairs of faces that share an edge, and that edge; more than two at one edge are chained."""
    at_edge = table.face_edges.ravel()
    order = np.argsort(at_edge, kind="stable")
    first = np.flatnonzero(at_edge[order][1:] == at_edge[order][:-1])
    return np.column_stack([order[first], order[first + 1]]) // 3, at_edge[order[first]]


def half_edges(mesh: TriangleMesh) -> Int[np.ndarray, "s 2"]:
    """Return the directed sides of all faces: first those opposite to corner 0, then 1, then 2."""
    a, b, c = mesh.faces.T
    return np.concatenate([np.column_stack(side) for side in ((b, c), (c, a), (a, b))])


def vertex_components(mesh: MeshLike) -> tuple[int, Int[np.ndarray, " n"]]:
    """Count the connected components and number each point with its own; a loose point is one by itself."""
    mesh = as_simplicial(mesh)
    corners = mesh.simplices
    ends = np.column_stack([np.repeat(corners[:, 0], mesh.dim), corners[:, 1:].ravel()])
    graph = sp.coo_array((np.ones(len(ends), dtype=np.int8), ends.T), shape=(mesh.n_points,) * 2)
    count, labels = connected_components(graph, directed=False)
    return int(count), labels.astype(np.int64)


def unreferenced_vertices(mesh: Mesh) -> Int[np.ndarray, " k"]:
    """Return the points that no simplex uses."""
    used = np.zeros(mesh.n_points, dtype=bool)
    used[mesh.simplices] = True
    return np.flatnonzero(~used)


def require_simplices_everywhere(mesh: Mesh) -> None:
    """Refuse a mesh with a point that no simplex uses, naming the first.

    Raises
    ------
    InvalidShapeError
        With the index, coordinates and number of such points.
    """
    loose = unreferenced_vertices(mesh)
    if loose.size:
        point, simplex = ("vertex", "face") if mesh.dim == 2 else ("point", "simplex")
        raise InvalidShapeError(
            f"Every {point} must belong to a {simplex}; {point} {loose[0]} at {mesh.points[loose[0]].tolist()} has "
            f"none ({loose.size} such). {try_auto()}"
        )


def sorted_rows(
    rows: Int[np.ndarray, "r c"],
) -> tuple[Int[np.ndarray, " r"], Int[np.ndarray, "r c"], Bool[np.ndarray, " r"]]:
    """Return the stable order that sorts rows, the sorted rows, and which of them repeat the row before."""
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    repeats = np.zeros(len(rows), dtype=bool)
    repeats[1:] = (ordered[1:] == ordered[:-1]).all(axis=1)
    return order, ordered, repeats


def repeated_simplices(mesh: Mesh) -> Int[np.ndarray, "k 2"]:
    """Return each simplex that has the corners of an earlier one, in any order, after that earlier one."""
    rows = np.sort(mesh.simplices, axis=1)
    # Different rows rarely share this number, taken modulo 2^64: to sort numbers takes a fifth of the time.
    keys = np.sort(
        rows.astype(np.uint64) @ MIXER ** np.arange(1, rows.shape[1] + 1, dtype=np.uint64)
    )
    if (keys[1:] != keys[:-1]).all():
        return np.empty((0, 2), dtype=np.int64)
    order, _, repeats = sorted_rows(rows)
    starts = np.flatnonzero(~repeats)
    firsts = order[starts][np.cumsum(~repeats) - 1]
    pairs = np.column_stack([firsts, order])[repeats]
    return pairs[np.argsort(pairs[:, 1])]


def seams(mesh: Mesh) -> Int[np.ndarray, "k 2 m"]:
    """Return pairs of sides on the boundary that lie on each other, corner by corner, with vertices of their own.

    Of several in one place each is paired with the next, so that the pairs join all of them.
    """
    facets = boundary_facets(mesh)
    used, numbers = np.unique(facets, return_inverse=True)
    # Adding 0.0 makes -0.0 equal to 0.0 also where bytes are compared.
    _, place = np.unique(mesh.points[used] + 0.0, axis=0, return_inverse=True)
    places = place.ravel()[numbers.reshape(facets.shape)]
    by_place = np.argsort(places, axis=1, kind="stable")
    facets, places = (np.take_along_axis(rows, by_place, axis=1) for rows in (facets, places))
    order, _, repeats = sorted_rows(places)
    second = np.flatnonzero(repeats)
    return np.stack([facets[order[second - 1]], facets[order[second]]], axis=1)


def boundary_vertices(mesh: MeshLike) -> Int[np.ndarray, " k"]:
    """Return the points on the boundary, ascending: the corners of `boundary_facets`."""
    mesh = as_simplicial(mesh)
    return np.unique(boundary_facets(mesh))


def boundary_edges(mesh: MeshLike) -> Int[np.ndarray, "b 2"]:
    """Return the sides that only one face has, directed as in that face."""
    mesh = as_mesh(mesh)
    table = edge_table(mesh)
    lonely = table.n_faces[table.face_edges.T.ravel()] == 1
    return half_edges(mesh)[lonely]


def boundary_loops(mesh: MeshLike) -> list[Int[np.ndarray, " k"]]:
    """Chain the boundary edges into closed loops of vertices.

    A vertex where several loops touch is passed once by each of them; the loops are sorted by length, longest
    first, then by their first vertex. Where neighbouring faces are turned against each other, or more than two share
    an edge, a chain may stay open.
    """
    mesh = as_mesh(mesh)
    sides = boundary_edges(mesh)
    leaving: dict[int, list[int]] = {}
    for start, end in sides[::-1].tolist():
        leaving.setdefault(start, []).append(end)
    loops: list[Int[np.ndarray, " k"]] = []
    for first in sorted(leaving):
        while leaving[first]:
            loops += [np.array(loop, dtype=np.int64) for loop in _walks(leaving, first)]
    return sorted(loops, key=lambda loop: (-len(loop), int(loop[0])))


def _walks(leaving: dict[int, list[int]], first: int) -> list[list[int]]:
    """Use up the sides that can be reached from a vertex, cutting a loop off wherever the way meets itself."""
    loops, path, place = [], [first], {first: 0}
    while leaving.get(path[-1]):
        end = leaving[path[-1]].pop()
        if end in place:
            loops.append(path[place[end] :])
            for vertex in path[place[end] + 1 :]:
                del place[vertex]
            del path[place[end] + 1 :]
        else:
            place[end] = len(path)
            path.append(end)
    return [*loops, path] if len(path) > 1 else loops


def non_manifold_edges(mesh: TriangleMesh) -> Int[np.ndarray, "k 2"]:
    """Return the edges with more than two faces."""
    table = edge_table(mesh)
    return table.edges[table.n_faces > 2]


def non_manifold_vertices(mesh: TriangleMesh) -> Int[np.ndarray, " k"]:
    """Return the vertices whose faces form more than one fan."""
    n_fans = np.bincount(_corner_fans(mesh)[1], minlength=mesh.n_vertices)
    return np.flatnonzero(n_fans > 1)


def _corner_fans(mesh: TriangleMesh) -> tuple[Int[np.ndarray, " c"], Int[np.ndarray, " k"]]:
    """Group the corners of the faces into fans: the fan of each corner, the vertex of each fan."""
    table, f = edge_table(mesh), mesh.n_faces
    corners = np.arange(3 * f).reshape(f, 3)
    at_edge = table.face_edges.ravel()
    order = np.argsort(at_edge, kind="stable")
    neighbours = at_edge[order][1:] == at_edge[order][:-1]
    one, two = order[:-1][neighbours], order[1:][neighbours]
    links = []
    for shift_one in (1, 2):
        for shift_two in (1, 2):
            a = corners[one // 3, (one + shift_one) % 3]
            b = corners[two // 3, (two + shift_two) % 3]
            same = mesh.faces.ravel()[a] == mesh.faces.ravel()[b]
            links.append(np.stack([a[same], b[same]]))
    pairs = np.concatenate(links, axis=1)
    graph = sp.coo_array((np.ones(pairs.shape[1], dtype=np.int8), pairs), shape=(3 * f, 3 * f))
    count, fan = connected_components(graph, directed=False)
    vertex = np.empty(count, dtype=np.int64)
    vertex[fan] = mesh.faces.ravel()
    return fan.astype(np.int64), vertex


def inconsistent_edges(mesh: TriangleMesh) -> Int[np.ndarray, "k 2"]:
    """Return the edges that two faces pass in the same direction: one of the two is turned over."""
    sides = half_edges(mesh)
    directed = np.sort(sides[:, 0] * mesh.n_vertices + sides[:, 1])
    if (
        directed[1:] != directed[:-1]
    ).all():  # the usual case, told at a third of the cost of a table
        return np.empty((0, 2), dtype=np.int64)
    forward = (sides[:, 0] < sides[:, 1]).astype(np.int64)
    table = edge_table(mesh)
    n_forward = np.bincount(table.face_edges.T.ravel(), weights=forward, minlength=len(table.edges))
    return table.edges[(table.n_faces == 2) & (n_forward != 1)]


@dataclass(frozen=True, eq=False)
class FaceTurns:
    """Which faces to turn over so that neighbors agree.

    Faces are neighbors at an edge that has no third face; patches are what hangs together by neighbors.

    Attributes
    ----------
    turned : (f,) bool
        In each patch the fewer of its faces; of equally many those that disagree with the first. None in a patch that
        cannot be oriented, such as a Möbius strip.
    patches : (f,) int
        The patch of each face; numbers need not follow one another.
    orientable : (f,) bool
        Whether the patch of each face can be oriented.
    """

    turned: Bool[np.ndarray, " f"]
    patches: Int[np.ndarray, " f"]
    orientable: Bool[np.ndarray, " f"]


def face_turns(mesh: TriangleMesh) -> FaceTurns:
    """Find which faces to turn over so that neighbors agree.

    Each face has two sides. Sides of neighbors that look the same way are linked; a patch can be oriented if and only
    if no chain of links leads from one side of a face to the other (the orientation double cover).
    """
    table, f = edge_table(mesh), mesh.n_faces
    at_edge = table.face_edges.ravel()
    order = np.argsort(at_edge, kind="stable")
    one, two = order[table.n_faces[at_edge[order]] == 2].reshape(-1, 2).T
    sides = half_edges(mesh).reshape(3, f, 2).transpose(1, 0, 2).reshape(-1, 2)
    opposed = sides[one, 0] == sides[two, 1]
    one, two = one // 3, two // 3
    front, back = np.where(opposed, two, two + f), np.where(opposed, two + f, two)
    ends = (np.concatenate([one, one + f]), np.concatenate([front, back]))
    links = sp.coo_array((np.ones(len(ends[0]), dtype=np.int8), ends), shape=(2 * f, 2 * f))
    count, labels = connected_components(links, directed=False)
    as_is, over = labels[:f].astype(np.int64), labels[f:].astype(np.int64)
    # Components are numbered by their first side, so that of two halves the lower has the first face as it is.
    n_kept = np.bincount(as_is, minlength=count)
    turned = np.where(n_kept[as_is] == n_kept[over], as_is > over, n_kept[as_is] < n_kept[over])
    return FaceTurns(turned, np.minimum(as_is, over), as_is != over)


def with_turned_faces(mesh: TriangleMesh, turned: Bool[np.ndarray, " f"]) -> TriangleMesh:
    """Return the mesh with some faces turned over; itself where there are none."""
    if not turned.any():
        return mesh
    return TriangleMesh(mesh.vertices, np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces))


def agreeing(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh with faces turned so that neighbors agree; itself where they do."""
    if not len(inconsistent_edges(mesh)):
        return mesh
    return with_turned_faces(mesh, face_turns(mesh).turned)


def euler_characteristic(mesh: MeshLike) -> int:
    """Return V - E + F, over the vertices that faces use."""
    mesh = as_mesh(mesh)
    n_used = mesh.n_vertices - len(unreferenced_vertices(mesh))
    return n_used - len(edge_table(mesh).edges) + mesh.n_faces


def is_closed(mesh: MeshLike) -> bool:
    """Say whether every edge has exactly two faces."""
    mesh = as_mesh(mesh)
    return bool((edge_table(mesh).n_faces == 2).all())


def is_manifold(mesh: MeshLike) -> bool:
    """Say whether every edge has at most two faces and every vertex one fan."""
    mesh = as_mesh(mesh)
    return not len(non_manifold_edges(mesh)) and not len(non_manifold_vertices(mesh))


def submesh(
    mesh: TriangleMesh, keep_faces: Bool[np.ndarray, " f"]
) -> tuple[TriangleMesh, Int[np.ndarray, " k"]]:
    """Keep some faces and the vertices they use: the smaller mesh, and the old index of each of its vertices."""
    faces = mesh.faces[keep_faces]
    vertices, renumbered = np.unique(faces, return_inverse=True)
    return TriangleMesh(mesh.vertices[vertices], renumbered.reshape(-1, 3)), vertices
