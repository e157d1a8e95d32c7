"""Betti numbers of surfaces and solids."""

import numpy as np

from eigenshape._corners import edges_of
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.face_turns import face_turns
from eigenshape.geometry.facets import boundary_facets, boundary_surface, facet_table
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import (
    is_manifold,
    require_simplices_everywhere,
    vertex_components,
)


def betti_numbers(mesh: MeshLike) -> tuple[int, ...]:
    """Count the independent cycles of a surface or a solid in each dimension.

    β_0 counts components; β_1 loops that bound nothing: 2 for each handle of a closed surface, and
    one less than the number of boundary loops more; β_2 closed oriented surfaces that enclose a
    component or, in a solid, a cavity. The alternating sum is the Euler characteristic.

    Parameters
    ----------
    mesh : MeshLike
        A manifold of triangles, or of tetrahedra in R³ whose boundary is a manifold.

    Returns
    -------
    tuple of int
        β_0, β_1, β_2, and β_3 = 0 for tetrahedra.

    Raises
    ------
    InvalidShapeError
        If the mesh is of another dimension, no manifold, or a point has no simplex.

    See Also
    --------
    euler_characteristic : Their alternating sum.
    es.calculus.decompose_field : Whose harmonic part has β_1 dimensions.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.betti_numbers(es.shapes.torus(8, 6))
    (1, 2, 1)
    >>> es.geometry.betti_numbers(es.shapes.box(2, 2, 2))
    (1, 0, 0, 0)
    """
    mesh = as_simplicial(mesh)
    if mesh.dim not in (2, 3) or (mesh.dim == 3 and mesh.points.shape[1] != 3):
        raise InvalidShapeError(
            f"Betti numbers need triangles, or tetrahedra in R^3; the mesh is a {mesh!r}."
        )
    require_simplices_everywhere(mesh)
    if isinstance(mesh, TriangleMesh):
        surface = mesh
    elif mesh.dim == 2:  # the same triangles; coordinates do not matter
        surface = TriangleMesh(np.zeros((mesh.n_points, 3)), mesh.simplices)
    else:
        surface = boundary_surface(mesh)
    if not is_manifold(surface):
        noun = "surface" if mesh.dim == 2 else "boundary of the solid"
        raise InvalidShapeError(
            f"Betti numbers need a manifold; the {noun} has an edge of more than two faces, or a "
            "vertex with more than one fan of faces."
        )
    n_components, _ = vertex_components(mesh)
    characteristic = mesh.n_points - len(edges_of(mesh)) + len(mesh.simplices)
    if mesh.dim == 2:
        # Components that have no boundary and two sides
        _, labels = vertex_components(surface)
        closed = np.ones(n_components, dtype=bool)
        closed[labels[boundary_facets(surface)]] = False
        closed[labels[surface.faces[~face_turns(surface).orientable]]] = False
        n_closed = int(closed.sum())
        return n_components, n_components + n_closed - characteristic, n_closed
    characteristic += len(facet_table(mesh).facets) - 2 * len(mesh.simplices)
    # All but the outermost sheet of the boundary of each component surround a cavity.
    n_cavities = vertex_components(surface)[0] - n_components
    return n_components, n_components + n_cavities - characteristic, n_cavities, 0
