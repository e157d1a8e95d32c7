"""A part of a surface that a mask of vertices keeps, and values on it put back on the whole."""

import warnings

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import real_numbers, whole_number, whole_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import vertex_values
from eigenshape._errors import count_nouns
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_report import RepairedMesh
from eigenshape.geometry.topology import submesh, vertex_components


def mask_surface(mesh: MeshLike, mask: ArrayLike) -> RepairedMesh[TriangleMesh]:
    """Return the part of a surface that a mask keeps, such as a cortex without its medial wall.

    A face is kept if all of its corners are. The border of the part is free in an operator that is
    built on it (the Neumann condition); `solve_spectrum(..., fixed=boundary_vertices(part.mesh))`
    holds it at zero (Dirichlet).

    Parameters
    ----------
    mesh : MeshLike
        With n vertices.
    mask : (n,) bool
        Whether a vertex is kept; numbers 1 and 0 stand for True and False.

    Returns
    -------
    RepairedMesh
        The part. `source_vertices` are its vertices in the whole surface, as `unmask` takes them;
        `report` says what was left out.

    Raises
    ------
    InvalidParameterError
        If the mask does not hold one such value per vertex, or keeps no face.

    Warns
    -----
    UserWarning
        If the mask cuts the surface into more pieces than it had.

    See Also
    --------
    es.geometry.unmask : Put values on the part back on the whole surface.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> part = es.geometry.mask_surface(ball, ball.vertices[:, 2] > 0)
    >>> part.report
    ('mask_surface left out 89 vertices of 162',)
    """
    mesh = as_mesh(mesh)
    given = vertex_values(mask, "mask", mesh.n_vertices)
    odd = np.flatnonzero((given != 0) & (given != 1))
    if odd.size:
        raise InvalidParameterError(
            f"mask must be True or False, or 1 or 0, for each vertex; that of vertex {odd[0]} is "
            f"{given[odd[0]]:g}."
        )
    keeps = given.astype(bool)
    faces = keeps[mesh.faces].all(axis=1)
    if not faces.any():
        raise InvalidParameterError(
            f"mask must keep at least one face; it keeps {keeps.sum()} of {mesh.n_vertices} vertices, "
            "and no face has all of its corners there."
        )
    part, vertices = submesh(mesh, faces)
    report = [
        f"mask_surface left out {count_nouns(mesh.n_vertices - part.n_vertices, 'vertex')} of "
        f"{mesh.n_vertices}"
    ]
    n_lonely = int(keeps.sum()) - len(vertices)
    if n_lonely:
        report.append(f"{count_nouns(n_lonely, 'vertex')} of the mask had no face there")
    n_pieces, labels = vertex_components(part)
    if n_pieces > vertex_components(mesh)[0]:
        sizes = np.sort(np.bincount(labels))[::-1]
        cut = f"the mask cuts the surface into {n_pieces} pieces, of {sizes[:5].tolist()} vertices"
        report.append(cut)
        warnings.warn(
            f"{cut}; each has an eigenvalue 0. es.repair(part.mesh, ['largest_component']) keeps the "
            "largest.",
            stacklevel=2,
        )
    return RepairedMesh(part, tuple(report), vertices)


def unmask(
    values: ArrayLike, vertices: ArrayLike, n_vertices: Integer
) -> Float[np.ndarray, "n ..."]:
    """Put values on a part of a surface back on the whole, with NaN elsewhere.

    Parameters
    ----------
    values : (m,) or (m, k) float
        Values on the vertices of the part, such as eigenvectors.
    vertices : (m,) int
        The vertices of the part in the whole surface, `RepairedMesh.source_vertices`.
    n_vertices : int
        Number of vertices n of the whole surface.

    Returns
    -------
    (n,) or (n, k) float

    Raises
    ------
    InvalidParameterError
        If `values` does not hold one row for each of `vertices`, one of these is out of range, or
        the result would not fit into memory.

    See Also
    --------
    es.geometry.mask_surface : Cut the part.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.unmask([5.0, 7.0], [0, 2], 4).tolist()
    [5.0, nan, 7.0, nan]
    """
    rows = real_numbers(values, "values").astype(np.float64)
    n = whole_number(n_vertices, "n_vertices", 0)
    places = whole_numbers(vertices, "A vertex", 0, n - 1)
    if rows.ndim not in (1, 2) or len(rows) != len(places):
        raise InvalidParameterError(
            f"values must hold one row for each of {len(places)} vertices; the shape is {rows.shape}."
        )
    try:
        whole = np.full((n, *rows.shape[1:]), np.nan)
    except (MemoryError, ValueError) as err:  # the second beyond any address
        raise InvalidParameterError(
            f"The values of n_vertices vertices must fit into memory; n_vertices is {n}."
        ) from err
    whole[places] = rows
    return whole
