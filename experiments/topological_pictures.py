"""Pictures of experiments on topological noise: the variants with their regions, spectra, and changes."""

from collections.abc import Mapping, Sequence

import numpy as np
from frame import COLORS, chart, label
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from surgery import Surgery

import eigenshape as es


def figure_variants(surgeries: Mapping[str, Surgery], caption: str) -> Figure:
    """Draw M and each N, the anomalous regions in color."""
    first = next(iter(surgeries.values()))
    query = es.plot.Panel(
        first.one, "M", np.full(first.one.n_faces, -1), np.array([], dtype=np.int64)
    )
    panels = [
        es.plot.Panel(surgery.two, name, np.where(surgery.regions_two < 0, -1, 2), query.vertices)
        for name, surgery in surgeries.items()
    ]
    return es.plot.figure_contact_sheet(query, panels, caption=caption)


def draw_spectra(axes: Axes, spectra: Mapping[str, np.ndarray]) -> None:
    """Draw eigenvalues against their number, M black and dashed above all others."""
    for color, (name, values) in zip(
        COLORS, ((n, v) for n, v in spectra.items() if n != "M"), strict=False
    ):
        axes.plot(np.arange(1, len(values) + 1), values, color=color, label=name, linewidth=1.4)
    axes.plot(np.arange(1, len(spectra["M"]) + 1), spectra["M"], "k--", label="M", linewidth=1)


def draw_differences(axes: Axes, spectra: Mapping[str, np.ndarray]) -> None:
    """Draw λ_i(Q) - λ_i(P) against i."""
    for color, (name, values) in zip(
        COLORS, ((n, v) for n, v in spectra.items() if n != "M"), strict=False
    ):
        axes.plot(
            np.arange(1, len(values) + 1),
            values - spectra["M"],
            color=color,
            label=name,
            linewidth=1.2,
        )
    axes.axhline(0, color="k", linewidth=0.8, linestyle="--")


def draw_changes(
    axes: Axes,
    x: Sequence[float],
    changes: Mapping[str, Mapping],
    key: str,
    *,
    name: str,
    number: int,
) -> ErrorbarContainer:
    """Draw a change against x with its mean over seeds; bars span the seeds."""
    rows = [changes[variant][key] for variant in changes if variant != "M again"]
    mean, least, most = (
        np.array([row[part] for row in rows]) for part in ("mean", "least", "most")
    )
    color = COLORS[number]
    bars = axes.errorbar(
        x,
        mean,
        [mean - least, most - mean],
        color=color,
        label=name,
        marker="o",
        capsize=3,
        markersize=4,
    )
    if "M again" in changes:
        floor = changes["M again"][key]
        axes.axhspan(floor["least"], floor["most"], color=color, alpha=0.15, linewidth=0)
        axes.axhline(
            floor["mean"], color=color, linestyle=":", label="the floor: M against M, other points"
        )
    return bars


def figure_changes(
    runs: Mapping[str, Mapping],
    x: Sequence[float],
    x_label: str,
    *,
    shown: str,
    log: tuple[bool, bool] = (False, True),
) -> Figure:
    """Draw the spectra of one run, how they change, and the changes of all runs against x."""
    figure, panels = chart(14.5, 4.1, columns=3)
    draw_spectra(panels[0], runs[shown]["spectra"])
    label(panels[0], "i", "t vol(M) λ$_i$", f"Eigenvalues, {shown}, first seed")
    draw_differences(panels[1], runs[shown]["spectra"])
    label(panels[1], "i", "t vol(M) (λ$_i$(Q) - λ$_i$(P))", f"Their change, {shown}, first seed")
    for number, (name, run) in enumerate(runs.items()):
        draw_changes(panels[2], x, run["changes"], "largest", name=name, number=number)
    panels[2].set_xscale("log" if log[0] else "linear")
    panels[2].set_yscale("log" if log[1] else "linear")
    k = len(runs[shown]["spectra"]["M"])
    label(
        panels[2],
        x_label,
        f"largest change of t vol(M) λ$_i$, i ≤ {k}",
        "Mean over seeds; bars: least and most",
    )
    panels[2].legend(frameon=False, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.07))
    return figure


def figure_meshes(meshes: Mapping[str, Mapping], operators: Sequence[str], k: int = 20) -> Figure:
    """Draw the first eigenvalues of operators on the meshes."""
    figure, panels = chart(5 * len(operators), 4.2, columns=len(operators))
    for panel, operator in zip(panels, operators, strict=True):
        draw_spectra(panel, {name: values[:k] for name, values in meshes[operator].items()})
        label(panel, "i", "vol(M) λ$_i$", f"{operator}: the first {k} eigenvalues")
    return figure


def figure_bars(runs: Mapping[str, Mapping], *, shown: str) -> Figure:
    """Draw the spectra of one run, how they change, and the changes of all runs for each variant."""
    figure, panels = chart(14.5, 4.6, columns=3)
    draw_spectra(panels[0], runs[shown]["spectra"])
    label(panels[0], "i", "t vol(M) λ$_i$", f"Eigenvalues, {shown}, first seed")
    draw_differences(panels[1], runs[shown]["spectra"])
    label(panels[1], "i", "t vol(M) (λ$_i$(Q) - λ$_i$(P))", f"Their change, {shown}, first seed")
    names = [name for name in runs[shown]["spectra"] if name != "M"]
    for number, (name, run) in enumerate(runs.items()):
        places = np.arange(len(names)) + 0.12 * (number - (len(runs) - 1) / 2)
        draw_changes(panels[2], places, run["changes"], "largest", name=name, number=number)[
            0
        ].set_linestyle("none")
    panels[2].set_yscale("log")
    panels[2].set_xticks(
        np.arange(len(names)), [name.replace(", ", ",\n") for name in names], fontsize=8
    )
    label(
        panels[2], "", "largest change of t vol(M) λ$_i$", "Mean over seeds; bars: least and most"
    )
    panels[2].legend(frameon=False, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.07))
    return figure
