"""Several shapes in one picture: a query and what answers it, labels copied, poses side by side."""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
from jaxtyping import Int
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize

from certeig.kit.arguments import require_each, require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import vertex_values
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.plot.camera import Camera, Up, View, aim_camera, choose_camera
from eigenshape.plot.fields import PANEL, empty_grid, map_colors, mark, show, two_panels
from eigenshape.plot.figure import Figure
from eigenshape.plot.render import draw, palette
from eigenshape.retrieval.labels.labeled_shape import LabeledShape
from eigenshape.retrieval.labels.transfer import LabelTransfer

POSES_IN_A_ROW = 4  # poses in a row
MOVED = ("#c9c9c9", "#f3c27b", "#d9541e")  # colors of shares 0, 1/2 and 1
MATCHES_IN_A_ROW = 3  # matches in a row at most
NO_MESH = "#808080"


@record
class Panel(ReadOnly):
    """A shape on a contact sheet.

    Attributes
    ----------
    mesh : TriangleMesh or None
        The shape with f faces. If None, the panel has the text "no mesh to draw".
    title : str
        One or two lines.
    colors : (f,) int
        Number of the color of each face. Equal numbers have the same color on all panels; negative
        ones are gray.
    vertices : (m,) int
        Vertices to mark by dots.

    See Also
    --------
    figure_contact_sheet : Draw panels.

    Examples
    --------
    Show two shapes in one picture, with corresponding halves in the same color:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> panels = []
    >>> for title, mesh in [("ball", es.icosphere(1)), ("ring", es.shapes.torus(12, 6))]:
    ...     heights = mesh.vertices[mesh.faces].mean(axis=1)[:, 2]
    ...     halves = (heights > heights.mean()).astype(int)
    ...     highest = mesh.vertices[:, 2].argmax()
    ...     panels.append(es.plot.Panel(mesh, title, halves, np.array([highest])))
    >>> figure = es.plot.figure_contact_sheet(panels[0], panels[1:])
    >>> [axes.get_title() for axes in figure.axes if axes.get_title()]
    ['ball', 'ring']
    """

    mesh: TriangleMesh | None
    title: str
    colors: Int[np.ndarray, " f"]
    vertices: Int[np.ndarray, " m"]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mesh is not None:
            require_type(self.mesh, TriangleMesh, "mesh")


