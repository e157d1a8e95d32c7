"""Connectivity of meshes: edges, boundaries, components, manifoldness, parts and unions."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Int

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from eigenshape._arrays import adjacency_matrix, label_components, number_places, sorted_rows
from eigenshape._corners import half_edges, shared_facets
from eigenshape._errors import InvalidShapeError, try_auto
from eigenshape.geometry.conversion import MeshLike, as_mesh, as_simplicial
from eigenshape.geometry.facets import boundary_facets, corner_fans, facet_table
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh

# Multiplier of Fibonacci hashing: 2^64 divided by the golden ratio, rounded to an odd number.
HASH_MULTIPLIER = np.uint64(0x9E3779B97F4A7C15)


@record
class EdgeTable(ReadOnly):
    """The edges of a triangle mesh without duplicates, and the edges of each face.

    This is the `FacetTable` of a triangle mesh, under the names used for surfaces.

    Attributes
    ----------
    edges : (e, 2) int
        Vertices of each edge, the lower index first; the edges are in lexicographic order.
    face_edges : (f, 3) int
        Edge of each face opposite to its corner 0, 1, 2.
    n_faces : (e,) int
        Number of faces at each edge: 1 on the boundary, 2 inside, more where the mesh is not a
        manifold.

    Examples
    --------
    A square of two triangles has one edge inside:

    >>> import eigenshape as es
    >>> table = es.geometry.edge_table(es.shapes.grid(1, 1))
    >>> table.edges[table.n_faces == 2]
    array([[0, 3]])
    """

    edges: Int[np.ndarray, "e 2"]
    face_edges: Int[np.ndarray, "f 3"]
    n_faces: Int[np.ndarray, " e"]

    @property
    def face_pairs(self) -> tuple[Int[np.ndarray, "p 2"], Int[np.ndarray, " p"]]:
        """Pairs (p, 2) of faces that share an edge, and the edge (p,) of each.

        More than two faces at one edge give the pairs of a chain through all of them.
        """
        one, two = shared_facets(self.face_edges)
        return np.column_stack([one, two]) // 3, self.face_edges.ravel()[one]


def edge_table(mesh: MeshLike) -> EdgeTable:
    """List the edges of a triangle mesh without duplicates, and the edges of each face.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    EdgeTable

    See Also
    --------
    facet_table : The same for meshes of any dimension.
    edge_lengths : The length of each edge.

    Examples
    --------
    >>> import eigenshape as es
    >>> table = es.geometry.edge_table(es.shapes.grid(1, 1))
    >>> table.edges.tolist()
    [[0, 1], [0, 2], [0, 3], [1, 3], [2, 3]]
    >>> table.n_faces.tolist()
    [1, 1, 2, 1, 1]
    """
    table = facet_table(as_mesh(mesh))
    return EdgeTable(table.facets, table.simplex_facets, table.n_simplices)


def neighbor_links(mesh: TriangleMesh) -> sp.csr_array:
    """Return the symmetric matrix with a 1 for each two vertices that an edge connects."""
    edges = edge_table(mesh).edges
    return adjacency_matrix(edges, np.ones(len(edges)), mesh.n_vertices)


def vertex_components(mesh: MeshLike) -> tuple[int, Int[np.ndarray, " n"]]:
    """Find the connected components of a mesh.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension.

    Returns
    -------
    n_components : int
        Number of components. A point without simplices is a component by itself.
    labels : (n,) int
        Component of each point.

    See Also
    --------
    repair : "largest_component" keeps the component with the largest area.

    Examples
    --------
    >>> import eigenshape as es
    >>> two = es.geometry.disjoint_union(es.shapes.grid(1, 1), es.shapes.grid(1, 1))
    >>> n_components, labels = es.geometry.vertex_components(two)
    >>> n_components, labels.tolist()
    (2, [0, 0, 0, 0, 1, 1, 1, 1])
    """
    mesh = as_simplicial(mesh)
    # A simplex is connected if its first corner is linked to each other one.
    first, others = mesh.simplices[:, 0], mesh.simplices[:, 1:]
    return label_components(mesh.n_points, np.repeat(first, mesh.dim), others.ravel())


def unreferenced_vertices(mesh: Mesh) -> Int[np.ndarray, " k"]:
    """Return the points that no simplex uses."""
    used = np.zeros(mesh.n_points, dtype=bool)
    used[mesh.simplices] = True
    return np.flatnonzero(~used)


def require_simplices_everywhere(mesh: Mesh) -> None:
    """Raise an error if a point has no simplex."""
    loose = unreferenced_vertices(mesh)
    if loose.size:
        point, simplex = ("vertex", "face") if mesh.dim == 2 else ("point", "simplex")
        raise InvalidShapeError(
            f"Every {point} must belong to a {simplex}; {point} {loose[0]} "
            f"at {mesh.points[loose[0]].tolist()} has none ({loose.size} such). {try_auto()}"
        )


def repeated_simplices(mesh: Mesh) -> Int[np.ndarray, "k 2"]:
    """Return pairs of simplices with the same corners in any order: the first one, and a later one.

    The pairs are in the order of the later ones.
    """
    rows = np.sort(mesh.simplices, axis=1)
    # Most meshes have no repeats. Sorting one hash per row, modulo 2^64, shows this in a fifth of
    # the time that sorting the rows takes.
    keys = np.sort(
        rows.astype(np.uint64) @ HASH_MULTIPLIER ** np.arange(1, rows.shape[1] + 1, dtype=np.uint64)
    )
    if (keys[1:] != keys[:-1]).all():
        return np.empty((0, 2), dtype=np.int64)
    order, _, repeats = sorted_rows(rows)
    starts = np.flatnonzero(~repeats)
    firsts = order[starts][np.cumsum(~repeats) - 1]
    pairs = np.column_stack([firsts, order])[repeats]
    return pairs[np.argsort(pairs[:, 1])]


def join_places(mesh: TriangleMesh) -> tuple[TriangleMesh, Int[np.ndarray, " n"]]:
    """Return a mesh with one vertex at each place and the same faces, and the new number of each vertex."""
    numbers = number_places(mesh.vertices)
    firsts = np.unique(numbers, return_index=True)[1]
    return TriangleMesh(mesh.vertices[firsts], numbers[mesh.faces]), numbers


def boundary_vertices(mesh: MeshLike) -> Int[np.ndarray, " k"]:
    """Return the points on the boundary of a mesh.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension.

    Returns
    -------
    (k,) int
        The corners of all facets that belong to one simplex only, ascending.

    See Also
    --------
    boundary_edges, boundary_loops

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.boundary_vertices(es.shapes.grid(2, 2)).tolist()
    [0, 1, 2, 3, 5, 6, 7, 8]
    """
    mesh = as_simplicial(mesh)
    return np.unique(boundary_facets(mesh))


def boundary_edges(mesh: MeshLike) -> Int[np.ndarray, "b 2"]:
    """Return the edges that belong to one face only.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    (b, 2) int
        The two vertices of each edge, in the direction of its face.

    See Also
    --------
    boundary_loops : The same edges chained into loops.
    boundary_vertices : Their vertices.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.boundary_edges(es.shapes.grid(1, 1)).tolist()
    [[2, 3], [3, 1], [1, 0], [0, 2]]
    """
    mesh = as_mesh(mesh)
    table = edge_table(mesh)
    on_boundary = table.n_faces[table.face_edges.T.ravel()] == 1
    return half_edges(mesh.faces)[on_boundary]


def boundary_loops(mesh: MeshLike) -> list[Int[np.ndarray, " k"]]:
    """Chain the boundary edges into loops of vertices.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    list of (k,) int
        The loops, the one with the most vertices first, then by their first vertex. A loop passes
        each of its vertices once; a vertex where loops touch belongs to each of them.

    See Also
    --------
    boundary_edges : The edges themselves.
    repair : "fill_holes" closes the loops with faces.

    Notes
    -----
    A chain may stay open where neighboring faces are turned against each other, or where more than
    two faces share an edge.

    Examples
    --------
    >>> import eigenshape as es
    >>> [loop.tolist() for loop in es.geometry.boundary_loops(es.shapes.grid(1, 1))]
    [[0, 2, 3, 1]]
    """
    sides = boundary_edges(mesh)
    leaving: dict[int, list[int]] = {}
    for start, end in sides[::-1].tolist():
        leaving.setdefault(start, []).append(end)
    loops: list[Int[np.ndarray, " k"]] = []
    for first in sorted(leaving):
        while leaving[first]:
            # Follow unused edges, and cut off a loop whenever the path meets itself. The last walk is
            # open if the path does not return.
            path, place = [first], {first: 0}
            while leaving.get(path[-1]):
                end = leaving[path[-1]].pop()
                if end in place:
                    loops.append(np.array(path[place[end] :], dtype=np.int64))
                    for vertex in path[place[end] + 1 :]:
                        del place[vertex]
                    del path[place[end] + 1 :]
                else:
                    place[end] = len(path)
                    path.append(end)
            loops += [np.array(path, dtype=np.int64)] if len(path) > 1 else []
    return sorted(loops, key=lambda loop: (-len(loop), int(loop[0])))


def non_manifold_edges(mesh: TriangleMesh) -> Int[np.ndarray, "k 2"]:
    """Return the edges with more than two faces."""
    table = edge_table(mesh)
    return table.edges[table.n_faces > 2]


def non_manifold_vertices(mesh: TriangleMesh) -> Int[np.ndarray, " k"]:
    """Return the vertices whose faces form more than one fan."""
    n_fans = np.bincount(corner_fans(mesh)[0], minlength=mesh.n_vertices)
    return np.flatnonzero(n_fans > 1)


def euler_characteristic(mesh: MeshLike) -> int:
    """Compute the Euler characteristic V - E + F, without vertices that have no face.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    int
        2 for a sphere, 0 for a torus, 1 for a disc.

    Examples
    --------
    >>> import eigenshape as es
    >>> [es.geometry.euler_characteristic(mesh) for mesh in (es.icosphere(1), es.shapes.torus())]
    [2, 0]
    """
    mesh = as_mesh(mesh)
    n_used = mesh.n_vertices - len(unreferenced_vertices(mesh))
    return n_used - len(edge_table(mesh).edges) + mesh.n_faces


def is_closed(mesh: MeshLike) -> bool:
    """Tell whether every edge has exactly two faces.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    bool

    See Also
    --------
    is_manifold, boundary_edges

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.is_closed(es.icosphere(1)), es.geometry.is_closed(es.shapes.grid(2, 2))
    (True, False)
    """
    return bool((edge_table(mesh).n_faces == 2).all())


def is_manifold(mesh: MeshLike) -> bool:
    """Tell whether every edge has at most two faces and every vertex a single fan of faces.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    bool
        Whether the mesh is a manifold, possibly with boundary.

    See Also
    --------
    is_closed, self_intersections

    Examples
    --------
    Two triangles with one vertex in common are not a manifold.

    >>> import eigenshape as es
    >>> points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    >>> es.geometry.is_manifold((points, [[0, 1, 2], [0, 3, 4]]))
    False
    """
    mesh = as_mesh(mesh)
    return not len(non_manifold_edges(mesh)) and not len(non_manifold_vertices(mesh))


def submesh(
    mesh: TriangleMesh, keep_faces: Bool[np.ndarray, " f"]
) -> tuple[TriangleMesh, Int[np.ndarray, " k"]]:
    """Return the mesh of some faces and their vertices, and the old index of each vertex."""
    faces = mesh.faces[keep_faces]
    vertices, renumbered = np.unique(faces, return_inverse=True)
    return TriangleMesh(mesh.vertices[vertices], renumbered.reshape(-1, 3)), vertices


def disjoint_union(*meshes: MeshLike) -> TriangleMesh:
    """Combine meshes into one mesh, in which they are separate components.

    Coordinates do not change, and no vertices are joined.

    Parameters
    ----------
    *meshes : MeshLike
        At least one mesh.

    Returns
    -------
    TriangleMesh
        The vertices and faces of the first mesh, then those of the second, and so on.

    Raises
    ------
    InvalidParameterError
        If there is no mesh.

    See Also
    --------
    repair : "weld" joins vertices at the same place.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.disjoint_union(es.icosphere(0), es.shapes.grid(1, 1))
    TriangleMesh(16 vertices, 22 faces)
    """
    if not meshes:
        raise InvalidParameterError(
            "disjoint_union must be given at least one mesh; it was given none."
        )
    parts = [as_mesh(mesh, f"meshes[{index}]") for index, mesh in enumerate(meshes)]
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in parts)])[:-1]
    faces = [mesh.faces + start for mesh, start in zip(parts, starts, strict=True)]
    return TriangleMesh(np.concatenate([mesh.vertices for mesh in parts]), np.concatenate(faces))
