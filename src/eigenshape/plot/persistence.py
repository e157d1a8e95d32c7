"""Figures of persistence: pairs of birth and death, and how maxima merge."""

import numpy as np
from jaxtyping import Int
from matplotlib.colors import to_hex

from certeig.kit.arguments import require_type
from certeig.kit.arrays import TINY, number_from_zero, whole_number
from eigenshape.features.diagram import PersistenceDiagram, PersistencePairs
from eigenshape.features.region_tree import MergeTree, PartTree
from eigenshape.features.segmentation import merge_targets
from eigenshape.plot.figure import Figure, open_frame
from eigenshape.plot.render import palette

KINDS = {  # color, marker and text of each kind of pair
    "maxima": ("#d62728", "^", "maxima, to the saddle that ends them"),
    "minima": ("#1f77b4", "v", "minima, to the saddle that ends them"),
    "components": ("#2ca02c", "s", "components, lowest to highest point"),
    "loops": ("#9467bd", "o", "loops that nothing fills"),
}
HEADROOM = 1.12  # height of stems that never merge, in units of the highest merge
GUIDE = "#b0b0b0"


def figure_diagram(diagram: PersistenceDiagram, *, label: str = "function") -> Figure:
    """Plot births and deaths of all pairs of a persistence diagram.

    The farther a point lies from the diagonal, the longer its feature persists.

    Parameters
    ----------
    diagram : PersistenceDiagram
    label : str
        Name and unit of the function.

    Returns
    -------
    matplotlib.figure.Figure

    See Also
    --------
    figure_merge_tree : Draw which maximum merges into which.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> diagram = es.features.persistence_diagram(mesh, mesh.vertices[:, 1])
    >>> figure = es.plot.figure_diagram(diagram, label="height")
    >>> figure.axes[0].get_xlabel()
    'birth: height'
    """
    require_type(diagram, PersistenceDiagram, "diagram")
    figure = Figure(6.6, 6.0)
    axes = figure.subplots()
    for kind, (color, marker, text) in KINDS.items():
        pairs: PersistencePairs | None = getattr(diagram, kind)
        if pairs is None or not len(pairs.births):
            continue
        points = axes.scatter(
            pairs.births, pairs.deaths, s=34, marker=marker, c=color, alpha=0.85, zorder=3
        )
        points.set(edgecolor="white", linewidth=0.4, label=f"{text} ({len(pairs.births):,})")
    # The range of the function, widened: no pair leaves that of its component.
    low, high = float(diagram.components.births.min()), float(diagram.components.deaths.max())
    margin = 0.05 * (high - low) or 0.5 * max(abs(high), TINY)
    low, high = low - margin, high + margin
    axes.plot([low, high], [low, high], color=GUIDE, lw=1, zorder=1)
    axes.set(xlim=(low, high), ylim=(low, high), aspect="equal")
    axes.set_xlabel(f"birth: {label}")
    axes.set_ylabel(f"death: {label}")
    axes.legend(frameon=False, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    open_frame(axes)
    return figure


def figure_merge_tree(
    tree: MergeTree | PartTree,
    *,
    persistence: float | None = None,
    n_maxima: int = 40,
    label: str = "function",
) -> Figure:
    """Draw which region merges into which, and at which persistence.

    Regions merge from the bottom to the top, as in `segment`. A cut is a horizontal line: the
    regions whose stems cross it remain, in the colors that `figure_segments` gives them.

    Parameters
    ----------
    tree : MergeTree or PartTree
    persistence : float, optional
        Height of the cut, in the unit of the function, at least 0.
    n_maxima : int
        Number of maxima to draw, the most persistent ones; at least 1.
    label : str
        Name and unit of the function.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If `n_maxima` is below 1, or the persistence negative or NaN.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> tree = es.merge_tree(mesh, abs(mesh.vertices[:, 1]))
    >>> figure = es.plot.figure_merge_tree(tree, persistence=0.5)
    >>> figure.axes[0].get_title()
    'cut at 0.5: 2 regions left'
    """
    require_type(tree, MergeTree | PartTree, "tree")
    shown = min(whole_number(n_maxima, "n_maxima", 1), len(tree.maxima))
    into = merge_targets(tree)[:shown]
    finite = tree.persistence[np.isfinite(tree.persistence)]
    wanted = 0.0 if persistence is None else number_from_zero(persistence, "persistence")
    cut = wanted if np.isfinite(wanted) else 0.0
    top = HEADROOM * max(float(finite.max(initial=0.0)), cut) or 1.0
    figure = Figure(max(4.5, 2.2 + 0.24 * shown), 4.6)
    axes = figure.subplots()
    place = leaf_places(into)
    height = np.minimum(tree.persistence[:shown], top)
    # A cut leaves regions in colors, and the others in gray.
    left = tree.persistence[:shown] >= (persistence or 0.0)
    colors = palette(np.where(left, np.cumsum(left) - 1, -1))
    axes.vlines(place, 0, height, colors=[to_hex(color) for color in colors], lw=2.2, zorder=3)
    merging = into >= 0
    for number in np.flatnonzero(~merging):  # an arrow: upward for ever
        x, y, color = place[number], height[number], colors[number]
        axes.plot(x, y, "^", color=color, markersize=8, clip_on=False, zorder=5)
    axes.hlines(height[merging], place[into[merging]], place[merging], colors=GUIDE, lw=1, zorder=2)
    axes.set_xticks(place, [str(number) for number in range(shown)], fontsize=7)
    axes.set(ylim=(0, top), xlim=(-0.8, shown - 0.2))
    more = len(tree.maxima) - shown
    rest = f" ({more:,} more merge by {tree.persistence[shown - 1]:.3g})" if more else ""
    axes.set_xlabel("number of the maximum, 0 the most persistent" + rest)
    axes.set_ylabel(f"persistence: {label}")
    if persistence is not None:
        n_left = int(np.count_nonzero(tree.persistence >= persistence))
        axes.axhline(min(persistence, top), color="black", lw=1, ls="--", zorder=4)
        axes.set_title(
            f"cut at {persistence:.4g}: {n_left:,} region{'s' * (n_left != 1)} left", fontsize=10
        )
    open_frame(axes)
    return figure


def leaf_places(into: Int[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
    """Return places from left to right at which no stem crosses a bar.

    Each is followed by what merges into it: first what merges first.
    """
    children: dict[int, list[int]] = {}
    for number, target in enumerate(into.tolist()):
        children.setdefault(target, []).append(number)
    order, waiting = [], children.get(-1, [])[::-1]
    while waiting:
        number = waiting.pop()
        order.append(number)
        waiting.extend(children.get(number, []))
    return np.argsort(order)
