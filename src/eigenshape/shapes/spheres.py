"""Made-up spheres of any dimension, with points spread in several ways, and the projective plane."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from eigenshape._arguments import require_type
from eigenshape._arrays import finite_rows, whole_number
from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape._typing import ArrayLike
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.shapes.surfaces import icosphere

GOLDEN = (1 + 5**0.5) / 2
MOST = 10**7


def fibonacci_sphere(n: SupportsIndex = 1000) -> TriangleMesh:
    """Spread n points evenly over the unit sphere, along a spiral; eigenvalues are `sphere_eigenvalues(k)`."""
    count = whole_number(n, "n", 6, MOST)
    return _outward(_spiral(1 - 2 * (np.arange(count) + 0.5) / count))


def random_sphere(n: SupportsIndex = 1000, *, rng: np.random.Generator) -> TriangleMesh:
    """Throw n points on the unit sphere, uniformly and independently."""
    require_type(rng, np.random.Generator, "rng")
    count = whole_number(n, "n", 20, MOST)
    return _outward(_unit(rng.standard_normal((count, 3))))


def graded_sphere(n: SupportsIndex = 1000, *, ratio: float = 4.0) -> TriangleMesh:
    """Spread n points over the unit sphere whose density falls linearly in z, by a ratio from the top to the bottom."""
    count = whole_number(n, "n", 6, MOST)
    if not 1 <= ratio < 1e6:
        raise InvalidParameterError(f"ratio must lie in 1..1e6; it is {ratio}.")
    # Density (1 + s z) / 2 has the distribution function ((1 + z) - s (1 - z²) / 2) / 2: a quadratic to be inverted.
    slope = (ratio - 1) / (ratio + 1)
    share = (np.arange(count) + 0.5) / count
    if slope == 0:
        return _outward(_spiral(2 * share - 1))
    root = np.sqrt(1 - slope * (2 - slope - 4 * share))
    return _outward(_spiral(np.clip((root - 1) / slope, -1, 1)))


def _spiral(heights: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
    angles = 2 * np.pi / GOLDEN * np.arange(len(heights))
    rings = np.sqrt(1 - heights**2)
    return np.column_stack([rings * np.cos(angles), rings * np.sin(angles), heights])


def _outward(points: Float[np.ndarray, "n 3"]) -> TriangleMesh:
    faces = sphere_hull(points).simplices.copy()
    inside = points.mean(axis=0)  # the hull of few points may leave the origin out
    inward = np.linalg.det(points[faces] - inside) < 0
    faces[inward] = faces[inward][:, ::-1]
    return TriangleMesh(points, faces)


def three_sphere(n: SupportsIndex = 1000) -> SimplicialMesh:
    """Spread n points evenly over the unit sphere in R⁴ and join them by tetrahedra.

    A lattice with two irrational steps on the tori of Hopf's fibration; eigenvalues are `sphere_eigenvalues(k, 3)`.
    """
    count = whole_number(n, "n", 20, MOST)
    places = np.arange(count)
    share = (places + 0.5) / count  # sin² of the torus' angle is uniform
    one, two = 2 * np.pi * places * 0.7548776662466927, 2 * np.pi * places * 0.5698402909980532
    near, far = np.sqrt(share), np.sqrt(1 - share)
    return sphere_hull(
        np.column_stack(
            [near * np.cos(one), near * np.sin(one), far * np.cos(two), far * np.sin(two)]
        )
    )


def sphere_hull(points: ArrayLike) -> SimplicialMesh:
    """Join points of a sphere around the origin of R^d, in any d ≥ 2, by the simplices of their convex hull.

    Raises
    ------
    InvalidShapeError
        If a point is not on the hull, as copies are not, or there is no hull with volume.
    """
    rows = finite_rows(points, "points")
    try:
        hull = ConvexHull(rows)
    except (QhullError, ValueError) as err:
        raise InvalidShapeError(
            f"Points of a sphere must have a hull with volume; these {len(rows)} have none."
        ) from err
    inside = np.setdiff1d(np.arange(len(rows)), hull.vertices)
    if inside.size:
        raise InvalidShapeError(
            f"Points of a sphere must lie on their hull; point {inside[0]} is {rows[inside[0]].tolist()} "
            f"({inside.size} such)."
        )
    return SimplicialMesh(rows, hull.simplices)


def _unit(vectors: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n d"]:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def projective_plane(level: SupportsIndex = 3) -> SimplicialMesh:
    """Embed the unit sphere with antipodes made one in R⁵, without stretching it: Veronese's surface.

    x ↦ (yz, xz, xy, (x² - y²)/2, (x² + y² - 2z²)/(2√3)) on an icosphere; eigenvalues are
    `projective_plane_eigenvalues(k)`.
    """
    sphere = icosphere(whole_number(level, "level", 1, 9))
    x, y, z = sphere.vertices.T
    # Of each pair of antipodes the one that comes first stands for both.
    _, first, names = np.unique(
        _signless(sphere.vertices), axis=0, return_index=True, return_inverse=True
    )
    image = np.column_stack(
        [y * z, x * z, x * y, (x**2 - y**2) / 2, (x**2 + y**2 - 2 * z**2) / 12**0.5]
    )
    return SimplicialMesh(
        image[first], np.unique(np.sort(names.ravel()[sphere.faces], axis=1), axis=0)
    )


def _signless(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    rounded = np.round(points, 9) + 0.0
    leading = np.argmax(rounded != 0, axis=1)
    signs = np.sign(rounded[np.arange(len(rounded)), leading])
    return rounded * signs[:, None] + 0.0
