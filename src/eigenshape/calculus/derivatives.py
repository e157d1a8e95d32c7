"""Gradient, divergence, curl and averages of functions on meshes of any dimension."""

from typing import overload

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arrays import real_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import point_functions, require_finite_rows, simplex_vectors
from eigenshape._corners import barycentric_gradients, in_length, scaled_corners, volumes_of
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import sum_rows
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.measure import face_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_oriented, require_sound
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import Mesh


@overload
def gradient(mesh: MeshLike, values: None = None) -> sp.csr_array: ...
@overload
def gradient(mesh: MeshLike, values: ArrayLike) -> Float[np.ndarray, "s d ..."]: ...
def gradient(
    mesh: MeshLike, values: ArrayLike | None = None
) -> sp.csr_array | Float[np.ndarray, "s d ..."]:
    """Compute the gradient of piecewise linear functions, one vector per simplex, or its matrix.

    ∇u = Σ_a u_a ∇λ_a over the corners a of a simplex, with λ_a its barycentric coordinates. The
    vector lies in the simplex.

    Parameters
    ----------
    mesh : MeshLike
        Triangles, tetrahedra, segments, or m-simplices in R^d.
    values : (n,) or (n, k) float, optional
        Values at the points; each column is one function. Without values the matrix is returned.

    Returns
    -------
    (s, d) or (s, d, k) float
        In units of the values per length.
    (s·d, n) sparse
        If no values are given: G, in 1/length. Row d·j + i is component i of the gradient on
        simplex j, so (G @ values).reshape(s, d) is `gradient(mesh, values)`.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume or the same corners as another, or a point belongs to no simplex.
    InvalidParameterError
        If `values` does not have one row per point, or a value is not finite.

    See Also
    --------
    es.calculus.divergence : Its adjoint, up to the sign.

    Examples
    --------
    On a cube of tetrahedra, the gradient of x - 2z:

    >>> import eigenshape as es
    >>> cube = es.shapes.box(1, 1, 1)
    >>> es.calculus.gradient(cube, cube.points @ [1, 0, -2])[0].round(12).tolist()
    [1.0, 0.0, -2.0]
    >>> es.calculus.gradient(cube).shape
    (18, 8)
    """
    mesh = as_simplicial(mesh)
    require_sound(mesh)
    gradients, _ = _gradients(mesh)
    if values is None:
        return _point_rows(mesh, gradients).T.tocsr()
    functions = point_functions(values, "values", mesh.n_points)
    return np.einsum("sad,sa...->sd...", gradients, functions[mesh.simplices])


@overload
def divergence(mesh: MeshLike, vectors: None = None) -> sp.csr_array: ...
@overload
def divergence(mesh: MeshLike, vectors: ArrayLike) -> Float[np.ndarray, "n ..."]: ...
def divergence(
    mesh: MeshLike, vectors: ArrayLike | None = None
) -> sp.csr_array | Float[np.ndarray, "n ..."]:
    """Compute the integrated divergence of vectors on simplices, one number per point, or its matrix.

    (div X)_i = -Σ V X·∇λ_i over the simplices at point i: the weak form -∫ X·∇λ_i (Polthier and
    Preuß 2003; libigl, LaPy and geometry-central integrate likewise). It is the adjoint of
    `gradient`: div X·u = -Σ V X·∇u for all u, and -div ∇u = W u with W the stiffness of
    `cotangent_laplacian`. On a boundary this includes the flux through it, so that the sum over
    each component is 0. Divide by `dual_volumes(mesh)` for the divergence at an inner point.

    Parameters
    ----------
    mesh : MeshLike
        Triangles, tetrahedra, segments, or m-simplices in R^d.
    vectors : (s, d) or (s, d, k) float, optional
        One vector per simplex, or k of them. Parts normal to the simplex do not count. Without
        vectors the matrix is returned.

    Returns
    -------
    (n,) or (n, k) float
        In units of the vectors times length^(m-1).
    (n, s·d) sparse
        If no vectors are given: D = -Gᵀ diag(volumes), in length^(m-1), with G the matrix of
        `gradient(mesh)`. Column d·j + i takes component i of the vector on simplex j. D G = -W.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume or the same corners as another, or a point belongs to no simplex.
    InvalidParameterError
        If `vectors` does not have one vector per simplex, or a number is not finite.

    See Also
    --------
    es.calculus.gradient : Its adjoint, up to the sign.

    Examples
    --------
    The field (x, y), sampled at the middle of triangles, has divergence 2.

    >>> import eigenshape as es
    >>> square = es.shapes.grid(8, 8)
    >>> field = square.vertices[square.faces].mean(axis=1)
    >>> at_points = es.calculus.divergence(square, field) / es.geometry.dual_volumes(square)
    >>> at_points[40].round(12).item()  # the center
    2.0

    The matrices of both derivatives give the stiffness:

    >>> G, D = es.calculus.gradient(square), es.calculus.divergence(square)
    >>> bool(abs(D @ G + es.cotangent_laplacian(square).stiffness).max() < 1e-14)
    True
    """
    mesh = as_simplicial(mesh)
    require_sound(mesh)
    gradients, volumes = _gradients(mesh)
    weighted = gradients * volumes[:, None, None]
    if vectors is None:
        return _point_rows(mesh, -weighted)
    field = simplex_vectors(vectors, len(mesh.simplices), mesh.points.shape[1])
    return sum_at_nodes(
        mesh.simplices, mesh.n_points, -np.einsum("sad,sd...->sa...", weighted, field)
    )


