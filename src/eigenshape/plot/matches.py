"""A picture of a map: both shapes, with corresponding points in one color."""

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.matching.shape_match import ShapeMatch
from eigenshape.plot.camera import Up, View, aim_camera
from eigenshape.plot.fields import PANEL, show
from eigenshape.plot.figure import Figure
from eigenshape.plot.render import draw

GRAY = 0.72  # of points that the map is not sure of
# Colors run from this value to 1, so that the shading stays visible.
DARKEST = 0.15


def figure_match(
    part: MeshLike,
    whole: MeshLike,
    match: ShapeMatch,
    *,
    view: View = "auto",
    up: Up = "auto",
) -> Figure:
    """Draw a part and a whole side by side, corresponding points in one color.

    The colors are the coordinates of the whole. Points of the part fade to gray as far as the map
    is not sure of them.

    Parameters
    ----------
    part : MeshLike
        With n vertices.
    whole : MeshLike
    match : ShapeMatch
        Of `match_shapes(part, whole)`.
    view : str or (3,) float
        The side from which each shape is drawn, as in `aim_camera`.
    up : str or (3,) float
        The upward direction of both shapes, as in `aim_camera`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If the match has another number of vertices than the part.

    See Also
    --------
    eigenshape.matching.match_shapes : Compute the map.

    Examples
    --------
    >>> import eigenshape as es
    >>> fish, other = (es.make_creature("fish", pose, n_vertices=500) for pose in (0, 1))
    >>> match = es.match_shapes(fish, other)
    >>> figure = es.plot.figure_match(fish, other, match)
    >>> figure.axes[1].get_title()
    'whole'
    """
    part = as_mesh(part, "part")
    whole = as_mesh(whole, "whole")
    require_type(match, ShapeMatch, "match")
    if match.n_vertices != part.n_vertices:
        raise InvalidParameterError(
            f"The match must be of the part; it has {match.n_vertices} vertices, and the part has "
            f"{part.n_vertices}."
        )
    figure = Figure(figsize=(4.4 * PANEL, 2.2 * PANEL + 0.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    colors = place_colors(whole.vertices)
    sure = match.confidence[:, None]
    pulled = sure * match.pull(colors) + (1 - sure) * GRAY
    show(left, draw(part, aim_camera(part, view=view, up=up), vertex_colors=pulled))
    show(right, draw(whole, aim_camera(whole, view=view, up=up), vertex_colors=colors))
    left.set_title(f"part: {match.confidence.mean():.0%} sure on average", fontsize=10)
    right.set_title("whole", fontsize=10)
    return figure


def place_colors(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Return red, green and blue by the three coordinates, each from its lowest to its highest."""
    low, high = points.min(axis=0), points.max(axis=0)
    shares = (points - low) / np.maximum(high - low, np.finfo(float).tiny)
    return DARKEST + (1 - DARKEST) * shares
