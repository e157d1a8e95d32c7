"""The direction of the view, and where the points of a shape lie in the picture."""

from typing import Literal, get_args

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError
from typing_extensions import TypeAliasType

from certeig.kit.arguments import require_type
from certeig.kit.arrays import TINY, ReadOnly, real_numbers, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._vectors import area_vectors, row_dots, scale_to_unit, triangle_areas, unit_vector
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table

UpName = Literal["auto", "x", "y", "z", "-x", "-y", "-z"]
Up = TypeAliasType("Up", UpName | ArrayLike)
View = TypeAliasType(
    "View",
    Literal[
        "auto",
        "front",
        "back",
        "left",
        "right",
        "top",
        "bottom",
        "front-left",
        "front-right",
        "back-left",
        "back-right",
    ]
    | ArrayLike,
)
UP_NAMES = get_args(UpName)
# The parts of front, left and up in the direction to the viewer, for each name of a view. Views of
# two words are a little from above.
VIEWS = {
    "front": (1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "top": (0.0, 0.0, 1.0),
    "bottom": (0.0, 0.0, -1.0),
    "front-left": (0.78, 0.48, 0.4),
    "front-right": (0.78, -0.48, 0.4),
    "back-left": (-0.78, 0.48, 0.4),
    "back-right": (-0.78, -0.48, 0.4),
}
# Sine of the angle between the view and the upward direction below which the view counts as along
# it, so that another direction must point up in the picture.
ALONG_UP = 1e-6
# Length of the mean normal above which a surface counts as a scan. A closed surface has 0, a flat
# piece 1.
ONE_WAY = 0.3
FREE_BORDER = 0.04  # share of the picture that is left free on each side
# Points at most this share of the longest side of the box above the lowest point carry the shape.
SOLE = 0.02
# z is up only if the base along z is this many times larger: a smaller factor turns over many
# shapes for which y is up.
WIDER = 4.0
# A shape is shown from behind if its front has less than this share of the curvature seen there.
LESS = 0.8
MOST_PIXELS = 10_000  # of a side: some gigabytes while the picture is drawn


@record
class Camera(ReadOnly):
    """A parallel projection onto a square picture.

    Attributes
    ----------
    rotation : (3, 3) float
        Orthonormal rows, which point right, down and towards the viewer.
    size : int
        Width and height of the picture in pixels, at most 10,000.

    Raises
    ------
    InvalidParameterError
        If size is not in 1..10,000.

    See Also
    --------
    aim_camera : Aim one at a shape.

    Examples
    --------
    >>> import numpy as np, eigenshape as es
    >>> from_z = es.plot.Camera(np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, 1]]), size=300)
    >>> mesh = es.icosphere(1)
    >>> figure = es.figure_field(mesh, mesh.vertices[:, 2], camera=from_z)
    """

    rotation: Float[np.ndarray, "3 3"]
    size: int

    def __post_init__(self) -> None:
        super().__post_init__()
        whole_number(self.size, "size", 1, MOST_PIXELS)


@one_blas_thread()
def aim_camera(mesh: MeshLike, *, view: View = "auto", up: Up = "auto", size: int = 600) -> Camera:
    """Return a camera that shows a shape upright from a side.

    Front, left and so on are sides of the shape itself: the left hand of a person is on the left
    side, and on the right in a picture from the front. The front is +z if y is up, as in most
    collections and in glTF; +x if z is up; +y if x is up. If the opposite side is clearly more
    curved, that side is the front, because a face is more curved than the back of a head. An open
    surface that mostly faces one way is taken for a scan, and its front is what it faces. A
    direction involves no guess.

    Parameters
    ----------
    mesh : MeshLike
    view : str or (3,) float
        "auto" looks from the front left and a little from above, at a scan from where it faces.
        "front", "back", "left", "right", "top" and "bottom" look straight at a side; "front-left",
        "front-right", "back-left" and "back-right" look from between two sides, a little from
        above. A vector points from the shape to the viewer.
    up : {"auto", "x", "y", "z", "-x", "-y", "-z"} or (3,) float
        The upward direction. "auto" takes y, or z if the shape would fall over along y and would
        stand along z on a base more than four times as large. It is a guess: of 243 real shapes
        whose upright pose is known, it shows 183 upright, and y alone shows 143. In a view along it
        the front is at the bottom of the picture ("top") or at its top.
    size : int
        Width and height of the picture in pixels.

    Returns
    -------
    Camera

    Raises
    ------
    InvalidParameterError
        If `view` or `up` is neither a name nor a direction.

    Examples
    --------
    >>> import eigenshape as es
    >>> camera = es.plot.aim_camera(es.icosphere(1), view=[1, 0, 0], up="z")
    >>> abs(camera.rotation.round(9)).tolist()  # y to the right, z upward, x to the viewer
    [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
    """
    mesh = as_mesh(mesh)
    upward = upward_direction(mesh, up)
    front, towards_auto = _guess_front(mesh, upward)
    if isinstance(view, str) and view == "auto":
        towards = towards_auto
    elif isinstance(view, str) and view in VIEWS:
        towards = np.array(VIEWS[view]) @ [front, np.cross(upward, front), upward]
    else:
        towards = _direction(view, "view", ("auto", *VIEWS))
    towards = towards / np.linalg.norm(towards)
    right = np.cross(upward, towards)
    if np.linalg.norm(right) < ALONG_UP:
        # Along the upward direction: the back is at the top of the picture, seen from above.
        right = np.cross(-np.sign(towards @ upward) * front, towards)
    right = right / np.linalg.norm(right)
    return Camera(np.stack([right, -np.cross(towards, right), towards]), size)


def upward_direction(mesh: TriangleMesh, up: Up) -> Float[np.ndarray, "3"]:
    """Return the upward direction of a shape, which "auto" guesses, as a unit vector.

    Raise InvalidParameterError if `up` is neither a name nor a direction.
    """
    if isinstance(up, str) and up == "auto":
        points = scale_to_unit(mesh.vertices)[0]
        areas = triangle_areas(points[mesh.faces])
        weights = areas / max(areas.sum(), TINY)
        points = points - weights @ points[mesh.faces].mean(axis=1)
        stands, sizes = [], []
        for axis in (1, 2):
            # Where the lowest points would touch the ground
            height = points[:, axis] - points[:, axis].min()
            lowest = height <= SOLE * np.ptp(points, axis=0).max()
            base = np.delete(points, axis, axis=1)[lowest]
            # What stands on points around its center does not fall over.
            around = np.sort(np.arctan2(base[:, 1], base[:, 0]))
            stands.append(np.diff(around, append=around[0] + 2 * np.pi).max() < np.pi)
            try:
                sizes.append(float(ConvexHull(base).volume))
            except QhullError:  # fewer than three points, or all on a line
                sizes.append(0.0)
        up = "z" if stands[1] and not stands[0] and sizes[1] > WIDER * sizes[0] else "y"
    return _direction(up, "up", UP_NAMES)


def is_auto(view: View, up: Up) -> bool:
    """Tell whether neither a view nor an upward direction was chosen."""
    return isinstance(view, str) and view == "auto" and isinstance(up, str) and up == "auto"


def choose_camera(
    mesh: TriangleMesh, camera: Camera | None, view: View, up: Up, *, size: int = 600
) -> Camera:
    """Return the camera of a figure: the one that was passed, or one for the view.

    Raise InvalidParameterError if both a camera and a view or an upward direction were passed.
    """
    require_type(camera, Camera | None, "camera")
    if camera is None:
        return aim_camera(mesh, view=view, up=up, size=size)
    if not is_auto(view, up):
        raise InvalidParameterError(
            "A camera determines the view, so view and up must not be passed with it. "
            "Pass camera, or view and up."
        )
    return camera


def _direction(value: View, name: str, names: tuple[str, ...]) -> Float[np.ndarray, "3"]:
    """Return a unit vector for the name of an axis or for three numbers.

    Raise InvalidParameterError if it is not one of the names, not three finite numbers, or zero.
    """
    if isinstance(value, str):
        if value not in UP_NAMES or value == "auto" or name != "up":
            raise InvalidParameterError(
                f"{name} must be one of {', '.join(names)}, or three numbers; it is {value!r}."
            )
        return (-1.0 if value.startswith("-") else 1.0) * np.eye(3)["xyz".index(value[-1])]
    vector = real_numbers(value, name).astype(np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
        raise InvalidParameterError(
            f"{name} must be a direction, three finite numbers that are not all 0, or one of "
            f"{', '.join(names)}; it is {vector.tolist()}."
        )
    return unit_vector(vector)


def _guess_front(
    mesh: TriangleMesh, upward: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return the level direction of the front, and the direction to the viewer of the usual view."""
    # An open surface that mostly faces one way is a scan, and its front is where the scanner stood.
    points = scale_to_unit(mesh.vertices)[0]
    vectors = area_vectors(points[mesh.faces])
    areas = np.linalg.norm(vectors, axis=1)
    facing = vectors.sum(axis=0) / max(areas.sum(), TINY)
    is_scan = np.linalg.norm(facing) > ONE_WAY
    if is_scan and np.linalg.norm(np.cross(upward, facing)) > 0.1:
        level = facing - (facing @ upward) * upward
        return level / np.linalg.norm(level), facing

    # Else the axis after the upward one, made level where the upward direction is oblique; or the
    # opposite side, if a viewer sees clearly more bending there.
    front = np.eye(3)[(int(np.abs(upward).argmax()) + 1) % 3]
    front = front - (front @ upward) * upward
    front = front / np.linalg.norm(front)
    left = np.cross(upward, front)
    towards, behind = (
        np.array(VIEWS["front-left"]) @ [side * front, side * left, upward] for side in (1, -1)
    )
    # The bending of an edge is its angle times its length, weighted by how far it faces the viewer.
    normals = vectors / np.maximum(areas, TINY)[:, None]
    if np.einsum("ij,ij->", vectors, points[mesh.faces].mean(axis=1)) < 0:
        normals = -normals  # the faces look inward
    table = edge_table(mesh)
    pairs, edges = table.face_pairs
    one, two = normals[pairs].transpose(1, 0, 2)
    angles = np.arccos(np.clip(row_dots(one, two), -1, 1))
    begin, end = points[table.edges[edges]].transpose(1, 0, 2)
    bending = angles * np.linalg.norm(end - begin, axis=1)
    viewers = np.stack([towards, behind])
    before, after = bending @ np.maximum((one + two) @ viewers.T, 0)
    return (-front, behind) if before < LESS * after else (front, towards)


def in_picture(mesh: TriangleMesh, camera: Camera) -> Float[np.ndarray, "n 3"]:
    """Return the vertices in pixels: right, down, and towards the viewer; the shape fills the picture."""
    points = scale_to_unit(mesh.vertices)[0] @ camera.rotation.T
    low, high = points.min(axis=0), points.max(axis=0)
    span = max(float((high - low)[:2].max()), TINY)
    scale = camera.size * (1 - 2 * FREE_BORDER) / span
    return (points - (low + high) / 2) * scale + [camera.size / 2, camera.size / 2, 0.0]
