"""Values carried between points and simplices by averages."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from eigenshape._arrays import real_numbers, require_finite_rows
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.requirements import require_sound
from eigenshape.geometry.simplices import simplex_volumes


def average_onto_simplices(mesh: MeshLike, values: ArrayLike) -> Float[np.ndarray, "s ..."]:
    """Average values at points over the corners of each simplex.

    The mean over the corners is the value at the middle of a piecewise linear function, and its
    mean over the simplex.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension.
    values : (n, ...) float
        Numbers, vectors or tensors at the points.

    Returns
    -------
    (s, ...) float

    Raises
    ------
    InvalidParameterError
        If `values` does not have one row per point, or a number is not finite.

    See Also
    --------
    es.calculus.average_onto_points : The other way.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.calculus.average_onto_simplices(es.shapes.grid(1, 1), [0, 3, 6, 9]).tolist()
    [5.0, 4.0]
    """
    mesh = as_simplicial(mesh)
    rows = _rows(values, mesh.n_points, "point")
    return rows[mesh.simplices].mean(axis=1)


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

    See Also
    --------
    es.calculus.average_onto_simplices : The other way.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.calculus.average_onto_points(es.shapes.grid(1, 1), [2.0, 4.0]).round(12).tolist()
    [3.0, 4.0, 2.0, 3.0]
    """
    mesh = as_simplicial(mesh)
    rows = _rows(values, len(mesh.simplices), "simplex")
    require_sound(mesh)
    volumes = simplex_volumes(mesh)
    at = np.repeat(np.arange(len(volumes)), mesh.simplices.shape[1])
    weights = sp.csr_array(
        (volumes[at], (mesh.simplices.ravel(), at)), shape=(mesh.n_points, len(volumes))
    )
    sums = weights @ rows.reshape(len(rows), -1)
    return (sums / weights.sum(axis=1)[:, None]).reshape(mesh.n_points, *rows.shape[1:])


def _rows(values: ArrayLike, count: int, noun: str) -> Float[np.ndarray, "r ..."]:
    rows = real_numbers(values, "values").astype(np.float64)
    if rows.ndim == 0 or len(rows) != count:
        raise InvalidParameterError(
            f"values must have one row per {noun}, {count} rows; the shape is {rows.shape}."
        )
    require_finite_rows(rows, "values", noun)
    return rows
