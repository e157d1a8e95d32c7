"""Poses of one shape side by side: the same view, the same scale."""

from collections.abc import Mapping
from itertools import product

import numpy as np
from jaxtyping import Float
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize

from eigenshape._arguments import require_type
from eigenshape._arrays import vertex_values
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.plot.camera import Camera, Up, View, choose_camera
from eigenshape.plot.fields import PANEL, show
from eigenshape.plot.figure import Figure
from eigenshape.plot.render import draw

N_COLUMNS = 4  # poses in a row
MOVED = ("#c9c9c9", "#f3c27b", "#d9541e")  # colors of shares 0, 1/2 and 1


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
    columns = min(len(poses), N_COLUMNS)
    rows = -(-len(poses) // columns)
    size = 1.5 * PANEL
    figure = Figure(figsize=(size * columns + 0.8, (size + 0.3) * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    corners = _frame(list(meshes.values()), camera)
    # a new map for each call, because a map fills its table at first use and threads may share it
    colormap = LinearSegmentedColormap.from_list("moved", MOVED)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, (title, mesh) in zip(grid.flat, meshes.items(), strict=False):
        n = mesh.n_vertices
        values = np.zeros(n) if shares is None else vertex_values(shares, "shares", n)
        colors = np.asarray(colormap(np.append(values, np.zeros(len(corners)))))[:, :3]
        framed = TriangleMesh(np.vstack([mesh.vertices, corners]), mesh.faces)
        show(axes, draw(framed, camera, vertex_colors=colors))
        axes.set_title(title, fontsize=10)
    if shares is not None:
        scale = ScalarMappable(Normalize(0, 1), colormap)
        figure.colorbar(scale, ax=grid.ravel().tolist(), shrink=0.6, pad=0.01).set_label(
            "share of the motion"
        )
    return figure


def _frame(meshes: list[TriangleMesh], camera: Camera) -> Float[np.ndarray, "8 3"]:
    """Return the corners of the box that holds all poses, along the axes of the camera."""
    seen = np.vstack([mesh.vertices @ camera.rotation.T for mesh in meshes])
    return (
        np.array(list(product(*zip(seen.min(axis=0), seen.max(axis=0), strict=True))))
        @ camera.rotation
    )