def figure_contact_sheet(
    query: Panel,
    matches: Sequence[Panel],
    *,
    caption: str = "",
    view: View = "auto",
    up: Up = "auto",
) -> Figure:
    """Draw a query beside its matches, as figure 5.1 of the thesis.

    Parameters
    ----------
    query : Panel
        Drawn larger than the matches.
    matches : sequence of Panel
        In reading order, three in a row.
    caption : str
        Title of the whole figure.
    view : str or (3,) float
        The side from which each shape is drawn, as in `aim_camera`.
    up : str or (3,) float
        The upward direction of each shape, as in `aim_camera`.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import numpy as np, eigenshape as es
    >>> mesh = es.icosphere(1)
    >>> colors, marked = np.zeros(mesh.n_faces, dtype=int), np.array([0])
    >>> panel = es.plot.Panel(mesh, "ball", colors, marked)
    >>> figure = es.plot.figure_contact_sheet(panel, [panel, panel], caption="balls")
    >>> figure.get_suptitle()
    'balls'
    """
    require_type(query, Panel, "query")
    require_each(matches, Panel, "matches")
    n_columns = min(max(len(matches), 1), MATCHES_IN_A_ROW)
    n_rows = max(-(-len(matches) // n_columns), 1)
    size = PANEL * (1.0 if n_rows > 1 else 0.9)
    figure = Figure(size * (n_columns + 1.5), size * n_rows + 0.8)
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=[1.5, n_columns])[0]
    left.set_facecolor("#f3f3f3")
    _fill(left.subplots(), query, view, up)
    grid = right.subplots(n_rows, n_columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, panel in zip(grid.flat, matches, strict=False):
        _fill(axes, panel, view, up)
    if caption:
        figure.suptitle(caption, fontsize=11)
    return figure


def _fill(axes: Axes, panel: Panel, view: View, up: Up) -> None:
    axes.set_title(panel.title, fontsize=10)
    if panel.mesh is None:
        axes.text(
            0.5,
            0.5,
            "no mesh to draw",
            ha="center",
            va="center",
            color=NO_MESH,
            transform=axes.transAxes,
        )
        axes.set_axis_off()
        return
    camera = aim_camera(panel.mesh, view=view, up=up, size=440)
    drawing = draw(panel.mesh, camera, face_colors=palette(panel.colors))
    show(axes, drawing)
    mark(axes, drawing, panel.vertices[drawing.visible[panel.vertices]])


def figure_label_transfer(
    labeled: LabeledShape,
    target: MeshLike,
    transfer: LabelTransfer,
    *,
    names: Sequence[str] = (),
    view: View = "auto",
    up: Up = "auto",
) -> Figure:
    """Draw two shapes side by side, equal labels in one color, with their confidence.

    Parameters
    ----------
    labeled : LabeledShape
        The shape that had labels; of several, one of them.
    target : MeshLike
        The mesh that got them.
    transfer : LabelTransfer
        Of `transfer_labels(labeled, target)`.
    names : sequence of str
        The name of label 0, of label 1, and so on. A label without a name is shown as its number.
    view : str or (3,) float
        The side from which each shape is drawn, as in `aim_camera`.
    up : str or (3,) float
        The upward direction of both shapes, as in `aim_camera`.

    Returns
    -------
    matplotlib.figure.Figure

    See Also
    --------
    transfer_labels : Copy labels to another shape.

    Examples
    --------
    >>> import eigenshape as es
    >>> fish, other = (es.make_creature("fish", pose, n_vertices=500) for pose in (0, 1))
    >>> labeled = es.retrieval.LabeledShape(fish, es.find_parts(fish).parts.labels)
    >>> found = es.transfer_labels(labeled, other)
    >>> figure = es.plot.figure_label_transfer(labeled, other, found)
    >>> figure.axes[0].get_title()
    'labeled'
    """
    require_type(labeled, LabeledShape, "labeled")
    target = as_mesh(target, "target")
    require_type(transfer, LabelTransfer, "transfer")
    figure, left, right = two_panels()
    every = np.union1d(labeled.labels, transfer.labels)
    no_vertices = np.empty(0, dtype=np.int64)
    colors = np.searchsorted(every, labeled.labels)
    _fill(left, Panel(labeled.mesh, "labeled", colors, no_vertices), view, up)
    colors = np.searchsorted(every, transfer.labels)
    drawing = draw(target, aim_camera(target, view=view, up=up), face_colors=palette(colors))
    show(right, drawing)
    mark(right, drawing, transfer.part_vertices)
    paper = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}
    for vertex, label, sure in zip(
        transfer.part_vertices, transfer.part_labels, transfer.part_confidence, strict=True
    ):
        name = names[label] if 0 <= label < len(names) else f"label {label}"
        right.annotate(
            f"{name}, {100 * sure:.0f} %",
            drawing.places[vertex],
            (7, 7),
            textcoords="offset points",
            fontsize=8,
            bbox=paper,
        )
    right.set_title("labels copied, with their confidence (hollow: on the far side)", fontsize=10)
    return figure


def figure_poses(
    poses: Mapping[str, MeshLike],
    shares: ArrayLike | None = None,
    *,
    camera: Camera | None = None,
    view: View = "auto",
    up: Up = "auto",
) -> Figure:
    """Draw poses of one shape side by side, in the same view and at the same scale.

    Parameters
    ----------
    poses : mapping of titles to MeshLike
        Poses of one mesh, or of meshes of one shape.
    shares : (n,) float, optional
        How much of a motion each vertex follows, from 0 to 1, such as `Binding.shares`. It sets the
        colors of all poses, which must then have n vertices.
    camera : Camera, optional
        Instead of `view` and `up`.
    view : str or (3,) float
        The side from which the first pose is drawn, as in `aim_camera`; the others are drawn alike.
    up : str or (3,) float
        The upward direction, as in `aim_camera`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If there is no pose, or `shares` does not hold one finite number per vertex of each.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(1)
    >>> egg = es.TriangleMesh(ball.vertices * [1, 1.5, 1], ball.faces)
    >>> figure = es.plot.figure_poses({"ball": ball, "egg": egg})
    >>> [axes.get_title() for axes in figure.axes]
    ['ball', 'egg']
    """
    require_type(poses, Mapping, "poses")
    if not poses:
        raise InvalidParameterError("poses must hold at least one mesh; it is empty.")
    meshes = {title: as_mesh(mesh, title) for title, mesh in poses.items()}
    first = next(iter(meshes.values()))
    camera = choose_camera(first, camera, view, up)
    columns = min(len(poses), POSES_IN_A_ROW)
    size = 1.5 * PANEL if len(poses) <= 2 else PANEL  # a wider figure has titles too small to read
    figure, grid = empty_grid(len(poses), columns, size)
    # The corners of the box that holds all poses, along the axes of the camera
    seen = np.vstack([mesh.vertices @ camera.rotation.T for mesh in meshes.values()])
    sides = zip(seen.min(axis=0), seen.max(axis=0), strict=True)
    corners = np.array(list(product(*sides))) @ camera.rotation
    # a new map for each call, because a map fills its table at first use and threads may share it
    scale = ScalarMappable(Normalize(0, 1), LinearSegmentedColormap.from_list("moved", MOVED))
    for axes, (title, mesh) in zip(grid.flat, meshes.items(), strict=False):
        n = mesh.n_vertices
        values = np.zeros(n) if shares is None else vertex_values(shares, "shares", n)
        colors = map_colors(np.append(values, np.zeros(len(corners))), scale)
        framed = TriangleMesh(np.vstack([mesh.vertices, corners]), mesh.faces)
        show(axes, draw(framed, camera, vertex_colors=colors))
        axes.set_title(title)
    if shares is not None:
        label = "share of the motion"
        figure.colorbar(scale, ax=grid.ravel().tolist(), shrink=0.6, pad=0.01, label=label)
    return figure
