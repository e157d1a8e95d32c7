"""A map or parcels on both hemispheres of a cortex, in the four usual views."""

from collections.abc import Mapping
from itertools import product

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape.features.parcellation import Parcellation
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.hemispheres import hemisphere_of
from eigenshape.plot.camera import FREE_BORDER, aim_camera
from eigenshape.plot.fields import (
    NO_VALUE,
    PANEL,
    bar_label,
    map_colors,
    show,
    value_scale,
    vertex_field,
)
from eigenshape.plot.figure import Figure
from eigenshape.plot.render import draw

OUTWARD = {"left": -1.0, "right": 1.0}  # x points to the right
PIXELS = 600  # of a side of a drawing; figures of one shape have as many


def figure_cortex(
    surfaces: Mapping[str, MeshLike],
    values: Mapping[str, ArrayLike | Parcellation],
    label: str = "",
    *,
    color_map: str = "viridis",
    limits: tuple[float, float] | None = None,
) -> Figure:
    """Draw a cortex from outside and from inside, with a map and one color bar, or with parcels.

    The upper row shows the lateral sides, the lower one the medial sides. x must point to the right
    of the body, y to the front and z up, as in files of FreeSurfer and the Human Connectome Project.

    Parameters
    ----------
    surfaces : {"left": MeshLike, "right": MeshLike}
        One hemisphere or both, of n vertices each.
    values : {"left": (n,) float, "right": (n,) float}
        A map for each hemisphere, NaN where there is no value, as on the medial wall; that is drawn
        in gray. A `Parcellation` is drawn in its own colors.
    label : str
        Text beside the color bar, such as the name of the map and its unit.
    color_map : str
        Name of a color map of matplotlib.
    limits : (float, float), optional
        Values at the ends of the color bar. The default is the lowest and the highest value of both
        hemispheres.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If the hemispheres of `surfaces` and `values` differ or have other names, a surface lies on
        the other side of x = 0, one hemisphere has a map and the other parcels, a map does not hold
        one number per vertex, all are NaN, or `limits` is not two ascending numbers.

    See Also
    --------
    figure_field : Draw a function on any mesh.
    es.geometry.unmask : Put values on a part of a surface back on the whole, with NaN elsewhere.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> halves = {side: es.TriangleMesh(ball.vertices + [x, 0, 0], ball.faces)
    ...           for side, x in [("left", -2), ("right", 2)]}
    >>> maps = {side: ball.vertices[:, 2] for side in halves}
    >>> figure = es.plot.figure_cortex(halves, maps, "height")
    >>> [axes.get_title() for axes in figure.axes[:4]]
    ['left, lateral', 'right, lateral', 'left, medial', 'right, medial']
    """
    require_type(surfaces, Mapping, "surfaces")
    require_type(values, Mapping, "values")
    meshes = {side: as_mesh(surfaces[side], side) for side in OUTWARD if side in surfaces}
    if not meshes or len(meshes) < len(surfaces) or meshes.keys() != values.keys():
        raise InvalidParameterError(
            f"surfaces and values must be of 'left', 'right' or both; they are of {list(surfaces)} and "
            f"{list(values)}."
        )
    for side, mesh in meshes.items():
        found = hemisphere_of(mesh)
        if found not in (side, ""):
            raise InvalidParameterError(
                f"The {side} surface must lie on the {side}; it lies on the {found}, x "
                f"{'<' if found == 'left' else '>'} 0. Name it {found!r}."
            )
    parcels = {side: each for side, each in values.items() if isinstance(each, Parcellation)}
    maps = {side: each for side, each in values.items() if not isinstance(each, Parcellation)}
    if parcels and maps:
        raise InvalidParameterError(
            "Both hemispheres must have maps, or both parcels; only the "
            f"{next(iter(parcels))} one has parcels."
        )
    bar = None
    shades = {side: _parcel_colors(each, meshes[side]) for side, each in parcels.items()}
    if maps:
        fields = {side: vertex_field(each, meshes[side]) for side, each in maps.items()}
        numbers = np.concatenate([field.filled(np.nan) for field in fields.values()])
        together = np.ma.masked_invalid(numbers)
        bar, extend = value_scale(together, limits, color_map)
        shades = {side: map_colors(field, bar) for side, field in fields.items()}

    # Both hemispheres are drawn in one box, so that they have one scale. Of the square drawings,
    # only the height of that box is shown.
    halves = [np.ptp(mesh.vertices, axis=0) / 2 for mesh in meshes.values()]
    half = np.max(halves, axis=0)
    _, depth, height = half
    share = 2 * FREE_BORDER + (1 - 2 * FREE_BORDER) * height / max(depth, height)
    width = 1.4 * PANEL * len(meshes) + (1.0 if bar else 0.2)
    figure = Figure(width, 2 * (1.4 * PANEL * share + 0.3))
    grid = figure.subplots(2, len(meshes), squeeze=False)
    for column, (side, mesh) in enumerate(meshes.items()):
        middle = mesh.vertices.min(axis=0) + np.ptp(mesh.vertices, axis=0) / 2
        corners = middle + half * list(product((-1, 1), repeat=3))
        framed = TriangleMesh(np.vstack([mesh.vertices, corners]), mesh.faces)
        for row, (title, sign) in enumerate((("lateral", 1), ("medial", -1))):
            camera = aim_camera(mesh, view=[sign * OUTWARD[side], 0, 0], up="z", size=PIXELS)
            if bar is None:
                drawing = draw(framed, camera, face_colors=shades[side])
            else:
                more = np.zeros((len(corners), 3))
                drawing = draw(framed, camera, vertex_colors=np.vstack([shades[side], more]))
            show(grid[row, column], drawing)
            grid[row, column].set_ylim(PIXELS * (1 + share) / 2, PIXELS * (1 - share) / 2)
            grid[row, column].set_title(f"{side}, {title}", fontsize=10)
    if bar is not None:
        text = bar_label(label, together)
        figure.colorbar(bar, ax=grid, shrink=0.6, extend=extend, label=text)
    return figure


def _parcel_colors(parcellation: Parcellation, mesh: TriangleMesh) -> Float[np.ndarray, "f 3"]:
    """Return the color of the parcel that most corners of a face belong to."""
    require_type(parcellation, Parcellation, "parcellation")
    parcellation.require_vertices(mesh.n_vertices)
    first, second, third = parcellation.labels[mesh.faces].T
    gray = [[float(NO_VALUE)] * 3]  # which the label -1 finds
    colors = np.concatenate([parcellation.colors[:, :3], gray])
    return colors[np.where(second == third, second, first)]