@overload
def curl(mesh: MeshLike, vectors: None = None) -> sp.csr_array: ...
@overload
def curl(mesh: MeshLike, vectors: ArrayLike) -> Float[np.ndarray, "n ..."]: ...
def curl(
    mesh: MeshLike, vectors: ArrayLike | None = None
) -> sp.csr_array | Float[np.ndarray, "n ..."]:
    """Compute the integrated curl of vectors on triangles or tetrahedra at each point, or its matrix.

    On tetrahedra it is ∫ curl X λ_i = Σ V X × ∇λ_i over the simplices at point i, a vector. On a
    surface it is its part along the normal N, the number Σ V N·(X × ∇λ_i) (Polthier and Preuß
    2003). Half the circulation around the point is the same. On a boundary this includes the
    circulation along it, so that the sum over each component is 0. Divide by `dual_volumes(mesh)`
    for the curl at an inner point.

    Parameters
    ----------
    mesh : MeshLike
        Triangles in R³, consistently oriented; triangles in the plane, where counter-clockwise is
        positive; or tetrahedra in R³.
    vectors : (s, d) or (s, d, k) float, optional
        One vector per simplex, or k of them. Without vectors the matrix is returned.

    Returns
    -------
    (n,), (n, k), (n, 3) or (n, 3, k) float
        One number per point on a surface, one vector on tetrahedra, in units of the vectors times
        length^(m-1).
    (n, s·d) or (3n, s·d) sparse
        If no vectors are given: the matrix, in length^(m-1). Column d·j + i takes component i of
        the vector on simplex j. On tetrahedra, row 3·p + i is component i at point p.

    Raises
    ------
    InvalidShapeError
        If the mesh is neither a surface in R² or R³ nor made of tetrahedra in R³, two neighboring
        faces are turned against each other, a simplex has no volume or the same corners as another,
        or a point belongs to no simplex.
    InvalidParameterError
        If `vectors` does not have one vector per simplex, or a number is not finite.

    See Also
    --------
    es.calculus.divergence : The other derivative of a field.

    Examples
    --------
    The field (-y, x) turns at rate 1, so its curl is 2.

    >>> import eigenshape as es
    >>> square = es.shapes.grid(8, 8)
    >>> middles = square.vertices[square.faces].mean(axis=1)
    >>> field = middles[:, [1, 0, 2]] * [-1, 1, 0]
    >>> at_points = es.calculus.curl(square, field) / es.geometry.dual_volumes(square)
    >>> at_points[40].round(12).item()  # the center
    2.0
    """
    mesh = as_simplicial(mesh)
    require_sound(mesh)
    ambient = mesh.points.shape[1]
    if (mesh.dim, ambient) not in ((2, 2), (2, 3), (3, 3)):
        raise InvalidShapeError(
            f"The curl needs triangles in R^2 or R^3, or tetrahedra in R^3; the mesh is a {mesh!r}."
        )
    gradients, volumes = _gradients(mesh)
    weighted = gradients * volumes[:, None, None]
    # What the curl at each corner of each simplex takes from the vector there.
    if mesh.dim == 3:
        # Row i of the matrix of X -> X × g is e_i · (X × g) = (g × e_i) · X.
        weights = np.cross(weighted[:, :, None, :], np.eye(3))
    elif ambient == 2:
        weights = weighted[:, :, ::-1] * [1.0, -1.0]
    else:
        surface = TriangleMesh(mesh.points, mesh.simplices)
        require_oriented(surface)
        # N · (X × g) = (g × N) · X.
        weights = np.cross(weighted, face_normals(surface)[:, None, :])
    if vectors is None:
        return _point_rows(mesh, weights)
    field = simplex_vectors(vectors, len(mesh.simplices), ambient)
    rule = "sad,sd...->sa..." if weights.ndim == 3 else "said,sd...->sai..."
    return sum_at_nodes(mesh.simplices, mesh.n_points, np.einsum(rule, weights, field))


