"""Pictures of experiments on topological noise: the variants with their regions, spectra, and changes."""

from collections.abc import Mapping, Sequence

import numpy as np
from frame import COLORS
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from surgery import Surgery

import eigenshape as es


def figure_variants(surgeries: Mapping[str, Surgery], caption: str) -> Figure:
    """Draw M and each N, the anomalous regions in colour."""
    first = next(iter(surgeries.values()))
    query = es.Panel(first.one, "M", np.full(first.one.n_faces, -1), np.array([], dtype=np.int64))
    panels = [
        es.Panel(surgery.two, name, np.where(surgery.regions_two < 0, -1, 2), query.vertices)
        for name, surgery in surgeries.items()
    ]
    return es.figure_contact_sheet(query, panels, caption=caption)


def draw_spectra(axes: Axes, spectra: Mapping[str, np.ndarray]) -> None:
    """Draw eigenvalues against their number, M black and dashed above all others."""
    for color, (name, values) in zip(COLORS, ((n, v) for n, v in spectra.items() if n != "M"), strict=False):
        axes.plot(np.arange(1, len(values) + 1), values, color=color, label=name, linewidth=1.4)
    axes.plot(np.arange(1, len(spectra["M"]) + 1), spectra["M"], "k--", label="M", linewidth=1)


def draw_differences(axes: Axes, spectra: Mapping[str, np.ndarray]) -> None:
    """Draw λ_i(Q) - λ_i(P) against i."""
    for color, (name, values) in zip(COLORS, ((n, v) for n, v in spectra.items() if n != "M"), strict=False):
        axes.plot(np.arange(1, len(values) + 1), values - spectra["M"], color=color, label=name, linewidth=1.2)
    axes.axhline(0, color="k", linewidth=0.8, linestyle="--")


def draw_changes(
    axes: Axes, x: Sequence[float], changes: Mapping[str, Mapping], key: str, *, name: str, number: int
) -> None:
    """Draw a change against x with its mean over seeds; bars span the seeds."""
    rows = [changes[variant][key] for variant in changes if variant != "M again"]
    mean, least, most = (np.array([row[part] for row in rows]) for part in ("mean", "least", "most"))
    color = COLORS[number]
    axes.errorbar(x, mean, [mean - least, most - mean], color=color, label=name, marker="o", capsize=3, markersize=4)
    if "M again" in changes:
        floor = changes["M again"][key]
        axes.axhspan(floor["least"], floor["most"], color=color, alpha=0.15, linewidth=0)
        axes.axhline(floor["mean"], color=color, linestyle=":", label="the floor: M against M, other points")
