"""How far do eigenvalues change from pose to pose, and from shape to shape? (thesis 3.4, figure 3.4).

Eleven poses of one cat by four operators; then eleven families of poses, each two shapes compared. Eigenvalues above 0,
times the area, one by one.
"""

import sys
import warnings
from itertools import combinations
from pathlib import Path

import numpy as np
from families import (
    FAMILIES,
    by_kind,
    difference,
    family_rows,
    mean_differences,
    paths_of,
    separation,
)
from matplotlib.figure import Figure
from rich.progress import track

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, finish, label, parse_arguments, rounded  # noqa: E402
from real_shapes import DATA, require_data  # noqa: E402
from shape_panels import show_shape  # noqa: E402

import eigenshape as es  # noqa: E402

SHAPES = DATA / "retrieval"
OPERATORS = {
    "cotangent, averaged": lambda mesh: es.cotangent_laplacian(mesh, "averaged"),
    "cotangent, lumped": es.cotangent_laplacian,
    "mesh, Euclidean": lambda mesh: es.mesh_laplacian(mesh, correct="log"),
    "mesh, geodesic": lambda mesh: es.mesh_laplacian(mesh, correct="log", distance="geodesic"),
}
KERNELS = ("mesh, Euclidean", "mesh, geodesic")
SOME = {
    "david": 3,
    "horse": 2,
}  # poses that kernels hear beside the cat's: they take ten times as long
DRAWN = ("michael0", "michael2", "michael5", "michael10", "michael16", "cat0", "horse0")


def spectra(paths: list[Path], name: str, n_values: int) -> np.ndarray:
    """Return the eigenvalues above 0 of all shapes, without unit."""
    rows = []
    for path in track(paths, description=f"{name}: {paths[0].stem}"):
        mesh = es.read_mesh(path)
        values = es.solve_spectrum(OPERATORS[name](mesh), n_values + 1).eigenvalues[1:]
        rows.append(values * es.geometry.surface_area(mesh))
    return np.array(rows)


def table_row(rows: np.ndarray) -> dict[str, float]:
    """Return how far each two poses differ, over all pairs and eigenvalues."""
    found = np.array([difference(*pair) for pair in combinations(rows, 2)])
    return {
        "median": np.median(found),
        "90 %": np.quantile(found, 0.9),
        "median of pairs' worst": np.median(found.max(axis=1)),
    }


def leaks(mesh: es.TriangleMesh) -> np.ndarray:
    """Return at each vertex the share of its Euclidean kernel that belongs to points out of reach along the surface."""
    along = es.mesh_laplacian(mesh, distance="geodesic").stiffness
    near = along.copy()
    near.data[:] = 1
    through_space = es.mesh_laplacian(mesh).stiffness
    weights = np.array(-through_space.sum(axis=1) + through_space.diagonal())
    kept = through_space.multiply(near)
    return 1 - np.array(-kept.sum(axis=1) + kept.diagonal()) / weights


def by_kernels(cats: dict[str, np.ndarray]) -> dict[str, dict[str, float]]:
    """Return what kernels hear of poses of a man and of a horse, and between man and cat."""
    table = {}
    for name in KERNELS:
        heard = {
            family: spectra(paths_of(family, SHAPES, most), name, 100)
            for family, most in SOME.items()
        }
        found = mean_differences({"cat": cats[name], "david": heard["david"]})
        table[name] = {
            "cat": found["cat", "cat"].mean(),
            "david": found["david", "david"].mean(),
            "cat and david": found["cat", "david"].mean(),
            "horse, lowest eigenvalue": heard["horse"][:, 0].min(),
        }
    return table


def drawn_paths() -> list[Path]:
    """Return the shapes of the picture: five poses of a man, a cat and a horse."""
    return [next(SHAPES.glob(f"*/tosca_{name}.ply")) for name in DRAWN]


def figure_classical(rows: dict[str, np.ndarray]) -> Figure:
    """Draw five poses and two other shapes in a row, their spectra below, and how far these are from the first."""
    paths = drawn_paths()
    figure = Figure(figsize=(11, 6.6), layout="constrained", dpi=80)
    above, below = figure.subfigures(2, 1, height_ratios=[1, 1.9])
    for axes, path, color in zip(above.subplots(1, len(paths)), paths, COLORS, strict=False):
        mesh = es.read_mesh(path)
        show_shape(axes, mesh, es.plot.aim_camera(mesh, up="z"), color=color)
        axes.set_title(path.stem.removeprefix("tosca_"), fontsize=9)
    left, right = below.subplots(1, 2)
    index = np.arange(1, 101)
    for name, color in zip(DRAWN, COLORS, strict=False):
        style = {"color": color, "lw": 1.2, "ls": "-" if name.startswith("michael") else "--"}
        left.plot(index, rows[name], label=name, **style)
        if name != DRAWN[0]:
            right.semilogy(
                index, np.maximum(difference(rows[name], rows[DRAWN[0]]), 1e-4), label=name, **style
            )
    label(left, "index i", "λᵢ · area (no unit)", "five poses (solid), two other shapes (dashed)")
    label(
        right,
        "index i",
        f"|λᵢ/λ'ᵢ - 1| to {DRAWN[0]}",
        "cotangent, averaged; n = 5,000; no t",
        legend=False,
    )
    right.set_ylim(1e-4, 1)
    return figure


