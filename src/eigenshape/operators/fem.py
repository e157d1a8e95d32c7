"""Quadratic and cubic finite elements, on simplices of any dimension."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import whole_number
from certeig.kit.typing import Integer
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.facets import boundary_facets
from eigenshape.geometry.requirements import require_sound, warn_of_seams
from eigenshape.geometry.simplicial import Mesh
from eigenshape.geometry.topology import require_simplices_everywhere
from eigenshape.operators import elements
from eigenshape.operators.laplacian import Laplacian, with_mass_floor

HIGHEST = 3  # order of elements; the tests fit the convergence of orders 1 to 3


def fem_laplacian(mesh: MeshLike, order: Integer = 2) -> Laplacian:
    """Build the finite-element Laplacian with Lagrange elements of order 1, 2 or 3.

    On flat domains with smooth eigenfunctions the eigenvalues converge with twice the order of the
    elements (Strang and Fix 1973): 4 for order 2, and 6 for order 3. On a mesh that approximates a
    curved surface the error of the mesh itself has order 2.

    Parameters
    ----------
    mesh : MeshLike
    order : int
        1, 2 or 3.

    Returns
    -------
    Laplacian
        On the nodes of `fem_nodes`, of which the first are the points of the mesh. W in
        length^(m-2), B, the full mass matrix, in length^m.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume or the same corners as another, a point belongs to no simplex, or
        floats cannot hold these powers of lengths.
    InvalidParameterError
        If the order is not in 1..3.

    Examples
    --------
    The first eigenvalue of the unit square with fixed boundary is 2π² = 19.7392...:

    >>> import eigenshape as es
    >>> square = es.shapes.grid(8, 8)
    >>> laplacian = es.operators.fem_laplacian(square, order=3)
    >>> boundary = es.operators.fem_boundary_nodes(square, order=3)
    >>> es.solve_spectrum(laplacian, 1, fixed=boundary).eigenvalues.round(3).tolist()
    [19.739]
    """
    mesh = as_simplicial(mesh)
    degree = whole_number(order, "order", 1, HIGHEST)
    require_sound(mesh)
    warn_of_seams(mesh)
    _, nodes = elements.number_nodes(mesh.simplices, degree)
    products = elements.gradient_products(mesh)
    laplacian = Laplacian(
        elements.stiffness(nodes, products, degree), elements.mass(mesh, nodes, degree)
    )
    return with_mass_floor(laplacian, elements.mass_floor(mesh.dim, degree))


def fem_nodes(mesh: MeshLike, order: Integer = 2) -> Float[np.ndarray, "nodes d"]:
    """Return the positions of the nodes of `fem_laplacian`.

    The first nodes are the points of the mesh, followed by nodes on edges, then in faces.

    Parameters
    ----------
    mesh : MeshLike
    order : int
        1, 2 or 3.

    Returns
    -------
    (nodes, d) float
        In length.

    Raises
    ------
    InvalidShapeError
        If a point belongs to no simplex.
    InvalidParameterError
        If the order is not in 1..3.

    Examples
    --------
    >>> import eigenshape as es
    >>> triangle = es.TriangleMesh([[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    >>> es.operators.fem_nodes(triangle, 2)[3:, :2].tolist()
    [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
    """
    mesh = as_simplicial(mesh)
    return mesh.points[_names(mesh, order)].mean(axis=1)


def fem_boundary_nodes(mesh: MeshLike, order: Integer = 2) -> Int[np.ndarray, " b"]:
    """Return the nodes of `fem_laplacian` on the boundary, which the Dirichlet condition fixes.

    Parameters
    ----------
    mesh : MeshLike
    order : int
        1, 2 or 3.

    Returns
    -------
    (b,) int
        Ascending; empty for a closed mesh.

    Raises
    ------
    InvalidShapeError
        If a point belongs to no simplex.
    InvalidParameterError
        If the order is not in 1..3.

    See Also
    --------
    fem_laplacian : Build the operator.

    Examples
    --------
    The first eigenvalue of the unit square with a fixed boundary is 2π²:

    >>> import eigenshape as es
    >>> square = es.shapes.grid(8, 8)
    >>> boundary = es.operators.fem_boundary_nodes(square, order=3)
    >>> laplacian = es.operators.fem_laplacian(square, order=3)
    >>> drum = es.solve_spectrum(laplacian, 1, fixed=boundary)
    >>> (drum.eigenvalues / 3.14159265**2).round(4).tolist()
    [2.0]
    """
    mesh = as_simplicial(mesh)
    names = _names(mesh, order)
    facets = boundary_facets(mesh)
    if not len(facets):
        return np.empty(0, dtype=np.int64)
    on_facets, _ = elements.number_nodes(facets, names.shape[1])
    both, counts = np.unique(np.concatenate([names, on_facets]), axis=0, return_counts=True)
    wanted = {tuple(row) for row in both[counts == 2].tolist()}
    return np.flatnonzero([tuple(row) in wanted for row in names.tolist()])


def _names(mesh: Mesh, order: Integer) -> Int[np.ndarray, "nodes order"]:
    degree = whole_number(order, "order", 1, HIGHEST)
    require_simplices_everywhere(mesh)
    return elements.number_nodes(mesh.simplices, degree)[0]
