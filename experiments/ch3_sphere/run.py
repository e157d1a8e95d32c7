"""Eigenvalues and eigenvectors of the unit sphere by eight operators, on more and more points (thesis 3.4, Figure 3.2).

Fibonacci points and kernels of t = e²; then noise along the radius, half an edge length strong, as in Figure 3.3.
"""

import sys
import warnings
from math import isqrt
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.progress import track

import eigenshape as es

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, chart, finish, label, parse_arguments, rounded  # noqa: E402

FULL = {"sizes": (1000, 2000, 4000, 8000, 16000), "k": 300, "noisy": 4000}
QUICK = {"sizes": (1000, 2000), "k": 100, "noisy": 2000}
LITERAL, CORRECTED, LUMPED = "mesh, literal", "mesh, corrected", "cotangent, lumped"
RANDOM_WALK = "mesh, random-walk"
BIASED = (LITERAL, "graph of points")  # dashed: two lines that lie on one another
AREA = 4 * np.pi


def operators(mesh: es.TriangleMesh, t: float) -> dict[str, es.Laplacian]:
    """Return each operator by name; eigenvalues of the last are those of Δ over the area."""
    masses = ("lumped", "consistent", "averaged")
    found = {f"cotangent, {mass}": es.cotangent_laplacian(mesh, mass) for mass in masses}
    found[LITERAL] = es.mesh_laplacian(mesh, t=t)
    found[CORRECTED] = es.mesh_laplacian(mesh, t=t, correct="log")
    found[RANDOM_WALK] = es.mesh_laplacian(mesh, t=t, correct="log", form="random-walk")
    found["points, corrected"] = es.point_cloud_laplacian(
        es.PointCloud(mesh.vertices, 2), t=t, correct="log", form="literal"
    )
    found["graph of points"] = es.operators.gaussian_laplacian(mesh.vertices, t, 2)
    return found


def errors(mesh: es.TriangleMesh, k: int) -> dict:
    """Return n, and by operator the errors of eigenvalues 1 to k - 1, and of eigenvectors in whole eigenspaces."""
    whole = isqrt(k) ** 2  # degrees up to √k - 1 have so many eigenfunctions
    exact, harmonics = (
        es.shapes.sphere_eigenvalues(k + 1),
        es.shapes.sphere_harmonics(mesh.vertices, whole),
    )
    table: dict = {"n": mesh.n_vertices}
    for name, operator in operators(mesh, es.geometry.mean_side_length(mesh) ** 2).items():
        spectrum = es.solve_spectrum(operator, k)
        values = spectrum.eigenvalues * (AREA if name == "graph of points" else 1)
        table[name] = {
            "values": np.abs(values - exact[:k])[1:],
            "relative": np.abs(values[1:] / exact[1:k] - 1),
            "vectors": es.spectral.eigenspace_errors(spectrum, exact[: whole + 1], harmonics)[1:],
            "plain": plain_errors(spectrum.eigenvectors, harmonics)[1:],
        }
    return table


def plain_errors(vectors: np.ndarray, harmonics: np.ndarray) -> np.ndarray:
    """Return the same in the plain dot product, as the thesis measures it."""
    found = []
    for degree in range(isqrt(harmonics.shape[1])):
        group = slice(degree**2, (degree + 1) ** 2)
        basis, _ = np.linalg.qr(harmonics[:, group])
        some = vectors[:, group] / np.linalg.norm(vectors[:, group], axis=0)
        found.append(np.linalg.norm(some - basis @ (basis.T @ some), axis=0))
    return np.concatenate(found)


def noisy_sphere(n: int) -> es.TriangleMesh:
    """Return a sphere whose vertices are moved along the radius, by half an edge length (standard deviation)."""
    mesh = es.shapes.fibonacci_sphere(n)
    heights = 1 + 0.5 * es.geometry.mean_side_length(mesh) * np.random.default_rng(
        0
    ).standard_normal((n, 1))
    return es.TriangleMesh(mesh.vertices * heights, mesh.faces)


def noise_errors(n: int, k: int) -> dict[str, np.ndarray]:
    """Return relative errors of eigenvalues 1 to k - 1 on the noisy sphere, at t of the clean one."""
    mesh, t = noisy_sphere(n), es.geometry.mean_side_length(es.shapes.fibonacci_sphere(n)) ** 2
    heard = {
        CORRECTED: es.mesh_laplacian(mesh, t=t, correct="log"),
        RANDOM_WALK: es.mesh_laplacian(mesh, t=t, correct="log", form="random-walk"),
        LUMPED: es.cotangent_laplacian(mesh, "lumped"),
    }
    exact = es.shapes.sphere_eigenvalues(k)[1:]
    return {
        name: np.abs(es.solve_spectrum(each, k).eigenvalues[1:] / exact - 1)
        for name, each in heard.items()
    }


def scatter(mesh: es.TriangleMesh) -> list[float]:
    """Return how far the weights A_j, and those of Voronoi cells, scatter: standard deviation over mean."""
    cells = es.geometry.shape_quadrature(es.PointCloud(mesh.vertices, 2)).weights
    return [
        float(weights.std() / weights.mean()) for weights in (es.geometry.dual_volumes(mesh), cells)
    ]


def order(edges: list[float], medians: list[float]) -> float:
    """Fit p in error ~ e^p, e the mean edge length."""
    return float(np.polyfit(np.log(edges), np.log(medians), 1)[0])


