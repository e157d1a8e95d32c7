"""What the surface is like around points spread all over it: descriptors of geodesic discs of several sizes."""

from dataclasses import dataclass, replace
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float, Float32, Int
from scipy.sparse.csgraph import shortest_path

from eigenshape._arrays import frozen, whole_number
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.fragments import fragment_vertices
from eigenshape.geometry.geodesic import farthest_points
from eigenshape.geometry.measure import mean_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_box
from eigenshape.geometry.requirements import require_describable, require_oriented
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import boundary_vertices, submesh
from eigenshape.retrieval.patches.patch_loops import NUMBERS, RINGS, describe_disc
from eigenshape.scans.partial import views_of

N_SAMPLES = 150
N_VIEWS = 6
RADII = 0.05 * 1.25 ** np.arange(1, 10)  # in sides of the box
AT_BOUNDARY = 0.5  # of the radius, nearer than which to a boundary a disc weighs less
LEAST_WEIGHT = 0.02


@dataclass(frozen=True, eq=False)
class Patches:
    """Geodesic discs around points of a shape in a unit box.

    Attributes
    ----------
    numbers : (m, r, 64) float32
        Of m points at r radii; see `describe_patches`.
    weights : (m, r) float32
        Share of the surface that a point stands for, less near a boundary.
    vertices : (m,) int
        The vertex of each point.
    distances : (m, m) float32
        Along the surface between points, in sides of the box; far ones by way of other points, and so a few per cent
        long; infinite between pieces.
    """

    numbers: Float32[np.ndarray, "m r c"]
    weights: Float32[np.ndarray, "m r"]
    vertices: Int[np.ndarray, " m"]
    distances: Float32[np.ndarray, "m m"]


def describe_patches(mesh: MeshLike, *, n_samples: SupportsIndex = N_SAMPLES) -> Patches:
    """Describe the discs around farthest points, at nine radii from .0625 to .37 of the box.

    A disc's normal n is the mean normal within .35 of its radius R. Only what faces the same way counts, N_q · n > 0:
    so a scan from one side compares with the whole. In each of four rings of equal width: histograms of N_q · n
    (8 bins) and of the height (x_q - x_p) · n / R (6 bins), by area, square roots of shares; the logarithm of the area
    up to there over that of a flat disc; and the mean of the straight over the geodesic distance.

    Components whose area is less than a point's share are left out (`fragment_vertices`), of the box too.

    Parameters
    ----------
    mesh : MeshLike
        Oriented outward. In any size: it is put into a unit box.
    n_samples : int
        Points at most; never more than vertices.

    Returns
    -------
    Patches

    Raises
    ------
    InvalidParameterError
        If n_samples is not positive.
    InvalidShapeError
        If a vertex has no face, a face is there twice, neighboring faces are turned against each other, the mesh is
        a soup, whose faces lie edge on edge without sharing vertices, or the surface has no area.
    """
    mesh = as_mesh(mesh)
    count = whole_number(n_samples, "n_samples", 1)
    require_describable(mesh)
    require_oriented(mesh)
    fragments = fragment_vertices(mesh, count)
    if not len(fragments):
        return _describe_patches(mesh, count)
    body, source = submesh(mesh, ~np.isin(mesh.faces[:, 0], fragments))
    found = _describe_patches(body, count)
    return replace(found, vertices=frozen(source[found.vertices]))


def _describe_patches(mesh: TriangleMesh, n_samples: int) -> Patches:
    """Describe the discs of a mesh without fragments: each component gets a point, since there are fewer of them."""
    count = min(n_samples, mesh.n_vertices)
    mesh = normalize_box(mesh)
    areas = dual_volumes(mesh)
    if not areas.sum() > 0:
        raise InvalidShapeError("A surface must have an area to be described by patches; all its faces have none.")
    chosen, rows, nearest = farthest_points(mesh, count, reach=RADII[-1])
    numbers = np.empty((len(chosen), len(RADII), NUMBERS), dtype=np.float32)
    surface = mesh.vertices, mean_normals(mesh), areas
    scratch = np.empty(RINGS), np.empty(RINGS)
    for point, distances, discs in zip(chosen, rows, numbers, strict=True):
        reached = np.flatnonzero(distances <= RADII[-1])
        order = reached[np.argsort(distances[reached], kind="stable")]
        for radius, found in zip(RADII, discs, strict=True):
            describe_disc(distances, mesh.vertices[point], order, surface, radius, *scratch, found)
    cells = np.bincount(nearest, weights=areas / areas.sum(), minlength=len(chosen))
    rim = boundary_vertices(mesh)
    away = rows[:, rim].min(axis=1) if len(rim) else np.full(len(chosen), np.inf)
    weights = cells[:, None] * np.clip(away[:, None] / (AT_BOUNDARY * RADII), LEAST_WEIGHT, 1.0)
    between = _by_way(rows[:, chosen]).astype(np.float32)
    return Patches(frozen(numbers), frozen(weights.astype(np.float32)), frozen(chosen), frozen(between))


def _by_way(near: Float[np.ndarray, "m m"]) -> Float[np.ndarray, "m m"]:
    """Fill in distances that waves did not reach, along others."""
    return np.asarray(shortest_path(np.minimum(near, near.T), directed=False))


def describe_patch_views(mesh: MeshLike, *, n_views: int = N_VIEWS) -> list[Patches]:
    """Describe what single viewpoints see of a closed shape, as partial scans of it will be.

    Returns
    -------
    list of Patches
        With points at vertices of the whole; empty for an open shape, which is a part already.
    """
    mesh = as_mesh(mesh)
    seen = [(part, describe_patches(part.mesh)) for part in views_of(mesh, n_views)]
    return [replace(patches, vertices=frozen(part.source_vertices[patches.vertices])) for part, patches in seen]
