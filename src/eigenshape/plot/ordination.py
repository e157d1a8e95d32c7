"""Figures of specimens: as points of an ordination with hulls of groups, and by their landmarks."""

from collections.abc import Sequence

import numpy as np
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull, QhullError

from certeig.kit.arrays import as_array, finite_values, real_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import literal
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows
from eigenshape.plot.figure import Figure, open_frame
from eigenshape.plot.render import palette


def figure_ordination(
    scores: ArrayLike,
    groups: ArrayLike | None = None,
    *,
    names: Sequence[str] = (),
    shares: ArrayLike | None = None,
) -> Figure:
    """Plot specimens by their first two scores, with the convex hull of each group.

    Parameters
    ----------
    scores : (n, m) float
        `PrincipalComponents.scores`, or coordinates of another ordination.
    groups : (n,) str or int, optional
        The group of each specimen.
    names : (n,) str, optional
        Names to be written beside the points.
    shares : (m,) float, optional
        `PrincipalComponents.shares`, for the labels of the axes.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidShapeError, InvalidParameterError
        If there are fewer than two columns, or not one group and name for each row.

    See Also
    --------
    es.morphometrics.principal_components

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> scores = np.random.default_rng(0).standard_normal((8, 3))
    >>> figure = es.plot.figure_ordination(scores, list("aaaabbbb"))
    >>> [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    ['a (4)', 'b (4)']
    """
    points = finite_rows(scores, "points")
    labels = as_array(np.zeros(len(points), int) if groups is None else groups, "groups").astype(
        str
    )
    if points.shape[1] < 2 or labels.shape != (len(points),) or len(names) not in (0, len(points)):
        raise InvalidParameterError(
            f"scores must have two columns or more, and groups and names one entry for each row; "
            f"there are {points.shape} scores, {labels.size} groups and {len(names)} names."
        )
    figure = Figure(6.6, 6.0)
    axes = figure.subplots()
    kinds = np.unique(labels)
    for kind, color in zip(kinds, palette(np.arange(len(kinds))), strict=True):
        members = points[labels == kind, :2]
        text = literal(f"{kind} ({len(members)})")
        dots = axes.scatter(members[:, 0], members[:, 1], s=34, color=color, label=text)
        dots.set(edgecolor="white", linewidth=0.4)
        try:
            corners = members[ConvexHull(members).vertices]
        except (QhullError, ValueError):  # fewer than three points, or all on a line
            continue
        axes.add_patch(Polygon(corners, facecolor=(*color, 0.15), edgecolor=color, zorder=0.5))
    for name, point in zip(names, points[:, :2], strict=False):
        axes.annotate(literal(name), point, (3, 3), textcoords="offset points", fontsize=7)
    percents = ["", ""]
    if shares is not None:
        percents = [f" ({100 * share:.0f} %)" for share in finite_values(shares, "shares")[:2]]
    axes.set(xlabel=f"component 1{percents[0]}", ylabel=f"component 2{percents[-1]}")
    axes.set_aspect("equal", adjustable="datalim")
    open_frame(axes)
    if groups is not None:
        axes.legend(frameon=False, fontsize=8)
    return figure


def figure_landmarks(shapes: ArrayLike, *, names: Sequence[str] = ()) -> Figure:
    """Plot the landmarks of all specimens around those of the mean, seen along two of its axes.

    Parameters
    ----------
    shapes : (n, k, 3) float
        `ProcrustesFit.shapes`.
    names : (k,) str, optional
        Names of the landmarks. By default their rows.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If shapes are not finite, or there is not one name for each landmark.

    See Also
    --------
    es.morphometrics.fit_procrustes

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> shapes = np.random.default_rng(0).standard_normal((5, 7, 3))
    >>> figure = es.plot.figure_landmarks(shapes)
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['axis 2', 'axis 3']
    """
    points = real_numbers(shapes, "shapes").astype(np.float64)
    if points.ndim != 3 or points.shape[2] != 3 or not np.isfinite(points).all():
        raise InvalidParameterError(
            f"shapes must be finite, in shape (n, k, 3); the shape is {points.shape}, and "
            f"{np.sum(~np.isfinite(points))} numbers are not finite."
        )
    n_points = points.shape[1]
    texts = list(names) or [str(row) for row in range(n_points)]
    if len(texts) != n_points:
        raise InvalidParameterError(
            f"names must have one entry for each of {n_points} landmarks; there are {len(texts)}."
        )
    mean = points.mean(axis=0)
    middle = mean.mean(axis=0)
    # The longest axis of the mean lies across, in both panels.
    turn = np.linalg.svd(mean - middle)[2].T
    points, mean = (points - middle) @ turn, (mean - middle) @ turn
    figure = Figure(11.0, 5.6)
    for axes, height in zip(figure.subplots(1, 2), (1, 2), strict=True):
        axes.scatter(points[..., 0], points[..., height], s=4, color="0.65")
        axes.scatter(mean[:, 0], mean[:, height], s=22, color="#d62728")
        for text, place in zip(texts, mean[:, [0, height]], strict=True):
            axes.annotate(literal(text), place, (3, 3), textcoords="offset points", fontsize=7)
        axes.set(xlabel="axis 1", ylabel=f"axis {height + 1}")
        axes.set_aspect("equal", adjustable="datalim")
        open_frame(axes)
    return figure
