"""A picture of a stability report."""

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import SubFigure
from matplotlib.ticker import MaxNLocator, NullFormatter

from eigenshape._arguments import require_type
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.plot.camera import Camera, Up, View, aim_camera
from eigenshape.plot.fields import PANEL, map_colors, show
from eigenshape.plot.figure import Figure
from eigenshape.plot.render import draw
from eigenshape.plot.spectra import draw_comparison
from eigenshape.stability.report import StabilityReport

TRUSTED = "#e4f1e4"


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
    figure = Figure(figsize=(11, 11.5 if drawn else 8), layout="constrained")
    rows = figure.subfigures(
        2 if drawn else 1, 1, squeeze=False, height_ratios=[PANEL, 8] if drawn else None
    )[:, 0]
    if isinstance(one, TriangleMesh) and isinstance(two, TriangleMesh):
        camera = aim_camera(one, view=view, up=up)
        _draw_shapes(rows[0], report, (one, two), titles, camera)
    grid = rows[-1].subplots(2, 2)
    draw_comparison(grid[:, 0], report.spectra, titles)
    _draw_times(grid[0, 1], report)
    _draw_angles(grid[1, 1], report)
    for axes in grid.flat:
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _draw_shapes(
    figure: SubFigure,
    report: StabilityReport,
    meshes: tuple[TriangleMesh, TriangleMesh],
    titles: tuple[str, str],
    camera: Camera,
) -> None:
    panels = figure.subplots(1, 2)
    scale, colors = Normalize(0.0, report.distance or 1.0), mpl.colormaps["viridis"]
    for axes, mesh, values, title in zip(panels, meshes, report.distances, titles, strict=True):
        show(axes, draw(mesh, camera, vertex_colors=map_colors(values, scale, colors)))
        axes.set_title(title)
    bar = figure.colorbar(ScalarMappable(scale, colors), ax=panels.tolist(), shrink=0.8)
    bar.set_label("distance from the other shape, length")


def _draw_times(axes: Axes, report: StabilityReport) -> None:
    times = np.array([change.t for change in report.changes])
    rows = {
        "bound for points at this distance": (
            [change.bound for change in report.changes],
            "^:",
            "#999999",
        ),
        "Weyl's bound": ([change.weyl for change in report.changes], "s--", "#9467bd"),
        "between the shapes": ([change.change for change in report.changes], "o-", "#d9541e"),
        "between two samples of the first": (
            [change.floor for change in report.changes],
            "o-",
            "#7f7f7f",
        ),
    }
    for name, (values, style, color) in rows.items():
        axes.plot(times, values, style, color=color, ms=4, lw=1, label=name)
    axes.set_xscale("log")
    axes.set_yscale("log")
    if not report.times.empty:
        axes.axvspan(
            report.times.low,
            report.times.high,
            color=TRUSTED,
            zorder=0,
            label="heat times to trust (green)",
        )
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
    axes.errorbar(
        middle,
        np.degrees(found.angles),
        xerr=reach,
        fmt="o",
        ms=4,
        lw=1.5,
        color="#1f77b4",
        label="measured",
    )
    if found.bounds is not None:
        axes.plot(
            middle,
            np.degrees(found.bounds),
            "v",
            ms=4,
            color="#999999",
            label="at most, by the gap (90°: none)",
        )
    axes.set_ylim(0, 110)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("numbers of the eigenvalues of a group")
    axes.set_ylabel("largest angle of eigenspaces, degrees")
    where = "vertex to vertex" if report.closeness else "between matched points"
    axes.set_title(f"eigenspaces, {where}", fontsize=10, loc="left")
    axes.legend(frameon=False, fontsize=8, loc="upper left", ncols=2)
