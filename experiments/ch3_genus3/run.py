"""Do noise, uneven density or fewer points change a genus 3 surface's spectrum at fixed t? (thesis 3.4, figure 3.3).

The original and four other meshes of it; three forms of the mesh Laplacian at one t, and linear elements. The first 300
eigenvalues above 0 of each mesh against those of the original, by the same operator.
"""

import sys
import warnings
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from meshes import coarser, denser, noisy
from rich.progress import track

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, finish, label, parse_arguments, rounded  # noqa: E402
from real_shapes import DATA, require_data  # noqa: E402
from shape_panels import show_shape  # noqa: E402

import eigenshape as es  # noqa: E402

OPERATORS = ("mesh, as printed", "mesh, corrected", "mesh, random-walk", "cotangent, averaged")
ORIGINAL = "original"


def meshes_of(n_first: int | None, n_coarse: int) -> dict[str, es.TriangleMesh]:
    """Return the original with diameter 1, and its other meshes; the quick form begins with fewer points."""
    raw = es.read_mesh(DATA / "classics" / "genus3.off")
    if n_first:
        raw = coarser(raw, n_first)
    mesh = es.geometry.normalize_mesh(raw, "diameter")
    # made coarser as it was read: what the last digit of a diameter touches is not the same on every CPU
    coarse = coarser(raw, n_coarse)
    right = coarse.vertices[coarse.faces].mean(axis=1)[:, 0] > raw.vertices[:, 0].mean()
    size = es.geometry.mean_side_length(mesh) / es.geometry.mean_side_length(raw)
    coarse = es.TriangleMesh(size * coarse.vertices, coarse.faces)
    return {
        ORIGINAL: mesh,
        "noise, .1 edge": noisy(mesh, 0.1, np.random.default_rng(0)),
        "noise, .5 edge": noisy(mesh, 0.5, np.random.default_rng(0)),
        "non-uniform": denser(coarse, right),
        "coarser": coarse,
    }


def spectra(mesh: es.TriangleMesh, t: float, k: int) -> dict[str, np.ndarray]:
    """Return the k eigenvalues above 0 by each operator, in 1/diameter²."""
    corrected, random_walk, linear = (
        es.solve_spectrum(laplacian, k + 1).eigenvalues[1:]
        for laplacian in (
            es.mesh_laplacian(mesh, t=t, correct="log"),
            es.mesh_laplacian(mesh, t=t, correct="log", form="random-walk"),
            es.cotangent_laplacian(mesh, "averaged"),
        )
    )
    printed = (
        -np.expm1(-t * corrected) / t
    )  # the eigenvalues of the pencil, which the correction started from
    return dict(zip(OPERATORS, (printed, corrected, random_walk, linear), strict=True))


def about(mesh: es.TriangleMesh, original: es.TriangleMesh) -> dict[str, object]:
    """Return what a mesh has kept of the original, and how much longer its edges are."""
    lengths = es.geometry.edge_lengths(mesh)
    return {
        "n": mesh.n_vertices,
        "edge / e": es.geometry.mean_side_length(mesh) / es.geometry.mean_side_length(original),
        "area": es.geometry.surface_area(mesh) / es.geometry.surface_area(original),
        "volume": es.geometry.enclosed_volume(mesh) / es.geometry.enclosed_volume(original),
        "longest / shortest edge": lengths.max() / lengths.min(),
        "closed manifold of genus 3": bool(
            es.geometry.is_manifold(mesh)
            and es.geometry.is_closed(mesh)
            and es.geometry.euler_characteristic(mesh) == -4
        ),
        "crossings": len(es.geometry.self_intersections(mesh)),
    }


def errors(found: dict[str, dict[str, np.ndarray]]) -> dict[str, dict[str, list[float]]]:
    """Return the median and the worst of |λ/λ' - 1| to the original, by mesh and operator."""
    table = {}
    for name, rows in found.items():
        if name == ORIGINAL:
            continue
        relative = {form: np.abs(rows[form] / found[ORIGINAL][form] - 1) for form in OPERATORS}
        table[name] = {form: [np.median(values), values.max()] for form, values in relative.items()}
    return table


def figure_meshes(meshes: dict[str, es.TriangleMesh]) -> Figure:
    """Draw the meshes with their edges, from one side, in the colors of their curves."""
    figure = Figure(figsize=(11, 3.1), layout="constrained", dpi=75)
    camera = es.plot.aim_camera(meshes[ORIGINAL], up="x")
    for axes, (name, mesh), color in zip(
        figure.subplots(1, len(meshes)), meshes.items(), COLORS, strict=False
    ):
        show_shape(axes, mesh, camera, color="#e6e2d8", edges=0.15)
        axes.set_title(f"{name}\nn = {mesh.n_vertices:,}", fontsize=10, color=color)
    return figure


def figure_spectra(found: dict[str, dict[str, np.ndarray]], t: float) -> Figure:
    """Draw the spectra by three operators, and how far they are from the original's."""
    figure = Figure(figsize=(11, 6.4), layout="constrained", dpi=75)
    panels = figure.subplots(2, 3, sharex=True, sharey="row")
    for column, form in enumerate((OPERATORS[0], *OPERATORS[2:])):
        for (name, rows), color in zip(found.items(), COLORS, strict=False):
            index = np.arange(1, len(rows[form]) + 1)
            panels[0, column].plot(index, rows[form], color=color, lw=1.1, label=name)
            if name != ORIGINAL:
                relative = np.abs(rows[form] / found[ORIGINAL][form] - 1)
                panels[1, column].semilogy(index, np.maximum(relative, 1e-4), color=color, lw=0.8)
        caption = f"{form}" + (f", t = e² = {t:.2g}" if form.startswith("mesh") else ", no t")
        label(
            panels[0, column],
            "",
            "λᵢ in 1/diameter²" if column == 0 else "",
            caption,
            legend=column == 0,
        )
        label(
            panels[1, column],
            "index i",
            "|λᵢ / λᵢ of the original - 1|" if column == 0 else "",
            "",
            legend=False,
        )
    for axes in panels.flat:
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    require_data()
    warnings.simplefilter(
        "ignore"
    )  # of the form as printed only the first are told from 1/t: the README says so
    n_first, n_coarse, k = (1800, 1000, 50) if arguments.quick else (None, 3700, 300)
    meshes = meshes_of(n_first, n_coarse)
    t = es.geometry.mean_side_length(meshes[ORIGINAL]) ** 2
    found = {
        name: spectra(mesh, t, k) for name, mesh in track(meshes.items(), description="meshes")
    }
    results = {
        "t": t,
        "meshes": {name: about(mesh, meshes[ORIGINAL]) for name, mesh in meshes.items()},
        "errors": errors(found),
    }
    pictures = (
        {}
        if arguments.quick
        else {"meshes": figure_meshes(meshes), "spectra": figure_spectra(found, t)}
    )
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
