"""Whether landmarks lie on the surfaces of their specimens, and what would bring them there."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from certeig.kit.errors import InvalidParameterError
from eigenshape._vectors import mean_radius
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.measure import edge_lengths
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.morphometrics.landmarks import Landmarks

# Distance from the surface, in its root mean square radius, above which no landmark of it lies; on a
# coarse surface it is an edge. The farthest of 612 landmarks that an expert put on 12 skulls
# (`data/mice`) lies at 0.039, or with edges of 0.2 radii at 0.050; with edges of 0.36 at 0.36.
OUTSIDE = 0.1
# The median distance of all landmarks of a specimen above which they may be those of another one, on
# a surface whose facets lie a square of an edge beside the true one. Of those skulls it is at most
# 0.0043, or with edges of 0.2 radii 0.010; of the landmarks of other skulls 0.010 to 0.032.
BESIDE, FACETS = 0.01, 0.5
SPOT = 0.1  # radius of landmarks, as a share of the surface's, below which their size tells nothing
# Between units of length
FACTORS = (1000.0, 0.001, 10.0, 0.1, 100.0, 0.01, 25.4, 1 / 25.4)
# What may bring landmarks to their surface: other units of length, or the other system of Slicer
CHANGES = {f"{size:.4g} times as large": [size] * 3 for size in FACTORS} | {
    "as -x, -y, z": [-1, -1, 1]
}


class Placement(NamedTuple):
    """The distance of each landmark from its surface, and whether all may be of another specimen."""

    distances: Float[np.ndarray, " k"]
    is_beside: bool


def require_on_surfaces(
    specimens: Iterable[tuple[str, TriangleMesh, Landmarks]],
) -> dict[str, Placement]:
    """Return, by name, where landmarks lie; raise InvalidParameterError if some do not lie on the surface.

    The error names each specimen, and what would bring its landmarks there.
    """
    found, wrong = {}, []
    for name, mesh, landmarks in specimens:
        radius, edge = mean_radius(mesh.vertices), float(edge_lengths(mesh).mean())
        farthest = farthest_place(mesh)
        known = np.isfinite(landmarks.points).all(axis=1)
        distances = np.full(len(known), np.nan)
        distances[known] = _distances(mesh, landmarks.points[known])
        near = BESIDE * radius + FACETS * edge**2 / radius
        found[name] = Placement(distances, bool(known.any() and np.median(distances[known]) > near))
        if (outside := distances > farthest).any():
            row = int(np.nanargmax(distances))
            wrong.append(
                f"{int(outside.sum())} of {int(known.sum())} landmarks of {name!r} lie farther from "
                f"it than {farthest:.3g}, and {landmarks.names[row]!r} {distances[row]:.3g}: "
                f"{_remedy(mesh, landmarks.points[known], farthest, outside[known])}."
            )
    if wrong:
        raise InvalidParameterError(
            f"Landmarks must lie on the surface of their specimen. {' '.join(wrong)}"
        )
    return found


def farthest_place(mesh: TriangleMesh) -> float:
    """Return the distance from a surface above which no point of it lies."""
    return max(OUTSIDE * mean_radius(mesh.vertices), float(edge_lengths(mesh).mean()))


def _distances(mesh: TriangleMesh, points: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, " k"]:
    return np.linalg.norm(closest_points(mesh, points).points - points, axis=1)


def _remedy(
    mesh: TriangleMesh, points: Float[np.ndarray, "k 3"], farthest: float, outside: np.ndarray
) -> str:
    """Say what would bring points to the surface."""
    moved = [points * change for change in CHANGES.values()]
    away = cKDTree(mesh.vertices).query(moved)[0].mean(axis=1)
    # Points that shrink into one spot may lie on any surface.
    is_spot = np.array(list(map(mean_radius, moved))) < SPOT * mean_radius(mesh.vertices)
    best = int(np.argmin(np.where(is_spot, np.inf, away)))
    if (_distances(mesh, moved[best]) <= farthest).all():
        unit = "; if their file names a unit, name that of the mesh (unit=, --unit)"
        return (
            f"{list(CHANGES)[best]} they would lie on it; change them so"
            f"{unit if best < len(FACTORS) else ''}"
        )
    if 2 * outside.sum() < len(outside):
        return "place them anew, or leave them out as missing (NA)"
    return "they are in another frame or of another specimen; save them as they lie on this mesh"
