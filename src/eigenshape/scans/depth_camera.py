"""Simulated scans of a depth camera: perspective, noise, dropout at grazing angles, and holes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import html_repr
from certeig.kit.typing import ArrayLike
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_steps import faces_of_largest
from eigenshape.geometry.topology import submesh
from eigenshape.scans.frames import pixel_faces
from eigenshape.scans.partial import rotation_towards, unit_direction
from eigenshape.scans.raster import rasterize

# The noise grows with the slant θ by this number times (θ / (π/2 - θ))², relative to the noise at θ
# = 0 (Nguyen, Izadi and Lovell 2012, equation 3, at 1.5 m).
SLANT_NOISE = 0.025
LARGEST_SLANT_NOISE = 20.0  # upper bound of that growth, which is infinite at θ = π/2
FULL_DROPOUT = np.deg2rad(85.0)  # slant from which no depth is measured
HOLE_SIZES = (0.01, 0.03)  # smallest and largest radius of a hole, as a share of the picture


@dataclass(frozen=True)
class DepthCamera:
    """Position and quality of a simulated depth camera.

    Attributes
    ----------
    resolution : int
        Number of pixels along each side of the picture, 16 to 4096. The sphere around the bounding
        box of the shape just fits into the picture.
    distance : float
        Distance from the middle of the bounding box, in diagonals of the box; more than 0.5.
    noise : float
        Standard deviation of the depth of a surface that faces the camera at that distance, in
        diagonals, 0 to 1.
    dropout_angle : float
        Slant in degrees, 0 to 85, from which pixels get lost. Their share grows linearly to 1 at 85
        degrees.
    dropout : float
        Share of pixels that get lost at any slant, at least 0 and less than 1.
    n_holes : int
        Number of round holes, such as at shiny spots, 0 to 1000. Their radii are 0.01 to 0.03 of
        the picture.

    See Also
    --------
    simulate_scan : Scan a shape with such a camera.

    Examples
    --------
    A camera without noise, dropout or holes.

    >>> import eigenshape as es
    >>> es.scans.DepthCamera(resolution=64, noise=0, dropout_angle=84.9, dropout=0, n_holes=0)
    DepthCamera(resolution=64, distance=1.5, noise=0, dropout_angle=84.9, dropout=0, n_holes=0)
    """

    resolution: int = 160
    distance: float = 1.5
    noise: float = 0.002
    dropout_angle: float = 60.0
    dropout: float = 0.01
    n_holes: int = 3

    _repr_html_ = html_repr


@record
class DepthScan(ReadOnly):
    """A simulated scan of a depth camera.

    Attributes
    ----------
    mesh : TriangleMesh
        The scanned surface, facing the camera, in the position and unit of the shape.
    source_faces : (n,) int
        For each vertex, the face of the shape that is visible in its pixel.
    pixels : (n, 2) int
        Column and row of the pixel of each vertex, counted to the right and upward.

    Examples
    --------
    A depth camera sees one side of a sphere; each vertex of the scan remembers what it shows:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> camera = es.scans.DepthCamera(resolution=24, noise=0, dropout=0, n_holes=0)
    >>> scan = es.scans.simulate_scan(ball, np.random.default_rng(0), view=[0, 0, 1], camera=camera)
    >>> bool(scan.mesh.vertices[:, 2].min() > 0)
    True
    >>> seen = np.unique(scan.source_faces)  # the faces that the camera saw
    >>> len(seen) < ball.n_faces / 2
    True
    """

    mesh: TriangleMesh
    source_faces: Int[np.ndarray, " n"]
    pixels: Int[np.ndarray, "n 2"]


def simulate_scan(
    mesh: MeshLike,
    rng: np.random.Generator,
    *,
    view: ArrayLike | None = None,
    camera: DepthCamera | None = None,
    all_pieces: bool = False,
) -> DepthScan:
    """Simulate a scan of a shape from one side by a depth camera.

    The simulation includes perspective, noise, dropout at grazing angles and holes.

    Parameters
    ----------
    mesh : MeshLike
        In any length unit.
    rng : numpy.random.Generator
        Source of noise and dropout, and of the direction if none is given.
    view : (3,) float, optional
        Direction from the shape to the camera, of any length.
    camera : DepthCamera, optional
        The camera; `DepthCamera()` by default.
    all_pieces : bool
        Keep every piece, such as an arm in front of the body. By default only the piece with the
        largest area is kept.

    Returns
    -------
    DepthScan

    Raises
    ------
    InvalidParameterError
        If the direction is zero or not finite, or a number of the camera is out of range.
    InvalidShapeError
        If all vertices are equal, or no face is visible.

    See Also
    --------
    partial_scan : The visible faces of the mesh itself, without noise.

    Notes
    -----
    A pinhole camera measures one depth at the middle of each pixel. The noise is that of a
    structured-light camera: its standard deviation grows with the square of the depth, and with the
    slant θ by (θ / (π/2 - θ))² (Nguyen, Izadi and Lovell, "Modeling Kinect sensor noise", 2012,
    equation 3, at 1.5 m). Pixels at most three columns and rows apart form triangles if their
    depths differ by at most eight widths of a pixel for each column or row, so that single lost
    pixels leave no holes.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> camera = es.scans.DepthCamera(resolution=64)
    >>> scan = es.scans.simulate_scan(
    ...     es.icosphere(3), np.random.default_rng(0), view=[0, 0, 1], camera=camera
    ... )
    >>> scan.pixels.shape == (scan.mesh.n_vertices, 2)
    True
    """
    mesh = as_mesh(mesh)
    require_type(rng, np.random.Generator, "rng")
    require_type(camera, DepthCamera | None, "camera")
    camera = _require_in_range(camera or DepthCamera())
    towards = unit_direction(rng if view is None else view)
    points, scale = size_one(mesh.vertices)
    low, high = points.min(axis=0), points.max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    if not diagonal > 0:
        raise InvalidShapeError(
            "A shape must have a size above zero to be scanned; all its vertices are equal."
        )
    turn, middle = rotation_towards(towards), low + (high - low) / 2
    ahead = np.array([0, 0, camera.distance])
    placed = TriangleMesh((points - middle) @ turn.T / diagonal - ahead, mesh.faces)
    # Depth, slant and face of each pixel without noise, by a pinhole camera at the origin that looks
    # along -z; the picture just holds the sphere around the shape. 1/z is a linear function of the
    # pixel within a face, so interpolating it gives exact depths.
    size = camera.resolution
    focal = (size / 2 - 1) * float(np.sqrt(4 * camera.distance**2 - 1))
    depths = -placed.vertices[:, 2]
    in_picture = focal * placed.vertices[:, :2] / depths[:, None] + size / 2
    raster = rasterize(np.column_stack([in_picture, 1 / depths]), placed.faces, size, size)
    is_seen = raster.face >= 0
    depth = np.where(is_seen, 1 / raster.depth, np.inf)
    # The vector from the camera to each pixel in the plane at distance 1.
    across = (np.arange(size) + 0.5 - size / 2) / focal
    rays = np.stack([*np.meshgrid(across, across), np.full((size, size), -1.0)], axis=2)
    normals = face_normals(placed)[raster.face]
    facing = np.abs(np.einsum("hwi,hwi->hw", normals, rays)) / np.linalg.norm(rays, axis=2)
    slant = np.arccos(np.minimum(facing, 1))
    # Pixels drop out at random, more of them where the surface turns away, and in round holes.
    begins = np.deg2rad(camera.dropout_angle)
    odds = np.clip((slant - begins) / (FULL_DROPOUT - begins), camera.dropout, 1)
    kept = is_seen & (rng.random(odds.shape) >= odds)
    seen_pixels = np.argwhere(is_seen)
    if len(seen_pixels):
        rows, columns = np.indices(kept.shape)
        for row, column in seen_pixels[rng.integers(len(seen_pixels), size=camera.n_holes)]:
            radius = camera.resolution * rng.uniform(*HOLE_SIZES)
            kept &= (rows - row) ** 2 + (columns - column) ** 2 > radius**2
    # Noise grows with the depth and the slant.
    slanted = SLANT_NOISE * (slant / np.maximum(np.pi / 2 - slant, 1e-9)) ** 2
    growth = (depth / camera.distance) ** 2 + np.minimum(slanted, LARGEST_SLANT_NOISE)
    noise = camera.noise * np.where(is_seen, growth, 0) * rng.standard_normal(depth.shape)
    measured = np.where(is_seen, depth + noise, 0)
    # Connect the pixels that are kept, where they see one surface.
    faces = pixel_faces(np.where(kept, measured, np.inf), focal)
    if not len(faces):
        raise InvalidShapeError(
            "A scan must have a face; no three neighboring pixels see one surface from this view. "
            "Choose another view, or a camera with a higher resolution."
        )
    places = rays * np.where(kept, measured, 0)[:, :, None]
    surface = TriangleMesh(places.reshape(-1, 3), faces)
    wanted = np.ones(surface.n_faces, dtype=bool) if all_pieces else faces_of_largest(surface)
    seen, source = submesh(surface, wanted)
    back = ((seen.vertices + ahead) * diagonal @ turn + middle) * scale
    pixels = np.column_stack([source % size, source // size])
    return DepthScan(TriangleMesh(back, seen.faces), raster.face.ravel()[source], pixels)


def _require_in_range(camera: DepthCamera) -> DepthCamera:
    whole_number(camera.resolution, "resolution", 16, 4096)
    whole_number(camera.n_holes, "n_holes", 0, 1000)
    if not 0.5 < camera.distance < np.inf:
        raise InvalidParameterError(
            f"distance must be finite and more than 0.5 diagonals; it is {camera.distance}."
        )
    if not 0 <= camera.noise <= 1:
        raise InvalidParameterError(f"noise must lie in 0..1 diagonals; it is {camera.noise}.")
    if not 0 <= camera.dropout_angle < np.rad2deg(FULL_DROPOUT):
        raise InvalidParameterError(
            "dropout_angle must be at least 0 and less than 85 degrees; "
            f"it is {camera.dropout_angle}."
        )
    if not 0 <= camera.dropout < 1:
        raise InvalidParameterError(
            f"dropout must be at least 0 and less than 1; it is {camera.dropout}."
        )
    return camera
