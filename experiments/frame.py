"""What experiments on stability share: their options, how they draw, and how figures and pictures are given out."""

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from outputs import give_out, options_of, output_folder

import eigenshape as es

COLORS = ("#1f77b4", "#d9541e", "#2ca02c", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f", "#17becf")


def parse_arguments(doc: str, folder: Path) -> argparse.Namespace:
    """Read --quick, --out and --figures; pictures go to the experiment's folder unless it is run quickly."""
    parser = options_of(doc)
    parser.add_argument(
        "--figures",
        type=output_folder,
        help="folder for the pictures; by default this experiment's",
    )
    arguments = parser.parse_args()
    if arguments.figures is None and not arguments.quick:
        arguments.figures = folder
    return arguments


def finish(results: object, pictures: Mapping[str, Figure], arguments: argparse.Namespace) -> None:
    """Print the figures, and write them and the pictures (as PNG and SVG) where they were asked for."""
    give_out(results, arguments.out)
    if arguments.figures:
        for name, figure in pictures.items():
            for suffix in ("png", "svg"):
                es.save_figure(figure, arguments.figures / f"{name}.{suffix}")


def chart(
    width: float = 7.5, height: float = 4.6, *, columns: int = 1
) -> tuple[Figure, np.ndarray]:
    """Return a figure and its panels, side by side."""
    figure = Figure(figsize=(width, height), layout="constrained", dpi=110)
    panels = figure.subplots(1, columns, squeeze=False)[0]
    for panel in panels:
        panel.spines[["top", "right"]].set_visible(False)
    return figure, panels


def label(axes: Axes, x: str, y: str, caption: str, *, legend: bool = True) -> None:
    """Name the axes, say in the caption what is shown (with n and t), and explain the lines."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(caption, fontsize=10, loc="left")
    if legend:
        axes.legend(frameon=False, fontsize=8)


def rounded(value: object, digits: int = 4) -> object:
    """Round every float to so many significant digits, for a table in JSON."""
    if isinstance(value, Mapping):
        return {str(key): rounded(item, digits) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return rounded(value.tolist(), digits)
    if isinstance(value, list | tuple):
        return [rounded(item, digits) for item in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.{digits}g}")
    return value
