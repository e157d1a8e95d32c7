"""Parts of a shape: what is visible from one side, or what planes leave (thesis 5.4)."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, real_numbers, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._corners import mean_normals
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import scale_to_unit, unit_vector
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.face_turns import orient_consistently
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_steps import faces_of_largest
from eigenshape.geometry.topology import is_closed, submesh
from eigenshape.scans.raster import depths_at

# A vertex may be this many pixels away from the middle of the pixel in which the surface was seen,
# so it may lie deeper than that surface by SLACK times (1 + slope).
SLACK = 1.5
# Slopes are limited to this value. A larger one would keep vertices seen from their edge that
# another part of the surface hides.
STEEPEST_SURFACE = 10.0
RESOLUTION = 512  # pixels along the longest side of the z-buffer
MOST_VIEWS = 1000  # of one shape; to describe one takes about 0.05 s


@record
class MeshPart(ReadOnly):
    """A part of a mesh, and the indices of its vertices and faces in the whole mesh.

    Attributes
    ----------
    mesh : TriangleMesh
        The part.
    source_vertices : (n,) int
        For each vertex of `mesh`, its index in the whole mesh.
    source_faces : (f,) int
        For each face of `mesh`, its index in the whole mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> part = es.scans.partial_scan(ball, [0, 0, 1])
    >>> bool((part.mesh.vertices == ball.vertices[part.source_vertices]).all())
    True
    """

    mesh: TriangleMesh
    source_vertices: Int[np.ndarray, " n"]
    source_faces: Int[np.ndarray, " f"]


def partial_scan(
    mesh: MeshLike,
    view: ArrayLike | np.random.Generator,
    *,
    resolution: int = RESOLUTION,
    all_pieces: bool = False,
) -> MeshPart:
    """Keep the part of a mesh that is visible from one direction.

    The viewer is infinitely far away. A face is kept if all its corners are visible.

    Parameters
    ----------
    mesh : MeshLike
        In any length unit.
    view : (3,) float or numpy.random.Generator
        Direction from the shape to the viewer, of any length; or a generator that draws one.
    resolution : int
        Number of pixels along the longest side of the z-buffer, 16 to 8192.
    all_pieces : bool
        Keep every visible piece. By default only the piece with the largest area is kept, because
        heat on small islands has nothing to do with the shape.

    Returns
    -------
    MeshPart
        The visible part, with the indices of its vertices and faces in `mesh`.

    Raises
    ------
    InvalidParameterError
        If the direction is zero or not finite, or the resolution is out of range.
    InvalidShapeError
        If no face is visible.

    See Also
    --------
    simulate_scan : A scan with perspective, noise and holes.
    cut_by_planes : Remove what lies beyond planes.

    Notes
    -----
    A vertex is visible if it lies no deeper than the z-buffer plus what the slope of the surface
    allows within a pixel. So a narrow rim that already faces away is kept; on real shapes it has
    4 % of the kept area on average.

    Examples
    --------
    >>> import eigenshape as es
    >>> scan = es.partial_scan(es.icosphere(3), [0, 0, 1])
    >>> scan.mesh
    TriangleMesh(337 vertices, 624 faces)
    >>> scan.source_vertices.shape
    (337,)
    """
    whole_number(resolution, "resolution", 16, 8192)
    direction = unit_direction(view)
    mesh = as_mesh(mesh)
    normals = mean_normals(orient_consistently(mesh))
    return _visible_part(mesh, normals, direction, resolution, all_pieces=all_pieces)


@one_blas_thread()
def _visible_part(
    mesh: TriangleMesh,
    normals: Float[np.ndarray, "n 3"],
    direction: Float[np.ndarray, "3"],
    resolution: int = RESOLUTION,
    *,
    all_pieces: bool,
) -> MeshPart:
    """Keep what is visible of a mesh from a unit direction, as `partial_scan` does."""
    points = scale_to_unit(mesh.vertices)[0] @ rotation_towards(direction).T
    low = points.min(axis=0)
    span = float((points.max(axis=0) - low)[:2].max())
    if not span > 0:
        raise InvalidShapeError(
            "A shape must have a size as seen by the viewer; "
            "all its vertices lie on one line of sight. Choose another view."
        )
    pixels = (points - low) * ((resolution - 2) / span) + 1
    depths = depths_at(pixels, mesh.faces, pixels[:, :2].astype(np.int64), resolution)
    # The slope is the same on both sides of the surface, so it does not matter which is outside.
    towards = np.abs(normals @ direction)
    slope = np.minimum(
        np.sqrt(1 - np.minimum(towards, 1) ** 2) / np.maximum(towards, 1 / STEEPEST_SURFACE),
        STEEPEST_SURFACE,
    )
    visible = pixels[:, 2] >= depths - SLACK * (1 + slope)
    keep = visible[mesh.faces].all(axis=1)
    if keep.any() and not all_pieces:
        keep[keep] = faces_of_largest(TriangleMesh(mesh.vertices, mesh.faces[keep]))
    return _part(mesh, keep, "No face is visible as a whole from this direction.")


def viewpoint(number: int) -> Float[np.ndarray, "3"]:
    """Return one of a sequence of unit directions that are evenly distributed on the sphere.

    The first k directions are evenly distributed for every k. They come from the additive
    recurrence of the plastic number (Roberts 2018).
    """
    u, v = (0.5 + (number + 1) * np.array([0.7548776662466927, 0.5698402909980532])) % 1
    height, around = 2 * u - 1, 2 * np.pi * v
    radius = np.sqrt(1 - height**2)
    return np.array([radius * np.cos(around), height, radius * np.sin(around)])


def view_number(value: Integer, name: str) -> int:
    """Return `value` as an int from 0 to 1000, a number of viewpoints."""
    return whole_number(value, name, 0, MOST_VIEWS, "each view is a scan that is described")


def views_of(mesh: TriangleMesh, n_views: int) -> list[MeshPart]:
    """Return what is visible of a closed shape from the first `n_views` viewpoints.

    An open shape is a part already and has no views.
    """
    return list(map(viewer(mesh), range(n_views))) if is_closed(mesh) else []


def viewer(mesh: TriangleMesh) -> Callable[[int], MeshPart]:
    """Return a function that returns what is visible of a shape from a viewpoint: the largest piece.

    If no component has half of the area, all pieces are kept: the largest would be one of many
    parts, and a scan of the shape shows many.
    """
    areas, normals = face_areas(mesh), mean_normals(orient_consistently(mesh))
    is_of_parts = bool(areas[faces_of_largest(mesh)].sum() < areas.sum() / 2)
    return lambda number: _visible_part(mesh, normals, viewpoint(number), all_pieces=is_of_parts)


def unit_direction(view: ArrayLike | np.random.Generator) -> Float[np.ndarray, "3"]:
    """Scale a direction to length 1, or draw a random one.

    Raise InvalidParameterError if it is zero or not finite.
    """
    vector = (
        view.standard_normal(3)
        if isinstance(view, np.random.Generator)
        else real_numbers(view, "view")
    )
    if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
        raise InvalidParameterError(
            f"view must be three finite numbers that are not all zero; it is {vector.tolist()}."
        )
    return unit_vector(vector)


def rotation_towards(view: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Return a rotation whose third row is the unit vector `view`."""
    helper = np.eye(3)[np.argmin(np.abs(view))]
    right = np.cross(helper, view)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(view, right), view])


