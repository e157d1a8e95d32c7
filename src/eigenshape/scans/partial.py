"""Parts of a shape as the world gives them: seen from one side, or with portions missing (thesis 5.4)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import real_numbers, whole_number
from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import mean_normals, unit_scaled
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repair import faces_of_largest
from eigenshape.geometry.topology import consistently_oriented, is_closed, submesh
from eigenshape.scans.raster import rasterize

SLACK = 1.5  # pixels that a vertex may lie off the place where the surface was seen
STEEPEST = 10.0  # slope up to which that may hide it behind its own surface


@dataclass(frozen=True, eq=False)
class MeshPart:
    """A part of a mesh, and where its vertices were.

    Attributes
    ----------
    mesh : TriangleMesh
    source_vertices : (n,) int
        For each vertex of `mesh`, its index in the whole.
    source_faces : (f,) int
        For each face of `mesh`, its index in the whole.
    """

    mesh: TriangleMesh
    source_vertices: Int[np.ndarray, " n"]
    source_faces: Int[np.ndarray, " f"]


@one_blas_thread()
def partial_scan(
    mesh: MeshLike,
    view: ArrayLike | np.random.Generator,
    *,
    resolution: int = 512,
    all_pieces: bool = False,
) -> MeshPart:
    """Keep what is visible from far away in one direction.

    A face stays if all its corners are visible in a z-buffer. Visible is what lies no deeper than the slope of the
    surface explains, so a rim that just turns away is kept: on real shapes, 4 % of the kept area on average.

    Parameters
    ----------
    mesh : MeshLike
    view : (3,) float or numpy.random.Generator
        Direction from the shape to the viewer, or the source of a random one.
    resolution : int
        Pixels along the longest side of the picture, 16 to 8192.
    all_pieces : bool
        Keep every visible piece, and not only the one with the most area. Small islands have heat of their own that
        has nothing to do with the shape.

    Returns
    -------
    MeshPart

    Raises
    ------
    InvalidParameterError
        If the direction is zero or not finite, or the resolution is out of range.
    InvalidShapeError
        If no face is visible.
    """
    mesh = as_mesh(mesh)
    whole_number(resolution, "resolution", 16, 8192)
    visible = _visible_vertices(mesh, unit_direction(view), resolution)
    keep = visible[mesh.faces].all(axis=1)
    if keep.any() and not all_pieces:
        keep[keep] = faces_of_largest(TriangleMesh(mesh.vertices, mesh.faces[keep]))
    return _kept(mesh, keep, "No face is visible as a whole from there.")


def viewpoint(number: int) -> Float[np.ndarray, "3"]:
    """Return a unit direction; the first few, and the first many, lie evenly around the sphere.

    They come from the additive recurrence of the plastic number (Roberts 2018), so that more of them keep the first.
    """
    u, v = (0.5 + (number + 1) * np.array([0.7548776662466927, 0.5698402909980532])) % 1
    height, around = 2 * u - 1, 2 * np.pi * v
    radius = np.sqrt(1 - height**2)
    return np.array([radius * np.cos(around), height, radius * np.sin(around)])


def views_of(mesh: TriangleMesh, n_views: int) -> list[MeshPart]:
    """Return what the first few viewpoints see of a closed shape; nothing of an open one, which is a part already."""
    return [
        partial_scan(mesh, viewpoint(view)) for view in range(n_views if is_closed(mesh) else 0)
    ]


def unit_direction(view: ArrayLike | np.random.Generator) -> Float[np.ndarray, "3"]:
    """Return a direction at length 1, or draw one.

    Raises
    ------
    InvalidParameterError
        If it is zero or not finite.
    """
    vector = (
        view.standard_normal(3)
        if isinstance(view, np.random.Generator)
        else real_numbers(view, "view")
    )
    if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
        raise InvalidParameterError(
            f"view must be three finite numbers, not all zero; it is {vector.tolist()}."
        )
    vector = vector / np.abs(vector).max()
    return vector / np.linalg.norm(vector)


def rotation_towards(view: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Return a rotation whose third row is the unit vector `view`."""
    helper = np.eye(3)[np.argmin(np.abs(view))]
    right = np.cross(helper, view)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(view, right), view])


def _visible_vertices(
    mesh: TriangleMesh, view: Float[np.ndarray, "3"], resolution: int
) -> Bool[np.ndarray, " n"]:
    points = unit_scaled(mesh)[0] @ rotation_towards(view).T
    low = points.min(axis=0)
    span = float((points.max(axis=0) - low)[:2].max())
    if not span > 0:
        raise InvalidShapeError(
            "A shape must have a size to be scanned; all its vertices are in one line of sight."
        )
    pixels = (points - low) * ((resolution - 2) / span) + 1
    raster = rasterize(pixels, mesh.faces, resolution, resolution)
    column, row = pixels[:, :2].astype(np.int64).T
    towards = np.abs(
        mean_normals(consistently_oriented(mesh)) @ view
    )  # which side is out does not matter
    slope = np.minimum(
        np.sqrt(1 - np.minimum(towards, 1) ** 2) / np.maximum(towards, 1 / STEEPEST), STEEPEST
    )
    return pixels[:, 2] >= raster.depth[row, column] - SLACK * (1 + slope)


def cut_by_planes(mesh: MeshLike, planes: ArrayLike) -> MeshPart:
    """Remove the portions of a mesh that lie beyond planes.

    Parameters
    ----------
    mesh : MeshLike
    planes : (p, 4) float
        Rows (a, b, c, d): a vertex with a x + b y + c z > d for any row goes, and every face that it belongs to.

    Returns
    -------
    MeshPart

    Raises
    ------
    InvalidParameterError
        If a plane is not four finite numbers or has no normal.
    InvalidShapeError
        If nothing is left.
    """
    mesh = as_mesh(mesh)
    rows = np.atleast_2d(real_numbers(planes, "planes").astype(np.float64))
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise InvalidParameterError(f"planes must have shape (p, 4); the shape is {rows.shape}.")
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1) | ~rows[:, :3].any(axis=1))
    if bad.size:
        raise InvalidParameterError(
            f"planes must be finite with a normal that is not zero; row {bad[0]} is {rows[bad[0]].tolist()}."
        )
    kept = np.all(mesh.vertices @ rows[:, :3].T <= rows[:, 3], axis=1)
    return _kept(mesh, kept[mesh.faces].all(axis=1), "The planes leave no face.")


def random_planes(
    mesh: MeshLike, rng: np.random.Generator, *, n_planes: int = 1, share: float = 0.2
) -> Float[np.ndarray, "p 4"]:
    """Draw planes in random directions that each cut off a share of the vertices.

    Raises
    ------
    InvalidParameterError
        If the share is not within 0..1 or there is no plane to draw.
    """
    mesh = as_mesh(mesh)
    require_type(rng, np.random.Generator, "rng")
    whole_number(n_planes, "n_planes", 1, 100)
    if not 0 < share < 1:
        raise InvalidParameterError(f"share must lie between 0 and 1; it is {share}.")
    normals = rng.standard_normal((n_planes, 3))
    offsets = np.quantile(mesh.vertices @ normals.T, 1 - share, axis=0)
    return np.column_stack([normals, offsets])


def _kept(mesh: TriangleMesh, keep: Bool[np.ndarray, " f"], otherwise: str) -> MeshPart:
    if not keep.any():
        raise InvalidShapeError(f"A part must have a face. {otherwise}")
    part, vertices = submesh(mesh, keep)
    return MeshPart(part, vertices, np.flatnonzero(keep))
