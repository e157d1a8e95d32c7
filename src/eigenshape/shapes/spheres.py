"""Synthetic spheres with points distributed in several ways, and the projective plane."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from certeig.kit.arguments import require_type
from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import finite_rows
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import unit_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.shapes.surfaces import icosphere

GOLDEN = (1 + 5**0.5) / 2  # golden ratio; steps of 1/GOLDEN of a turn never line up
MOST_POINTS = 10**7  # the convex hull of more points takes gigabytes


def fibonacci_sphere(n: Integer = 1000) -> TriangleMesh:
    """Make a triangle mesh of the unit sphere with n evenly distributed points on a spiral.

    Parameters
    ----------
    n : int
        Number of vertices, 6 to 10⁷.

    Returns
    -------
    TriangleMesh
        Closed and facing outward.

    Raises
    ------
    InvalidParameterError
        If `n` is out of range.

    See Also
    --------
    sphere_eigenvalues : The exact eigenvalues of the sphere.
    icosphere, random_sphere, uneven_sphere

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.fibonacci_sphere(100)
    TriangleMesh(100 vertices, 196 faces)
    """
    count = whole_number(n, "n", 6, MOST_POINTS)
    return _outward_hull(_spiral(1 - 2 * (np.arange(count) + 0.5) / count))


def random_sphere(n: Integer = 1000, *, rng: np.random.Generator) -> TriangleMesh:
    """Make a triangle mesh of the unit sphere with n independent, uniformly random points.

    Parameters
    ----------
    n : int
        Number of vertices, 20 to 10⁷.
    rng : numpy.random.Generator
        Source of random numbers.

    Returns
    -------
    TriangleMesh
        Closed and facing outward.

    Raises
    ------
    InvalidParameterError
        If `n` is out of range.

    See Also
    --------
    fibonacci_sphere : Evenly distributed points.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> es.shapes.random_sphere(100, rng=np.random.default_rng(0))
    TriangleMesh(100 vertices, 196 faces)
    """
    require_type(rng, np.random.Generator, "rng")
    count = whole_number(n, "n", 20, MOST_POINTS)
    directions = rng.standard_normal((count, 3))
    return _outward_hull(unit_vectors(directions))


def uneven_sphere(n: Integer = 1000, *, ratio: float = 4.0) -> TriangleMesh:
    """Make a triangle mesh of the unit sphere with more points near the top than near the bottom.

    The density of the points is a linear function of z.

    Parameters
    ----------
    n : int
        Number of vertices, 6 to 10⁷.
    ratio : float
        Density at the top divided by the density at the bottom, 1 to 10⁶.

    Returns
    -------
    TriangleMesh
        Closed and facing outward.

    Raises
    ------
    InvalidParameterError
        If a number is out of range.

    See Also
    --------
    fibonacci_sphere : The same with constant density.

    Examples
    --------
    >>> import eigenshape as es
    >>> sphere = es.shapes.uneven_sphere(100, ratio=4)
    >>> int((sphere.vertices[:, 2] > 0).sum())
    65
    """
    count = whole_number(n, "n", 6, MOST_POINTS)
    if not 1 <= ratio < 1e6:
        raise InvalidParameterError(f"ratio must lie in 1..1e6; it is {ratio}.")
    # The density (1 + s z) / 2 has the distribution function ((1 + z) - s (1 - z²) / 2) / 2.
    # Heights are found by inverting this quadratic.
    slope = (ratio - 1) / (ratio + 1)
    share = (np.arange(count) + 0.5) / count
    if slope == 0:
        return _outward_hull(_spiral(2 * share - 1))
    root = np.sqrt(1 - slope * (2 - slope - 4 * share))
    return _outward_hull(_spiral(np.clip((root - 1) / slope, -1, 1)))


def _spiral(heights: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
    angles = 2 * np.pi / GOLDEN * np.arange(len(heights))
    rings = np.sqrt(1 - heights**2)
    return np.column_stack([rings * np.cos(angles), rings * np.sin(angles), heights])


def _outward_hull(points: Float[np.ndarray, "n 3"]) -> TriangleMesh:
    faces = sphere_hull(points).simplices.copy()
    # The mean of the points is inside their hull; for few points the origin may be outside.
    inside = points.mean(axis=0)
    inward = np.linalg.det(points[faces] - inside) < 0
    faces[inward] = faces[inward][:, ::-1]
    return TriangleMesh(points, faces)


def three_sphere(n: Integer = 1000) -> SimplicialMesh:
    """Make a mesh of tetrahedra of the unit sphere in R⁴, with n evenly distributed points.

    Parameters
    ----------
    n : int
        Number of points, 20 to 10⁷.

    Returns
    -------
    SimplicialMesh
        Of dimension 3 in R⁴, closed.

    Raises
    ------
    InvalidParameterError
        If `n` is out of range.

    See Also
    --------
    sphere_eigenvalues : The exact eigenvalues, with ``dim=3``.

    Notes
    -----
    The points are a lattice with two irrational steps on the tori of the Hopf fibration.

    Examples
    --------
    >>> import eigenshape as es
    >>> sphere = es.shapes.three_sphere(100)
    >>> sphere.n_points, sphere.dim, sphere.points.shape[1]
    (100, 3, 4)
    """
    count = whole_number(n, "n", 20, MOST_POINTS)
    places = np.arange(count)
    share = (places + 0.5) / count  # sin² of the angle that chooses the torus is uniform
    # Steps 1/ρ and 1/ρ² with ρ the plastic number, 1.3247: the two-dimensional golden ratio.
    one, two = 2 * np.pi * places * 0.7548776662466927, 2 * np.pi * places * 0.5698402909980532
    near, far = np.sqrt(share), np.sqrt(1 - share)
    return sphere_hull(
        np.column_stack(
            [near * np.cos(one), near * np.sin(one), far * np.cos(two), far * np.sin(two)]
        )
    )


def sphere_hull(points: ArrayLike) -> SimplicialMesh:
    """Make a mesh of points on a sphere in R^d from their convex hull; simplices are not oriented.

    Raises an error if a point is not a vertex of the hull, such as the second of two equal points,
    or if the hull has no volume.
    """
    rows = finite_rows(points, "points")
    try:
        hull = ConvexHull(rows)
    except (QhullError, ValueError) as err:
        raise InvalidShapeError(
            f"Points of a sphere must have a convex hull with volume; these {len(rows)} have none."
        ) from err
    inside = np.setdiff1d(np.arange(len(rows)), hull.vertices)
    if inside.size:
        raise InvalidShapeError(
            f"Points of a sphere must lie on their hull; point {inside[0]} at "
            f"{rows[inside[0]].tolist()} does not ({inside.size} such). Remove duplicate points."
        )
    return SimplicialMesh(rows, hull.simplices)


def projective_plane(level: Integer = 3) -> SimplicialMesh:
    """Make a triangle mesh of the projective plane in R⁵: the unit sphere with antipodes joined.

    Parameters
    ----------
    level : int
        Number of subdivisions of the icosphere whose antipodes are joined, 1 to 9.

    Returns
    -------
    SimplicialMesh
        Of dimension 2 in R⁵, closed, with 5·4^level + 1 points.

    Raises
    ------
    InvalidParameterError
        If `level` is out of range.

    See Also
    --------
    projective_plane_eigenvalues : The exact eigenvalues.

    Notes
    -----
    The embedding is Veronese's surface, which keeps all lengths:
    (x, y, z) ↦ (yz, xz, xy, (x² - y²)/2, (x² + y² - 2z²)/(2√3)).

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.projective_plane(1)
    SimplicialMesh(21 points in R^5, 40 simplices of dimension 2)
    """
    sphere = icosphere(whole_number(level, "level", 1, 9))
    x, y, z = sphere.vertices.T
    # Points are rounded, and negated so that antipodes are equal; the first represents both.
    rounded = np.round(sphere.vertices, 9) + 0.0
    leading = np.argmax(rounded != 0, axis=1)
    signs = np.sign(rounded[np.arange(len(rounded)), leading])
    lines = rounded * signs[:, None] + 0.0
    _, first, names = np.unique(lines, axis=0, return_index=True, return_inverse=True)
    image = np.column_stack(
        [y * z, x * z, x * y, (x**2 - y**2) / 2, (x**2 + y**2 - 2 * z**2) / 12**0.5]
    )
    return SimplicialMesh(
        image[first], np.unique(np.sort(names.ravel()[sphere.faces], axis=1), axis=0)
    )
