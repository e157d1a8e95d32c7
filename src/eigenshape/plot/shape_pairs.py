"""Pictures of two shapes: a map between them, and a report on how near they are."""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator, NullFormatter

from certeig.kit.arguments import require_type
from certeig.kit.arrays import TINY
from certeig.kit.errors import InvalidParameterError
from eigenshape._vectors import nearest_rotations, scale_to_unit
from eigenshape.geometry.conversion import MeshLike, ShapeLike, as_mesh, as_shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.matching.shape_match import ShapeMatch
from eigenshape.plot.camera import Camera, Up, View, aim_camera
from eigenshape.plot.fields import PANEL, map_colors, show, two_panels
from eigenshape.plot.figure import Figure, open_frame
from eigenshape.plot.render import draw
from eigenshape.plot.spectra import draw_comparison
from eigenshape.stability.report import StabilityReport

GRAY = 0.72  # of points that the map is not sure of
# Colors run from this value to 1, so that the shading stays visible.
DARKEST = 0.15
TRUSTED = "#e4f1e4"


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
    is not sure of them. Both are seen from corresponding sides: the whole is turned like the part
    by the rotation that agrees best with the map.

    Parameters
    ----------
    part : MeshLike
        With n vertices.
    whole : MeshLike
    match : ShapeMatch
        Of `match_shapes(part, whole)`.
    view : str or (3,) float
        The side from which the part is drawn, as in `aim_camera`.
    up : str or (3,) float
        The upward direction of the part, as in `aim_camera`.

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
    figure, left, right = two_panels()
    colors = place_colors(whole.vertices)
    sure = match.confidence[:, None]
    pulled = np.where(match.mapped[:, None], sure * match.pull(colors) + (1 - sure) * GRAY, GRAY)
    camera = aim_camera(part, view=view, up=up)
    turned = Camera(camera.rotation @ _rotation_of_map(part, whole, match).T, camera.size)
    show(left, draw(part, camera, vertex_colors=pulled))
    show(right, draw(whole, turned, vertex_colors=colors))
    average = match.confidence[match.mapped].mean() if match.mapped.any() else 0.0
    left.set_title(f"part: {average:.0%} sure on average", fontsize=10)
    right.set_title("whole", fontsize=10)
    return figure


def _rotation_of_map(
    part: TriangleMesh, whole: TriangleMesh, match: ShapeMatch
) -> Float[np.ndarray, "3 3"]:
    """Return the rotation that takes the part best to where the map sends it (Kabsch 1976)."""
    points, _ = scale_to_unit(part.vertices)
    images = np.nan_to_num(match.pull(scale_to_unit(whole.vertices)[0]))
    weights = (match.confidence * dual_volumes(part))[:, None]
    weights = weights / (weights.sum() or 1.0)
    arms = points - (weights * points).sum(axis=0)
    return nearest_rotations((images.T @ (weights * arms))[None])[0]


