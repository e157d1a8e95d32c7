"""The pictures of the bounds: changes against δ, beside what theory allows."""

from itertools import product

import numpy as np
from fitted_rates import bounding_rate
from frame import COLORS, chart, label
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

import eigenshape as es

DIM = 2
STYLES = {"mesh, literal": "o-", "mesh, corrected": "s--", "cotangent, lumped": "^:"}


def columns(rows: list[dict], *names: str) -> list[np.ndarray]:
    """Return some columns of a table."""
    return [np.array([row[name] for row in rows]) for name in names]


def figure_law(points: list[dict], samples: list[dict], setup: dict) -> Figure:
    """Draw the change against δ at each t with the bounds, and all of them on one curve of δ/√t."""
    figure, (left, right) = chart(12, 5, columns=2)
    law, ours, dense = (
        es.stability.theorem_rate(name, DIM) for name in ("4.3.1", "lipschitz", "dense")
    )
    for t, color in zip(setup["times"], COLORS, strict=False):
        here = [row for row in points if row["t"] == t]
        deltas = np.unique(columns(here, "delta")[0])
        by_delta = [
            columns([row for row in here if row["delta"] == d], "change")[0] for d in deltas
        ]
        means = np.array([each.mean() for each in by_delta])
        spans = np.abs([[each.min(), each.max()] for each in by_delta] - means[:, None]).T
        left.errorbar(
            deltas, means, spans, fmt="o", ms=4, color=color, label=f"measured, t = {t:g}"
        )
        left.plot(deltas, ours.at(deltas, t), "-", lw=1, color=color)
        left.plot(deltas, dense.at(deltas, t), "--", lw=1, color=color)
        left.plot(
            deltas,
            bounding_rate(law, deltas[:1], [t], means[:1]).at(deltas, t),
            ":",
            lw=1,
            color=color,
        )
        right.plot(deltas / t**0.5, means * t, "o-", ms=4, lw=0.8, color=color, label=f"t = {t:g}")
    left.plot([], [], "-", color="gray", label="our bound, δ t$^{-5/2}$ with its constant")
    left.plot([], [], "--", color="gray", label="our bound for dense samples, 3.54 δ t$^{-3/2}$")
    left.plot([], [], ":", color="gray", label="slope of Theorem 4.3.1, δ$^{4/5}$ t$^{-12/5}$")
    t = samples[0]["t"]
    deltas, changes = columns(samples, "delta", "change")
    right.plot(deltas / t**0.5, changes * t, "k^", ms=4, label="independent samples, matched")
    ends = np.array(right.get_xlim())
    right.plot(
        ends, dense.constant * ends, "--", lw=1, color="gray", label="our bound for dense samples"
    )
    right.axvspan(
        1, right.get_xlim()[1], color="#f5e3df", zorder=0, label="t < δ², which the theorem forbids"
    )
    for axes in (left, right):
        axes.set_xscale("log")
        axes.set_yscale("log")
    n = setup["points"]
    label(
        left,
        "δ, by how much each point moves (area 1)",
        "largest change of an eigenvalue (mean; bars: least and most)",
        f"All {n} eigenvalues of the graph Laplacian, torus of area 1",
    )
    label(right, "δ / √t", "t × largest change of an eigenvalue", "All times on one curve")
    return figure


def figure_forbidden(points: list[dict], setup: dict) -> Figure:
    """Draw the relative change of the ten lowest eigenvalues against δ/√t."""
    figure, (axes,) = chart()
    for t, color in zip(setup["times"], COLORS, strict=False):
        ratio, low = columns([row for row in points if row["t"] == t], "delta", "lowest")
        axes.plot(ratio / t**0.5, low, "o", ms=4, color=color, label=f"t = {t:g}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.axvspan(
        1, axes.get_xlim()[1], color="#f5e3df", zorder=0, label="t < δ², which the theorem forbids"
    )
    axes.axhline(1, color="gray", lw=0.8, ls="--")
    label(
        axes,
        "δ / √t",
        "relative change, mean of eigenvalues 1 to 10",
        f"Below t = δ² the lowest eigenvalues are lost (n = {setup['points']}, torus of area 1)",
    )
    return figure


def figure_surfaces(surfaces: list[dict], setup: dict) -> Figure:
    """Draw how far spectra are apart, number by number and as sets, against δ_H for each operator."""
    figure, panels = chart(12, 5, columns=2)
    for axes, measured in zip(panels, ("change", "hausdorff"), strict=True):
        for name, t in product(STYLES, setup["mesh times"]):
            rows = [row for row in surfaces if row["operator"] == name and row["t"] == t]
            if rows:
                deltas, distances = columns(rows, "delta", measured)
                without_t = name.startswith("cotangent")
                color = "black" if without_t else COLORS[setup["mesh times"].index(t)]
                told = name if without_t else f"{name}, t = {t:g}"
                axes.plot(deltas, distances, STYLES[name], ms=4, lw=1, color=color, label=told)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
    n = setup["mesh"][0] * setup["mesh"][1]
    what = f"First {setup['k']} eigenvalues of a mesh that moves smoothly, n = {n}"
    x = "δ_H, displacement or change of area (area 1)"
    label(panels[0], x, "largest |λ$_i$ - ω$_i$|, 1/length²", what)
    label(
        panels[1],
        x,
        "Hausdorff distance, 1/length²",
        "The same, as sets: gaps are about 12",
        legend=False,
    )
    return figure