def figure_separation(found: dict[tuple[str, str], np.ndarray]) -> Figure:
    """Draw how pairs of each kind spread, and the mean between families."""
    figure = Figure(figsize=(11, 5), layout="constrained", dpi=100)
    left, right = figure.subplots(1, 2, width_ratios=[1, 1.15])
    bins = np.geomspace(0.004, 0.2, 45)
    for (name, values), color in zip(by_kind(found).items(), COLORS, strict=False):
        weights = np.full(len(values), 100 / len(values))
        left.hist(
            values,
            bins,
            weights=weights,
            color=color,
            alpha=0.6,
            label=f"{name} ({len(values):,} pairs)",
        )
    left.set_xscale("log")
    left.set_xticks(
        [0.005, 0.01, 0.02, 0.05, 0.1, 0.2], ["0.005", "0.01", "0.02", "0.05", "0.1", "0.2"]
    )
    left.minorticks_off()
    left.spines[["top", "right"]].set_visible(False)
    label(
        left,
        "mean |λᵢ/λ'ᵢ - 1| of 100 eigenvalues",
        "% of the pairs of a kind",
        "cotangent, averaged; 108 shapes",
    )
    names = list(FAMILIES)
    means = np.array(
        [[found[(a, b) if (a, b) in found else (b, a)].mean() for b in names] for a in names]
    )
    picture = right.imshow(means, cmap="viridis_r", vmin=0)
    for (row, column), value in np.ndenumerate(means):
        color = "white" if value > 0.08 else "black"
        right.text(
            column, row, f"{100 * value:.1f}", ha="center", va="center", fontsize=7, color=color
        )
    right.set_xticks(range(len(names)), names, rotation=60, ha="right")
    right.set_yticks(range(len(names)), names)
    right.set_title("mean over the pairs of two families, in %", fontsize=10, loc="left")
    figure.colorbar(picture, ax=right, shrink=0.8).set_label("mean |λᵢ/λ'ᵢ - 1|")
    return figure


def figure_leak(paths: list[Path], shares: dict[str, float]) -> Figure:
    """Draw where the Euclidean kernel of the worst pose leaks."""
    worst = es.read_mesh(max(paths, key=lambda path: shares[path.stem]))
    camera = es.plot.aim_camera(worst, up="z")
    figure = es.figure_field(
        worst, leaks(worst), "share of the kernel out of reach along the surface", camera=camera
    )
    figure.set_dpi(70)
    return figure


def quick() -> dict[str, object]:
    """Compare two poses each of a cat, a man and a horse by thirty eigenvalues."""
    names, operator = ("cat", "david", "horse"), "cotangent, averaged"
    found = mean_differences(
        {name: spectra(paths_of(name, SHAPES, 2), operator, 30) for name in names}
    )
    return {"families": family_rows(found), "separation": separation(found)}


def full() -> tuple[dict[str, object], dict[str, Figure]]:
    """Compare the cats by all operators and all families by linear elements; draw three pictures."""
    averaged = {
        name: spectra(paths_of(name, SHAPES), "cotangent, averaged", 100) for name in FAMILIES
    }
    paths = paths_of("cat", SHAPES)
    cats = {"cotangent, averaged": averaged["cat"]}
    cats |= {name: spectra(paths, name, 100) for name in OPERATORS if name not in cats}
    shares = {
        path.stem: float(np.mean(leaks(es.read_mesh(path)) > 0.1))
        for path in track(paths, description="leaks")
    }
    found = mean_differences(averaged)
    rows = {
        path.stem.removeprefix("tosca_"): row
        for name in FAMILIES
        for path, row in zip(paths_of(name, SHAPES), averaged[name], strict=True)
    }
    results = {
        "differences": {name: table_row(cats[name]) for name in OPERATORS},
        "leaks": shares,
        "families": family_rows(found),
        "separation": separation(found),
        "kernels": by_kernels(cats),
    }
    pictures = {
        "spectra": figure_classical(rows),
        "separation": figure_separation(found),
        "leak": figure_leak(paths, shares),
    }
    return results, pictures


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    require_data()
    warnings.simplefilter("ignore")
    results, pictures = (quick(), {}) if arguments.quick else full()
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