def cut_by_planes(mesh: MeshLike, planes: ArrayLike) -> MeshPart:
    """Remove the parts of a mesh that lie beyond planes.

    Faces are removed as a whole, so the cut follows the edges of the mesh.

    Parameters
    ----------
    mesh : MeshLike
    planes : (p, 4) float
        One plane (a, b, c, d) in each row. Every vertex with a x + b y + c z > d for any plane is
        removed, together with its faces.

    Returns
    -------
    MeshPart
        The rest, with the indices of its vertices and faces in `mesh`.

    Raises
    ------
    InvalidParameterError
        If a plane does not consist of four finite numbers, or its normal is zero.
    InvalidShapeError
        If no face remains.

    See Also
    --------
    random_planes : Planes that cut off a given share of the vertices.
    partial_scan : The part that is visible from one direction.

    Examples
    --------
    Keep the lower half of a sphere.

    >>> import eigenshape as es
    >>> es.scans.cut_by_planes(es.icosphere(2), [[0, 0, 1, 0]]).mesh
    TriangleMesh(89 vertices, 152 faces)
    """
    mesh = as_mesh(mesh)
    rows = np.atleast_2d(real_numbers(planes, "planes").astype(np.float64))
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise InvalidParameterError(f"planes must have shape (p, 4); the shape is {rows.shape}.")
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1) | ~rows[:, :3].any(axis=1))
    if bad.size:
        raise InvalidParameterError(
            "planes must be finite and have a normal other than zero; "
            f"row {bad[0]} is {rows[bad[0]].tolist()}."
        )
    kept = np.all(mesh.vertices @ rows[:, :3].T <= rows[:, 3], axis=1)
    return _part(mesh, kept[mesh.faces].all(axis=1), "The planes leave no face.")


def random_planes(
    mesh: MeshLike, rng: np.random.Generator, *, n_planes: int = 1, share: float = 0.2
) -> Float[np.ndarray, "p 4"]:
    """Draw planes in random directions that each cut off a given share of the vertices.

    Parameters
    ----------
    mesh : MeshLike
    rng : numpy.random.Generator
        Source of the directions.
    n_planes : int
        Number p of planes, 1 to 100.
    share : float
        Share of the vertices beyond each plane, between 0 and 1.

    Returns
    -------
    (p, 4) float
        Planes (a, b, c, d), as `cut_by_planes` takes them.

    Raises
    ------
    InvalidParameterError
        If a number is out of range.

    See Also
    --------
    cut_by_planes : Remove what lies beyond the planes.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> sphere = es.icosphere(3)
    >>> planes = es.scans.random_planes(sphere, np.random.default_rng(0), share=0.25)
    >>> beyond = sphere.vertices @ planes[0, :3] > planes[0, 3]
    >>> bool(0.24 < beyond.mean() < 0.26)
    True
    """
    mesh = as_mesh(mesh)
    require_type(rng, np.random.Generator, "rng")
    whole_number(n_planes, "n_planes", 1, 100)
    if not 0 < share < 1:
        raise InvalidParameterError(f"share must lie between 0 and 1; it is {share}.")
    normals = rng.standard_normal((n_planes, 3))
    offsets = np.quantile(mesh.vertices @ normals.T, 1 - share, axis=0)
    return np.column_stack([normals, offsets])


def _part(mesh: TriangleMesh, keep: Bool[np.ndarray, " f"], reason_if_empty: str) -> MeshPart:
    if not keep.any():
        raise InvalidShapeError(f"A part must have a face. {reason_if_empty}")
    part, vertices = submesh(mesh, keep)
    return MeshPart(part, vertices, np.flatnonzero(keep))
