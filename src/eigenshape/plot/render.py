"""A shaded picture of a mesh, drawn pixel by pixel in numpy."""

import matplotlib as mpl
import numpy as np
from jaxtyping import Bool, Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from eigenshape._vectors import unit_vectors
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.creases import corner_normals
from eigenshape.geometry.face_turns import orient_consistently
from eigenshape.geometry.topology import boundary_edges
from eigenshape.plot.camera import Camera, in_picture
from eigenshape.scans.raster import Raster

FINER = 2  # pixels drawn for each shown, along each side
LIGHT = np.array([-0.35, -0.55, 0.76])  # from the upper left, towards the viewer
AMBIENT = 0.42  # brightness, of 1, of what faces away from the light
INK = 0.12  # brightness of lines
LINE = 1.6  # their width, in shown pixels
# share of the picture's size that a point may lie behind what is seen and still count as seen
BEHIND = 0.02
GRAY_PAIR = 7  # of matplotlib's tab20, left to what has no label

Image = Float[np.ndarray, "h w 4"]


@record
class Drawing(ReadOnly):
    """A picture and the places of the vertices in it.

    Attributes
    ----------
    image : (h, w, 4) float
        Red, green, blue, opacity in 0..1.
    places : (n, 2) float
        Pixels right and down of each vertex.
    visible : (n,) bool
        Whether nothing lies before it.

    See Also
    --------
    draw : Draw a mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> drawing = es.plot.draw(ball, es.plot.aim_camera(ball, size=64))
    >>> drawing.places.shape
    (162, 2)
    """

    image: Image
    places: Float[np.ndarray, "n 2"]
    visible: Bool[np.ndarray, " n"]


