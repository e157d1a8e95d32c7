"""Points spread evenly over a surface, with normals: what alignment and fitting compare."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import record
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import area_vectors
from eigenshape.geometry.distances.crossing_loops import curve_places
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.samples.surface_points import SurfacePoints, place_points
from eigenshape.geometry.topology import vertex_components
from eigenshape.matching.nearest import RowTree

# Area of the smallest piece that counts, as a share of the largest one: the halves of a broken bone
# do, crumbs of a scan do not.
SMALLEST_PIECE = 0.1
# Length of a normal beside a place, in units of the root mean square distance of a surface from its
# middle. Chosen on the tuning half of experiments/ch7_collection.
NORMAL_WEIGHT = 0.15


@record
class SpreadPoints:
    """Places on a surface with their unit normals."""

    places: SurfacePoints
    normals: Float[np.ndarray, "k 3"]

    @property
    def points(self) -> Float[np.ndarray, "k 3"]:
        """Return the coordinates of the places."""
        return self.places.points


def main_pieces(mesh: TriangleMesh) -> TriangleMesh:
    """Return a surface without its small loose pieces; vertices stay."""
    _, labels = vertex_components(mesh)
    areas = np.bincount(labels[mesh.faces[:, 0]], face_areas(mesh))
    kept = areas[labels[mesh.faces[:, 0]]] >= SMALLEST_PIECE * areas.max()
    return TriangleMesh(mesh.vertices, mesh.faces[kept])


def spread_points(mesh: TriangleMesh, n_points: int) -> SpreadPoints:
    """Place points along a curve through all faces, one in each piece of equal area.

    Faces that follow each other on Morton's curve are neighbors in space, so the points are spread
    nearly as evenly as by rejection, in the time of a sort, and are the same in each run.
    """
    corners = mesh.vertices[mesh.faces]
    vectors = area_vectors(corners)
    areas = np.linalg.norm(vectors, axis=1)
    if not areas.sum() > 0:
        raise InvalidShapeError("A surface must have area; all faces of this one have none.")
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
    order = np.argsort(curve_places(boxes), kind="stable")
    order = order[areas[order] > 0]
    reached = np.cumsum(areas[order])
    draw = np.random.default_rng(0)
    steps = (np.arange(n_points) + draw.random(n_points)) / n_points * reached[-1]
    faces = order[np.minimum(np.searchsorted(reached, steps), len(order) - 1)]
    # Uniform in a triangle: the root makes rows near the first corner as rare as they are short
    root, share = np.sqrt(draw.random(n_points)), draw.random(n_points)
    weights = np.column_stack([1 - root, root * (1 - share), root * share])
    return SpreadPoints(place_points(mesh, faces, weights), vectors[faces] / areas[faces, None])


def join_normals(
    points: Float[np.ndarray, "k 3"], normals: Float[np.ndarray, "k 3"]
) -> Float[np.ndarray, "k 6"]:
    """Return rows of six numbers, in which other normals are farther away by up to 2 `NORMAL_WEIGHT`."""
    return np.concatenate([points, NORMAL_WEIGHT * normals], axis=1)


class Pairing:
    """Each point of two surfaces, with the nearest one of the other, while the first one moves."""

    def __init__(self, ours: Float[np.ndarray, "k 6"], theirs: Float[np.ndarray, "m 6"]) -> None:
        self._ours, self._theirs = RowTree(ours), RowTree(theirs)
        self._to_them, self._to_us = (np.zeros(len(each), np.int64) for each in (ours, theirs))

    def pair(self, ours: Float[np.ndarray, "k 6"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return pairs from where our points are now: ours, theirs, and the distances."""
        self._ours.move(ours)
        far, self._to_them = self._theirs.nearest(ours, self._to_them)
        far_from_them, self._to_us = self._ours.nearest(self._theirs.rows, self._to_us)
        first = np.concatenate([np.arange(len(ours)), self._to_us])
        second = np.concatenate([self._to_them, np.arange(len(self._to_us))])
        return first, second, np.concatenate([far, far_from_them])