def _gradients(
    mesh: Mesh,
) -> tuple[Float[np.ndarray, "s corners d"], Float[np.ndarray, " s"]]:
    """Return the gradients of the barycentric coordinates of each simplex, and its volume."""
    corners, scale = scaled_corners(mesh)
    basis, triangles, inner = barycentric_gradients(corners)
    gradients = inner @ basis.transpose(0, 2, 1)
    volumes = in_length(volumes_of(triangles), scale, mesh.dim)
    return in_length(gradients, scale, -1), volumes


def _point_rows(mesh: Mesh, weights: Float[np.ndarray, "s corners ..."]) -> sp.csr_array:
    """Return the matrix with one row for each point, or three, and one column for each component.

    A row takes the weights of its point in all simplices, one vector or three for each.
    """
    s, corners, *_, ambient = weights.shape
    width = 1 if weights.ndim == 3 else 3
    entries = weights.reshape(s, corners, width, ambient)
    points = np.broadcast_to(mesh.simplices[:, :, None, None], entries.shape)
    rows = width * points + np.arange(width)[:, None]
    columns = ambient * np.arange(s)[:, None, None, None] + np.arange(ambient)
    places = (rows.ravel(), np.broadcast_to(columns, entries.shape).ravel())
    shape = (width * mesh.n_points, ambient * s)
    return sp.csr_array((entries.ravel(), places), shape=shape)


def sum_at_nodes(
    nodes: Int[np.ndarray, "s corners"], n: int, shares: Float[np.ndarray, "s corners ..."]
) -> Float[np.ndarray, "n ..."]:
    """Add the shares of all corners at their nodes."""
    sums = sum_rows(nodes.ravel(), shares.reshape(nodes.size, -1), n)
    return sums.reshape(n, *shares.shape[2:])


def average_onto_points(mesh: MeshLike, values: ArrayLike) -> Float[np.ndarray, "n ..."]:
    """Average values on simplices over the simplices at each point, weighted by volume.

    Integrals stay: Σ values · volumes is the sum of the averages times `dual_volumes`. Vectors on
    the faces of a curved surface lie in different planes; their average is not tangent.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension.
    values : (s, ...) float
        Numbers, vectors or tensors on the simplices.

    Returns
    -------
    (n, ...) float

    Raises
    ------
    InvalidParameterError
        If `values` does not have one row per simplex, or a number is not finite.
    InvalidShapeError
        If a simplex has no volume or the same corners as another, or a point belongs to no simplex.

    Notes
    -----
    The other way, ``values[mesh.simplices].mean(axis=1)`` is the mean of a piecewise linear function
    over each simplex.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.calculus.average_onto_points(es.shapes.grid(1, 1), [2.0, 4.0]).round(12).tolist()
    [3.0, 4.0, 2.0, 3.0]
    """
    mesh = as_simplicial(mesh)
    rows = real_numbers(values, "values").astype(np.float64)
    if rows.ndim == 0 or len(rows) != len(mesh.simplices):
        raise InvalidParameterError(
            f"values must have one row per simplex, {len(mesh.simplices)} rows; the shape is "
            f"{rows.shape}."
        )
    require_finite_rows(rows, "values", "simplex")
    require_sound(mesh)
    volumes = simplex_volumes(mesh)
    at = np.repeat(np.arange(len(volumes)), mesh.simplices.shape[1])
    weights = sp.csr_array(
        (volumes[at], (mesh.simplices.ravel(), at)), shape=(mesh.n_points, len(volumes))
    )
    sums = weights @ rows.reshape(len(rows), -1)
    return (sums / weights.sum(axis=1)[:, None]).reshape(mesh.n_points, *rows.shape[1:])
