"""Shapes drawn into panels beside curves, with or without their edges."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

import eigenshape as es

LIGHT = np.array([-0.35, -0.55, 0.76])  # from the upper left, towards the viewer
AMBIENT = 0.42


def show_shape(
    axes: Axes,
    mesh: es.TriangleMesh,
    camera: es.plot.Camera,
    *,
    color: str = "#c9c9c9",
    edges: float = 0.0,
    reach: float | None = None,
) -> None:
    """Draw a closed surface, far faces first.

    `edges` is the width of their lines in points, `reach` half the height of the panel. Without it
    the shape fills the panel; panels with one `reach` show shapes in one scale.
    """
    seen = (
        mesh.vertices - (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    ) @ camera.rotation.T
    corners = seen[mesh.faces]
    normals = es.geometry.face_normals(mesh) @ camera.rotation.T
    near = np.flatnonzero(normals[:, 2] > 0)
    near = near[np.argsort(corners[near, :, 2].mean(axis=1))]
    bright = AMBIENT + (1.08 - AMBIENT) * np.clip(
        normals[near] @ LIGHT / np.linalg.norm(LIGHT), 0, 1
    )
    faces = np.clip(bright[:, None] * np.array(to_rgb(color)), 0, 1)
    lines = (
        {"edgecolors": "#30343a", "linewidths": edges}
        if edges
        else {"edgecolors": faces, "linewidths": 0.3}
    )
    axes.add_collection(
        PolyCollection(corners[near, :, :2], facecolors=faces, rasterized=True, **lines)
    )
    middle = (seen[:, :2].min(axis=0) + seen[:, :2].max(axis=0)) / 2
    half = reach or 1.04 * np.ptp(seen[:, :2], axis=0).max() / 2
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] + half, middle[1] - half)  # the camera's second axis points down
    axes.set_aspect("equal")
    axes.set_axis_off()
