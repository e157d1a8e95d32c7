"""What a depth camera would deliver: perspective, noise, grazing sides and holes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import frozen, whole_number
from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape._typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repair import faces_of_largest
from eigenshape.geometry.simplices import size_one
from eigenshape.geometry.topology import submesh
from eigenshape.scans.partial import rotation_towards, unit_direction
from eigenshape.scans.raster import rasterize

SLANT_NOISE = 0.025  # of the noise face on, times (θ / (π/2 - θ))²
STEEPEST_NOISE = 20.0  # times the noise face on, at most
FULL_DROPOUT = np.deg2rad(85.0)  # slant from which nothing comes back
LARGEST_JUMP = 4.0  # pixels of depth between corners of one triangle
HOLE_SIZES = (0.01, 0.03)  # radii of holes, of the picture


@dataclass(frozen=True)
class DepthCamera:
    """How a depth camera stands and how well it sees.

    Attributes
    ----------
    resolution : int
        Pixels along each side of the picture, which the sphere around the bounding box just fills; 16 to 4096.
    distance : float
        From the middle of the box, in its diagonals, more than .5.
    noise : float
        Standard deviation of the depth of what is seen face on at that distance, in diagonals.
    dropout_angle : float
        Slant, in degrees below 85, from which pixels get lost; the share grows to all of them at 85.
    dropout : float
        Share of pixels that get lost wherever they are, in 0..1.
    n_holes : int
        Round holes, of .01 to .03 of the picture in radius: shiny spots, say.
    """

    resolution: int = 160
    distance: float = 1.5
    noise: float = 0.002
    dropout_angle: float = 60.0
    dropout: float = 0.01
    n_holes: int = 3


@dataclass(frozen=True, eq=False)
class DepthScan:
    """What a depth camera saw.

    Attributes
    ----------
    mesh : TriangleMesh
        In the place and unit of the shape; it faces the camera.
    source_faces : (n,) int
        For each vertex the face of the shape that its pixel saw.
    pixels : (n, 2) int
        Column and row of each vertex, to the right and upward.
    """

    mesh: TriangleMesh
    source_faces: Int[np.ndarray, " n"]
    pixels: Int[np.ndarray, "n 2"]


@dataclass(frozen=True, eq=False)
class _Picture:
    """Pixels of a pinhole camera in its own frame: sight along -z, the camera at the origin."""

    focal: float
    depth: Float[np.ndarray, "h w"]
    slant: Float[np.ndarray, "h w"]
    face: Int[np.ndarray, "h w"]


def simulate_scan(
    mesh: MeshLike,
    rng: np.random.Generator,
    *,
    view: ArrayLike | None = None,
    camera: DepthCamera | None = None,
    all_pieces: bool = False,
) -> DepthScan:
    """Scan a shape from one side by a depth camera, as simulated.

    Perspective of a pinhole; one depth a pixel, at its middle. Depths err as a structured-light camera's: the standard
    deviation grows with the square of the depth, and with the slant θ by (θ / (π/2 - θ))² (Nguyen, Izadi and Lovell,
    Modeling Kinect sensor noise, 2012, eq. 3, at 1.5 m). Pixels get lost at grazing angles, here and there, and in
    round holes. Neighbours are joined where depths within a triangle differ by no more than four pixels, and of what
    hangs together the piece with the most area is kept.

    Parameters
    ----------
    mesh : MeshLike
    rng : numpy.random.Generator
        Source of noise and losses, and of the direction where none is given.
    view : (3,) float, optional
        Direction from the shape to the camera.
    camera : DepthCamera, optional
        `DepthCamera()` by default.
    all_pieces : bool
        Keep every piece, and not only the one with the most area: an arm before the body, say.

    Returns
    -------
    DepthScan

    Raises
    ------
    InvalidParameterError
        If the direction is zero or not finite, or a number of the camera is out of range.
    InvalidShapeError
        If the shape has no size, or no face is seen.
    """
    mesh = as_mesh(mesh)
    require_type(rng, np.random.Generator, "rng")
    require_type(camera, DepthCamera | None, "camera")
    camera = _checked(camera or DepthCamera())
    towards = unit_direction(rng if view is None else view)
    points, scale = size_one(mesh.vertices)
    low, high = points.min(axis=0), points.max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    if not diagonal > 0:
        raise InvalidShapeError(
            "A shape must have a size to be scanned; all its vertices are equal."
        )
    turn, middle = rotation_towards(towards), low + (high - low) / 2
    ahead = np.array([0, 0, camera.distance])
    placed = TriangleMesh((points - middle) @ turn.T / diagonal - ahead, mesh.faces)
    picture = _taken(placed, camera)
    kept = _kept(picture, camera, rng)
    joined = _joined(picture, _noisy(picture, camera, rng), kept)
    wanted = np.ones(joined.n_faces, dtype=bool) if all_pieces else faces_of_largest(joined)
    seen, source = submesh(joined, wanted)
    back = ((seen.vertices + ahead) * diagonal @ turn + middle) * scale
    columns = source % camera.resolution
    pixels = np.column_stack([columns, source // camera.resolution])
    return DepthScan(
        TriangleMesh(back, seen.faces), frozen(picture.face.ravel()[source]), frozen(pixels)
    )


def _checked(camera: DepthCamera) -> DepthCamera:
    whole_number(camera.resolution, "resolution", 16, 4096)
    whole_number(camera.n_holes, "n_holes", 0, 1000)
    if not 0.5 < camera.distance < np.inf:
        raise InvalidParameterError(
            f"distance must be more than half a diagonal, and finite; it is {camera.distance}."
        )
    if not 0 <= camera.noise <= 1:
        raise InvalidParameterError(f"noise must lie in 0..1 diagonals; it is {camera.noise}.")
    if not 0 <= camera.dropout_angle < np.rad2deg(FULL_DROPOUT):
        raise InvalidParameterError(
            f"dropout_angle must lie in 0..85 degrees, 85 excluded; it is {camera.dropout_angle}."
        )
    if not 0 <= camera.dropout < 1:
        raise InvalidParameterError(
            f"dropout must lie in 0..1, 1 excluded; it is {camera.dropout}."
        )
    return camera


def _taken(placed: TriangleMesh, camera: DepthCamera) -> _Picture:
    """Take a picture without faults; 1/z is linear in a picture, so that depths inside faces are exact."""
    size, points = camera.resolution, placed.vertices
    focal = (size / 2 - 1) * float(np.sqrt(4 * camera.distance**2 - 1))
    ahead = -points[:, 2]
    pixels = np.column_stack([focal * points[:, :2] / ahead[:, None] + size / 2, 1 / ahead])
    raster = rasterize(pixels, placed.faces, size, size)
    depth = np.where(raster.face >= 0, 1 / raster.depth, np.inf)
    rays = _rays(size, focal)
    facing = np.abs(
        np.einsum("hwi,hwi->hw", face_normals(placed)[raster.face], rays)
    ) / np.linalg.norm(rays, axis=2)
    return _Picture(focal, depth, np.arccos(np.minimum(facing, 1)), raster.face)


def _rays(size: int, focal: float) -> Float[np.ndarray, "h w 3"]:
    """Return the way from the camera through each pixel, one unit ahead."""
    across = (np.arange(size) + 0.5 - size / 2) / focal
    return np.stack([*np.meshgrid(across, across), np.full((size, size), -1.0)], axis=2)


def _kept(
    picture: _Picture, camera: DepthCamera, rng: np.random.Generator
) -> Bool[np.ndarray, "h w"]:
    begins = np.deg2rad(camera.dropout_angle)
    odds = np.clip((picture.slant - begins) / (FULL_DROPOUT - begins), camera.dropout, 1)
    kept = (picture.face >= 0) & (rng.random(odds.shape) >= odds)
    seen = np.argwhere(picture.face >= 0)
    if len(seen):
        rows, columns = np.indices(kept.shape)
        for row, column in seen[rng.integers(len(seen), size=camera.n_holes)]:
            radius = camera.resolution * rng.uniform(*HOLE_SIZES)
            kept &= (rows - row) ** 2 + (columns - column) ** 2 > radius**2
    return kept


def _noisy(
    picture: _Picture, camera: DepthCamera, rng: np.random.Generator
) -> Float[np.ndarray, "h w"]:
    slanted = SLANT_NOISE * (picture.slant / np.maximum(np.pi / 2 - picture.slant, 1e-9)) ** 2
    growth = (picture.depth / camera.distance) ** 2 + np.minimum(slanted, STEEPEST_NOISE)
    away = rng.standard_normal(picture.depth.shape)
    return np.where(
        picture.face >= 0,
        picture.depth + camera.noise * np.where(picture.face >= 0, growth, 0) * away,
        0,
    )


def _joined(
    picture: _Picture, depth: Float[np.ndarray, "h w"], kept: Bool[np.ndarray, "h w"]
) -> TriangleMesh:
    """Make triangles of squares of neighbours, cut along the diagonal with the lesser jump."""
    size = len(depth)
    corner = np.arange(size * size).reshape(size, size)
    a, b, c, d = (
        part.ravel()
        for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    )
    flat = np.where(kept, depth, np.inf).ravel()
    with np.errstate(invalid="ignore"):
        along = ~(np.abs(flat[a] - flat[c]) > np.abs(flat[b] - flat[d]))
    one = np.where(along[:, None], np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    two = np.where(along[:, None], np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    faces = np.concatenate([one, two])
    faces = faces[np.isfinite(flat[faces]).all(axis=1)]
    depths = flat[faces]
    faces = faces[np.ptp(depths, axis=1) <= LARGEST_JUMP * depths.mean(axis=1) / picture.focal]
    if not len(faces):
        raise InvalidShapeError(
            "A scan must have a face. No three neighbouring pixels see one surface from there."
        )
    points = (_rays(size, picture.focal) * np.where(kept, depth, 0)[:, :, None]).reshape(-1, 3)
    return TriangleMesh(points, faces)
