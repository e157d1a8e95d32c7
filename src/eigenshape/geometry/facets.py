"""The facets of a mesh, and the components that are connected through facets."""

import numpy as np
from jaxtyping import Bool, Int

from eigenshape._arrays import label_components
from eigenshape._corners import shared_facets
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import area_vectors, row_dots, size_one
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.facet_lists import FacetTable
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh, SimplicialMesh


def facet_table(mesh: MeshLike) -> FacetTable:
    """List the facets of a mesh without duplicates, and the facets of each simplex.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension.

    Returns
    -------
    FacetTable

    See Also
    --------
    edge_table : The same for triangle meshes, where facets are called edges.
    boundary_surface : The facets on the boundary of tetrahedra, as a triangle mesh.

    Examples
    --------
    Two tetrahedra with a triangle in common have seven facets.

    >>> import eigenshape as es
    >>> points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]]
    >>> mesh = es.SimplicialMesh(points, [[0, 1, 2, 3], [0, 1, 2, 4]])
    >>> table = es.geometry.facet_table(mesh)
    >>> len(table.facets), table.facets[table.n_simplices == 2].tolist()
    (7, [[0, 1, 2]])
    """
    return as_simplicial(mesh).facets


def boundary_facets(mesh: Mesh) -> Int[np.ndarray, "b m"]:
    """Return the corners of the facets that belong to one simplex only, in lexicographic order."""
    table = facet_table(mesh)
    return table.facets[table.boundary]


def boundary_surface(mesh: MeshLike) -> TriangleMesh:
    """Return the boundary surface of a mesh of tetrahedra, facing outward.

    Parameters
    ----------
    mesh : MeshLike
        Tetrahedra in R³.

    Returns
    -------
    TriangleMesh
        The triangles that belong to one tetrahedron only. Points inside the mesh are left out; the
        others keep their order, so vertex i is point `boundary_vertices(mesh)[i]` of the solid.

    Raises
    ------
    InvalidShapeError
        If the mesh does not consist of tetrahedra in R³.

    See Also
    --------
    facet_table : All facets of a mesh, also inside.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.boundary_surface(es.shapes.box(2, 2, 2))
    TriangleMesh(26 vertices, 48 faces)
    """
    solid = as_simplicial(mesh)
    if (solid.dim, solid.points.shape[1]) != (3, 3):
        raise InvalidShapeError(
            f"boundary_surface must be given tetrahedra in R^3; the mesh is a {solid!r}."
        )
    table = facet_table(solid)
    owner, apex = np.nonzero(table.n_simplices[table.simplex_facets] == 1)
    triangles = table.facets[table.simplex_facets[owner, apex]]
    points, _ = size_one(solid.points)
    towards_apex = points[solid.simplices[owner, apex]] - points[triangles[:, 0]]
    inward = row_dots(area_vectors(points[triangles]), towards_apex) > 0
    triangles[inward] = triangles[inward][:, ::-1]
    used, renumbered = np.unique(triangles, return_inverse=True)
    return TriangleMesh(solid.points[used], renumbered.reshape(-1, 3))


def facet_components(table: FacetTable) -> tuple[int, Int[np.ndarray, " s"]]:
    """Count the components that are connected through facets, and return that of each simplex.

    Components that touch in less than a facet, such as two triangles with one vertex in common, are
    separate: no heat flows through there.
    """
    n, corners = table.simplex_facets.shape
    one, two = shared_facets(table.simplex_facets)
    return label_components(n, one // corners, two // corners)


def corner_fans(
    mesh: Mesh, joining: Bool[np.ndarray, " p"] | None = None
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " c"]]:
    """Group the corners of simplices into fans; return the point of each fan, and each corner's fan.

    A fan consists of simplices at one point that are connected through facets at that point.
    `joining` says which pairs of `shared_facets` connect; all do if it is None.
    """
    # For each corner of each simplex the other corners, sorted by their points
    corners = np.arange(mesh.dim + 1)
    others = np.array([np.delete(corners, corner) for corner in corners])
    order = np.argsort(mesh.simplices[:, others], axis=2)
    facets = np.take_along_axis(np.broadcast_to(others, order.shape), order, axis=2)
    n, n_corners = mesh.simplices.shape
    ids = (np.arange(n)[:, None, None] * n_corners + facets).reshape(-1, mesh.dim)
    # So the corners of a facet stand in one order on both of its sides.
    one, two = shared_facets(facet_table(mesh).simplex_facets)
    if joining is not None:
        one, two = one[joining], two[joining]
    count, fans = label_components(n * n_corners, ids[one].ravel(), ids[two].ravel())
    points = np.empty(count, dtype=np.int64)
    points[fans] = mesh.simplices.ravel()
    return points, fans


def without_pinches(mesh: Mesh) -> SimplicialMesh:
    """Split each point whose simplices are not connected through facets at that point.

    Each connected group of its simplices gets a copy of the point. So continuous functions on the
    new mesh are continuous across facets of the old one and may jump where simplices touch in less
    than a facet. Simplices keep their order, copies take the place of their point in the order of
    points, and points without simplices are removed.
    """
    points, fans = corner_fans(mesh)
    order = np.argsort(points, kind="stable")
    places = np.argsort(order)
    return SimplicialMesh(mesh.points[points[order]], places[fans].reshape(mesh.simplices.shape))
