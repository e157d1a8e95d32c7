"""A small gray picture of a mesh, to be kept in an index."""

import struct
import zlib

import numpy as np
from jaxtyping import Float, UInt8

from certeig.kit.threads import one_blas_thread
from eigenshape._vectors import area_vectors
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.scans.raster import Raster

SIZE = 128  # pixels of each side
FINER = 2  # pixels drawn for each shown, along each side
MARGIN = 0.04  # share of the picture that is left free on each side
# Right, down and towards the viewer: a little from above, between the front and the side, with y up
TURN, TILT = 0.6, 0.4  # radians
LIGHT = np.array([-0.35, -0.55, 0.76])  # from the upper left, towards the viewer
DARKEST, BRIGHTEST = 60, 235  # grays of 255; the ground is white
LEVELS = 40  # grays of a picture: 128 x 128 pixels with them take 2 to 5 KB
LARGEST_THUMBNAIL = 8192  # bytes, so that a stored shape takes less than 60 KB


@one_blas_thread()
def draw_thumbnail(mesh: MeshLike) -> bytes:
    r"""Draw a mesh as a small gray picture.

    It is seen a little from above, with y up. `es.plot.draw` makes larger pictures in color.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    bytes
        A PNG of 128 x 128 pixels, of at most 8,192 bytes.

    See Also
    --------
    ShapeIndex.thumbnail

    Examples
    --------
    >>> import eigenshape as es
    >>> picture = es.retrieval.draw_thumbnail(es.make_creature("fish", n_vertices=500))
    >>> picture[:4], len(picture) <= 8192
    (b'\x89PNG', True)
    """
    mesh = as_mesh(mesh)
    size = SIZE * FINER
    # Points in pixels: right, down, and towards the viewer
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    span = float((high - low).max()) or 1.0
    centered = (mesh.vertices - low) / span - (high - low) / span / 2
    turn = np.array([[np.cos(TURN), 0, -np.sin(TURN)], [0, -1, 0], [np.sin(TURN), 0, np.cos(TURN)]])
    tilt = np.array([[1, 0, 0], [0, np.cos(TILT), np.sin(TILT)], [0, -np.sin(TILT), np.cos(TILT)]])
    points = centered @ (tilt @ turn).T
    flat = points[:, :2]
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
    extent = float(np.ptp(flat, axis=0).max()) or 1.0
    scale = size * (1 - 2 * MARGIN) / extent
    points *= scale
    points[:, :2] += size / 2 - middle * scale
    raster = Raster.of(points, mesh.faces, size, size)
    normals = area_vectors(points[mesh.faces])
    lengths = np.linalg.norm(normals, axis=1)
    # Both sides of a face are lit alike, so that a scan with inward normals is not black.
    normals *= np.where(normals[:, 2] < 0, -1.0, 1.0)[:, None]
    light = (normals @ LIGHT) / (np.linalg.norm(LIGHT) * np.where(lengths > 0, lengths, 1.0))
    shade = DARKEST + (BRIGHTEST - DARKEST) * np.clip(light, 0.0, 1.0)
    image = np.where(raster.face >= 0, shade[raster.face], 255.0)
    image = image.reshape(SIZE, FINER, SIZE, FINER).mean(axis=(1, 3))
    for levels in (LEVELS, LEVELS // 4, 2):
        png = _png(np.round(np.round(image / 255 * (levels - 1)) * 255 / (levels - 1)))
        # Noise of a surface that fills the picture may need fewer grays.
        if len(png) <= LARGEST_THUMBNAIL:
            break
    return png


def _png(image: Float[np.ndarray, "h w"]) -> bytes:
    """Return a gray picture as PNG, each row as differences from the row above."""
    pixels: UInt8[np.ndarray, "h w"] = image.astype(np.uint8)
    above = np.vstack([np.zeros_like(pixels[:1]), pixels[:-1]])
    kind = np.full((len(pixels), 1), 2, dtype=np.uint8)  # the filter "up" of PNG
    data = np.hstack([kind, pixels - above]).tobytes()
    header = struct.pack(">IIBBBBB", *pixels.shape[::-1], 8, 0, 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(data, 9)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        for name, body in parts
    )
