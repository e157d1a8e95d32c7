"""Thin-plate splines in space: their bending energy, meshes that they bend, points that they fill in."""

import warnings

import numpy as np
from jaxtyping import Float
from scipy.interpolate import RBFInterpolator
from scipy.linalg import null_space
from scipy.spatial.distance import cdist
from scipy.special import xlogy

from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows
from eigenshape._vectors import mean_radius
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.morphometrics.landmarks import complete_points

OTHER_UNIT = 100.0  # ratio of sizes from which units differ: landmarks may be of a small place


def bending_matrix(points: Float[np.ndarray, "k d"]) -> Float[np.ndarray, "k k"]:
    """Return L, so that a spline from these points to Y has the bending energy tr(Yᵀ L Y).

    The kernel is -r in space and r² log r in a plane (Bookstein 1989). L is the inverse of its matrix
    among functions that no affine map can make: L = Q (Qᵀ K Q)⁻¹ Qᵀ, with Q the null space of
    (1, points)ᵀ.
    """
    free = null_space(np.column_stack([np.ones(len(points)), points]).T)
    distances = cdist(points, points)
    kernel = -distances if points.shape[1] == 3 else xlogy(distances**2, distances)
    kernel = free.T @ kernel @ free
    return free @ np.linalg.pinv(kernel, hermitian=True) @ free.T


def fit_spline(
    starts: Float[np.ndarray, "k 3"], ends: Float[np.ndarray, "k 3"], name: str
) -> RBFInterpolator:
    """Return the thin-plate spline between points; raise an error if there is none."""
    try:
        return RBFInterpolator(starts, ends, kernel="linear", degree=1)
    except (ValueError, np.linalg.LinAlgError) as err:
        raise InvalidParameterError(
            f"{name} must be 4 points or more that differ and lie in no plane; there are "
            f"{len(starts)}, and {err}."
        ) from err


@one_blas_thread()
def warp_mesh(mesh: MeshLike, starts: ArrayLike, ends: ArrayLike) -> TriangleMesh:
    """Bend a mesh by the thin-plate spline that moves points to other places.

    To show how two mean shapes differ, bend a mesh to both. The component along
    `es.geometry.vertex_normals` of how its vertices move from one to the other is a function on it.

    Parameters
    ----------
    mesh : MeshLike
    starts : (k, 3) float
        Landmarks in the frame of the mesh, at least 4 that lie in no plane.
    ends : (k, 3) float
        Where they go.

    Returns
    -------
    TriangleMesh
        With the same faces.

    Raises
    ------
    InvalidShapeError, InvalidParameterError
        If numbers of points differ, one is not finite, or `starts` coincide or lie in a plane.

    See Also
    --------
    compare_groups : The mean shapes of groups.
    es.figure_field : Draw a function on a mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> corners = es.shapes.box(1, 1, 1).points
    >>> wide = es.morphometrics.warp_mesh(ball, corners, corners * [2, 1, 1])
    >>> wide.vertices.max(axis=0).round(6).tolist()
    [2.0, 1.0, 1.0]
    """
    mesh = as_mesh(mesh)
    places, goals = finite_rows(starts, "points", 3), finite_rows(ends, "points", 3)
    if places.shape != goals.shape:
        raise InvalidParameterError(
            f"There must be as many ends as starts; there are {len(goals)} and {len(places)}."
        )
    if len(places) > 3:  # what fewer lack, `fit_spline` says
        complete_points(places[None])
        ratio = mean_radius(places) / mean_radius(mesh.vertices)
        if not 1 / OTHER_UNIT < ratio < OTHER_UNIT:
            warnings.warn(
                f"starts are {ratio:.3g} times as large as the mesh, so both may be in different "
                "units; bring them into that of the mesh.",
                stacklevel=2,
            )
    return TriangleMesh(fit_spline(places, goals, "starts")(mesh.vertices), mesh.faces)