def summary(edges: list[float], found: list[dict]) -> dict[str, dict]:
    """Return by operator the median and worst errors for each size, and fitted orders."""
    table: dict[str, dict] = {}
    for name in [key for key in found[0] if key != "n"]:
        rows = {
            f"n = {each['n']}": {
                "values": [np.median(each[name]["relative"]), each[name]["relative"].max()],
                "vectors": [np.median(each[name]["vectors"]), each[name]["vectors"].max()],
                "plain": np.median(each[name]["plain"]),
            }
            for each in found
        }
        table[name] = rows | {
            "order": {
                what: order(edges, [row[what][0] for row in rows.values()])
                for what in ("values", "vectors")
            }
        }
    return table


def by_number(panels: dict[str, str], edges: list[float], found: list[dict], what: str) -> Figure:
    """Draw errors by number, one line a size, one panel an operator."""
    figure, axes = chart(10, 4.4, columns=len(panels))
    unit = (
        "$|\\lambda_i - \\lambda_i^D|$, 1/length²"
        if what == "values"
        else "distance to exact eigenspace, 0 to 1"
    )
    for panel, (name, caption) in zip(axes, panels.items(), strict=True):
        for edge, each, color in zip(edges, found, COLORS, strict=False):
            numbers = np.arange(1, 1 + len(each[name][what]))
            shown = f"n = {each['n']:,}, e = {edge:.3f}"
            panel.semilogy(numbers, each[name][what], lw=1, color=color, label=shown)
        label(panel, "number i", unit if panel is axes[0] else "", caption, legend=False)
    axes[-1].legend(frameon=False, fontsize=9, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    figure.suptitle("Unit sphere, Fibonacci points, mean edge length e, t = e²")
    for panel in axes:
        panel.set_ylim(
            min(axis.get_ylim()[0] for axis in axes), max(axis.get_ylim()[1] for axis in axes)
        )
    return figure


def orders(edges: list[float], table: dict[str, dict]) -> Figure:
    """Draw medians by edge length for all operators; the legend says the fitted orders."""
    figure, axes = chart(12, 5, columns=2)
    captions = {
        "values": "eigenvalues, median relative error",
        "vectors": "eigenvectors, median distance to eigenspace",
    }
    for panel, (what, caption) in zip(axes, captions.items(), strict=True):
        for (name, rows), color, marker in zip(table.items(), COLORS, "ov^sDxP+", strict=True):
            medians = [row[what][0] for key, row in rows.items() if key != "order"]
            dashes = "--" if name in BIASED else "-"
            panel.loglog(edges, medians, dashes, marker=marker, ms=5, lw=1.2, color=color)
            panel.lines[-1].set_label(f"{name}: order {rows['order'][what]:.2f}")
        panel.loglog(edges, np.square(edges), ":", color="#777777", lw=1.2, label="e² itself")
        panel.xaxis.set_major_formatter("{x:g}")
        panel.xaxis.set_minor_formatter("{x:g}")
        title = f"Unit sphere, t = e², {caption}"
        label(panel, "mean edge length e, in radii", "error", title, legend=False)
        panel.legend(
            frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2
        )
    return figure


def noise_by_number(n: int, found: dict[str, np.ndarray]) -> Figure:
    """Draw relative errors on the noisy sphere by number."""
    figure, (axes,) = chart()
    for (name, relative), color in zip(found.items(), COLORS, strict=False):
        axes.semilogy(np.arange(1, 1 + len(relative)), relative, lw=1.2, color=color, label=name)
    caption = f"Unit sphere, n = {n:,}, radial noise of half an edge, t = e² of the clean one"
    label(axes, "number i", "relative error of the eigenvalue", caption)
    return figure


def main() -> None:
    """Measure, print, draw."""
    arguments = parse_arguments(__doc__, HERE)
    chosen = QUICK if arguments.quick else FULL
    warnings.simplefilter("ignore")
    meshes, k = [es.shapes.fibonacci_sphere(size) for size in chosen["sizes"]], chosen["k"]
    edges = [es.geometry.mean_side_length(mesh) for mesh in meshes]
    found = [errors(mesh, k) for mesh in track(meshes, description="sizes")]
    table = summary(edges, found)
    n = chosen["noisy"]
    noise = noise_errors(n, k)
    medians = {name: [np.median(relative), relative.max()] for name, relative in noise.items()}
    results = rounded(
        {
            "operators": table,
            "noise": medians,
            "edges": edges,
            "scatter": [scatter(mesh) for mesh in meshes],
        }
    )
    pictures = {
        "figure_eigenvalues": by_number(
            {LITERAL: "mesh Laplacian as printed", CORRECTED: "mesh Laplacian, corrected"},
            edges,
            found,
            "values",
        ),
        "figure_eigenvectors": by_number(
            {
                CORRECTED: "mesh Laplacian, as printed or corrected",
                LUMPED: "cotangent Laplacian, lumped mass",
            },
            edges,
            found,
            "vectors",
        ),
        "figure_orders": orders(edges, table),
        "figure_noise": noise_by_number(n, noise),
        "figure_noisy_sphere": es.plot.figure_poses(
            {
                f"n = {n:,}, clean": es.shapes.fibonacci_sphere(n),
                "moved by half an edge along the radius": noisy_sphere(n),
            }
        ),
    }
    finish(results, pictures, arguments)


if __name__ == "__main__":
    main()