@one_blas_thread()
def draw(
    mesh: MeshLike,
    camera: Camera,
    *,
    vertex_colors: Float[np.ndarray, "n 3"] | None = None,
    face_colors: Float[np.ndarray, "f 3"] | None = None,
    zero_set_of: Float[np.ndarray, " n"] | None = None,
) -> Drawing:
    """Draw a mesh with soft light, pixel by pixel.

    Parameters
    ----------
    mesh : MeshLike
    camera : Camera
        Such as `aim_camera` returns.
    vertex_colors : (n, 3) float, optional
        Colors in 0..1, blended across faces.
    face_colors : (f, 3) float, optional
        Colors of whole faces, with dark lines where they change.
    zero_set_of : (n,) float, optional
        A function whose zero set is drawn as a dark line.

    Returns
    -------
    Drawing
        Boundary edges are drawn dark as well.

    Raises
    ------
    InvalidParameterError
        If colors or the function do not have a row for each vertex, or for each face.

    See Also
    --------
    figure_field : Draw a function on a mesh, with its legend.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> es.plot.draw(ball, es.plot.aim_camera(ball, size=64)).image.shape
    (64, 64, 4)
    """
    mesh = as_mesh(mesh)
    require_type(camera, Camera, "camera")
    of_vertices = {"vertex_colors": vertex_colors, "zero_set_of": zero_set_of}
    for name, values in {**of_vertices, "face_colors": face_colors}.items():
        n_rows = len(mesh.vertices if name in of_vertices else mesh.faces)
        if values is not None and len(values) != n_rows:
            raise InvalidParameterError(
                f"{name} must have {n_rows} rows; there are {len(values)}. Colors of vertices are "
                "vertex_colors, those of faces face_colors, and es.figure_field draws a function."
            )
    fine = Camera(camera.rotation, camera.size * FINER)
    points = in_picture(mesh, fine)
    raster = Raster.of(points, mesh.faces, fine.size, fine.size)
    # Colors and light are computed where the shape is seen, mostly a small part of the picture.
    seen = raster.face >= 0
    face, weights = raster.face[seen], raster.weights[seen]

    def blend(at_corners: Float[np.ndarray, "f 3 c"]) -> Float[np.ndarray, "p c"]:
        return np.einsum("pk,pkc->pc", weights, at_corners[face])

    def place(values: Float[np.ndarray, "p c"]) -> Float[np.ndarray, "h w c"]:
        placed = np.zeros((*seen.shape, values.shape[1]))
        placed[seen] = values
        return placed

    colors = np.full((len(face), 3), 0.78)
    if vertex_colors is not None:
        colors = blend(vertex_colors[mesh.faces])
    if face_colors is not None:
        colors = face_colors[face]
    normals = unit_vectors(blend(corner_normals(orient_consistently(mesh)) @ fine.rotation.T))
    # Both sides of an open surface are lit.
    normals = np.where(normals[:, 2:] < 0, -normals, normals)
    light = np.clip(normals @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
    shaded = place(colors * (AMBIENT + (1.08 - AMBIENT) * light)[:, None])

    # Lines: boundary edges that nothing hides, changes of color, and the zero set
    ink = np.zeros(raster.face.shape, dtype=bool)
    edges = boundary_edges(mesh)
    if len(edges):
        begin, end = points[edges[:, 0]], points[edges[:, 1]]
        steps = np.arange(0, 1, 1 / (2 + int(np.abs(end - begin)[:, :2].max())))
        along = (begin[:, None] + steps[:, None] * (end - begin)[:, None]).reshape(-1, 3)
        column, row, shown = _locate(along, raster)
        ink[row[shown], column[shown]] = True
    if face_colors is not None:
        ink |= _changes(place(colors.sum(axis=1, keepdims=True))[..., 0], raster)
    if zero_set_of is not None:
        ink |= _changes(np.sign(place(blend(zero_set_of[mesh.faces, None])))[..., 0], raster)
    radius = int(np.ceil(LINE * FINER / 2 - 0.5))
    thick = ink.copy()
    for down in range(-radius, radius + 1):
        for right in range(-radius, radius + 1):
            if down**2 + right**2 <= radius**2:
                thick |= np.roll(ink, (down, right), axis=(0, 1))
    shaded = np.clip(np.where((thick & seen)[..., None], INK, shaded), 0, 1)

    # Of the pixels that become one, those that show the shape give its color.
    blocks = np.concatenate([shaded, seen[..., None].astype(np.float64)], axis=2)
    blocks = blocks.reshape(camera.size, FINER, camera.size, FINER, 4)
    opacity = blocks[..., 3:]
    weight = np.maximum(opacity.sum(axis=(1, 3)), 1e-12)
    color = (blocks[..., :3] * opacity).sum(axis=(1, 3)) / weight
    image = np.concatenate([color, opacity.mean(axis=(1, 3))], axis=2)
    return Drawing(image, points[:, :2] / FINER, _locate(points, raster)[2])


def _changes(values: Float[np.ndarray, "h w"], raster: Raster) -> Bool[np.ndarray, "h w"]:
    """Mark pixels whose value differs from that of the neighbor to the right or below on the same surface."""
    ink = np.zeros(values.shape, dtype=bool)
    near = 0.01 * values.shape[0]
    # Transposed, the neighbor to the right is the one below.
    for marks, rows, depth in ((ink, values, raster.depth), (ink.T, values.T, raster.depth.T)):
        with np.errstate(invalid="ignore"):
            joined = np.abs(depth[:-1] - depth[1:]) < near
        marks[:-1] |= (rows[:-1] != rows[1:]) & joined
    return ink


def _locate(
    points: Float[np.ndarray, "k 3"], raster: Raster
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"], Bool[np.ndarray, " k"]]:
    """Return the column and the row of the pixel of each point, and whether nothing hides it."""
    h, w = raster.depth.shape
    column, row = np.clip(points[:, :2].astype(np.int64), 0, [w - 1, h - 1]).T
    return column, row, points[:, 2] >= raster.depth[row, column] - BEHIND * h


def palette(labels: Int[np.ndarray, " k"]) -> Float[np.ndarray, "k 3"]:
    """Return a color for each label, 18 different ones in turn; below 0 is gray."""
    pairs = mpl.colormaps["tab20"](np.arange(20))[:, :3].reshape(10, 2, 3)
    colors = np.concatenate(pairs[np.arange(10) != GRAY_PAIR].transpose(1, 0, 2))
    return np.where(labels[:, None] < 0, 0.82, colors[labels % len(colors)])