def place_colors(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Return red, green and blue by the three coordinates, each from its lowest to its highest."""
    low, high = points.min(axis=0), points.max(axis=0)
    shares = (points - low) / np.maximum(high - low, TINY)
    return DARKEST + (1 - DARKEST) * shares


def figure_stability(
    report: StabilityReport,
    one: ShapeLike,
    two: ShapeLike,
    *,
    titles: tuple[str, str] = ("one", "two"),
    view: View = "auto",
    up: Up = "auto",
) -> Figure:
    """Draw a report on two shapes.

    It shows the shapes colored by the distance from each other, their spectra, the change at each
    heat time, and the angles between their eigenspaces.

    Parameters
    ----------
    report : StabilityReport
        Of `compare_shapes(one, two)`.
    one, two : ShapeLike
        The shapes that were compared. They are drawn if both are triangle meshes.
    titles : (str, str)
        Titles of the two shapes.
    view : str or (3,) float
        The side from which the first shape is drawn, as in `aim_camera`; the other is drawn alike.
    up : str or (3,) float
        The upward direction, as in `aim_camera`.

    Returns
    -------
    matplotlib.figure.Figure

    See Also
    --------
    compare_shapes : Compute the report.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> longer = es.TriangleMesh(ball.vertices * [1, 1, 1.1], ball.faces)
    >>> report = es.compare_shapes(ball, longer, es.stability.StabilityPlan(k=10, n_samples=100))
    >>> figure = es.plot.figure_stability(report, ball, longer, titles=("ball", "longer"))
    >>> figure.axes[0].get_title()
    'ball'
    """
    require_type(report, StabilityReport, "report")
    one = as_shape(one, "one")
    two = as_shape(two, "two")
    drawn = isinstance(one, TriangleMesh) and isinstance(two, TriangleMesh)
    figure = Figure(11, 11.5 if drawn else 8)
    rows = figure.subfigures(
        2 if drawn else 1, 1, squeeze=False, height_ratios=[PANEL, 8] if drawn else None
    )[:, 0]
    if isinstance(one, TriangleMesh) and isinstance(two, TriangleMesh):
        camera = aim_camera(one, view=view, up=up)
        panels = rows[0].subplots(1, 2)
        scale = ScalarMappable(Normalize(0.0, report.distance or 1.0), "viridis")
        shown = zip(panels, (one, two), report.distances, titles, strict=True)
        for axes, mesh, values, title in shown:
            show(axes, draw(mesh, camera, vertex_colors=map_colors(values, scale)))
            axes.set_title(title)
        label = "distance from the other shape, length"
        rows[0].colorbar(scale, ax=panels.tolist(), shrink=0.8, label=label)
    grid = rows[-1].subplots(2, 2)
    draw_comparison(grid[:, 0], report.spectra, titles)
    _draw_times(grid[0, 1], report)
    _draw_angles(grid[1, 1], report)
    for axes in grid.flat:
        open_frame(axes)
    return figure


def _draw_times(axes: Axes, report: StabilityReport) -> None:
    times = np.array([change.t for change in report.changes])
    rows = (
        ("bound", "bound for points at this distance", "^:", "#999999"),
        ("weyl", "Weyl's bound", "s--", "#9467bd"),
        ("change", "between the shapes", "o-", "#d9541e"),
        ("floor", "between two samples of the first", "o-", "#7f7f7f"),
    )
    for name, label, style, color in rows:
        values = [getattr(change, name) for change in report.changes]
        axes.plot(times, values, style, color=color, ms=4, lw=1, label=label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    if not report.times.empty:
        low, high, label = report.times.low, report.times.high, "heat times to trust (green)"
        axes.axvspan(low, high, color=TRUSTED, zorder=0, label=label)
    # The labels of a logarithmic axis overlap if the times span less than a decade.
    shown = times[np.linspace(0, len(times) - 1, min(len(times), 4)).round().astype(int)]
    axes.set_xticks(shown, [f"{time:.3g}" for time in shown])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("heat time t, length²")
    axes.set_ylabel("largest change / last eigenvalue")
    axes.set_title(
        f"graph Laplacians of {report.n_samples} random points on each", fontsize=10, loc="left"
    )
    axes.legend(frameon=False, fontsize=8)


def _draw_angles(axes: Axes, report: StabilityReport) -> None:
    found = report.angles
    middle = (found.starts + found.stops - 1) / 2
    reach = np.maximum((found.stops - 1 - found.starts) / 2, 0.15)
    angles, blue = np.degrees(found.angles), "#1f77b4"
    axes.errorbar(middle, angles, None, reach, "o", ms=4, lw=1.5, color=blue, label="measured")
    if found.bounds is not None:
        bounds, label = np.degrees(found.bounds), "at most, by the gap (90°: none)"
        axes.plot(middle, bounds, "v", ms=4, color="#999999", label=label)
    axes.set_ylim(0, 110)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("numbers of the eigenvalues of a group")
    axes.set_ylabel("largest angle of eigenspaces, degrees")
    where = "vertex to vertex" if report.closeness else "between matched points"
    axes.set_title(f"eigenspaces, {where}", fontsize=10, loc="left")
    axes.legend(frameon=False, fontsize=8, loc="upper left", ncols=2)
