"""How the spectrum of an eight loop changes while the loop is deformed (thesis 3.4, figure 3.5).

Space is moved by x + s v(x), s from 0 to 1: one ring grows, the other shrinks. At each step the first thirty
eigenvalues above 0 are compared with those of the step before, with how far the surface moved, and with two bounds.
"""

import sys
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.progress import track
from scipy.spatial import cKDTree

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, finish, label, parse_arguments, rounded  # noqa: E402
from real_shapes import DATA, require_data  # noqa: E402
from shape_panels import show_shape  # noqa: E402

import eigenshape as es  # noqa: E402

K = 30
SIDE, ALONG = (
    1.5,
    0.75,
)  # of the field v: how quickly rings thicken, and move along z, in 1/diameter
CLASSES = (
    "even in x, even in y",
    "even in x, odd in y",
    "odd in x, even in y",
    "odd in x, odd in y",
)


def eight() -> es.TriangleMesh:
    """Return the loop with diameter 1, its middle at the origin, its rings along z."""
    mesh = es.geometry.normalize_mesh(es.read_mesh(DATA / "classics" / "eight.off"), "diameter")
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    return es.TriangleMesh(mesh.vertices - middle, mesh.faces)


def moved(mesh: es.TriangleMesh, s: float) -> es.TriangleMesh:
    """Return x + s v(x) with v = (1.5 x z, 1.5 y z, .75 z²), which keeps both mirror planes of the loop."""
    x, y, z = mesh.vertices.T
    return es.TriangleMesh(
        mesh.vertices + s * np.column_stack([SIDE * x * z, SIDE * y * z, ALONG * z * z]), mesh.faces
    )


def symmetric_matrix(laplacian: es.Laplacian) -> np.ndarray:
    """Return B^{-1/2} W B^{-1/2}, whose eigenvalues are those of the pencil."""
    roots = np.sqrt(laplacian.mass.diagonal())
    return laplacian.stiffness.toarray() / roots[:, None] / roots[None, :]


def stretches(mesh: es.TriangleMesh, other: es.TriangleMesh) -> np.ndarray:
    """Return the two singular values of the map between equal faces, the larger first: (f, 2)."""
    sides = [np.diff(each.vertices[each.faces], axis=1) for each in (mesh, other)]
    before, after = (np.einsum("fij,fkj->fik", side, side) for side in sides)
    return np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(before, after)).real, axis=1)[:, ::-1])


def step_sizes(one: es.TriangleMesh, other: es.TriangleMesh) -> tuple[float, float]:
    """Return δ_H of a step (thesis 3.1), and how much it can change an eigenvalue of linear elements: a factor less 1.

    δ_H is the larger of the farthest motion, in diameters, and of |J - 1|, J the ratio of areas. On a face stretched by
    a ≥ b energy changes by a factor in [b/a, a/b] and mass by ab, and so do Rayleigh quotients: that bounds λ.
    """
    long, short = stretches(one, other).T
    farthest = np.linalg.norm(other.vertices - one.vertices, axis=1).max()
    energy, mass = np.log(long / short).max(), np.abs(np.log(long * short)).max()
    return max(farthest, np.abs(long * short - 1).max()), float(np.expm1(energy + mass))


def mirror_classes(mesh: es.TriangleMesh, spectrum: es.Spectrum) -> np.ndarray:
    """Say which mirror image each eigenfunction is nearest to: its place in `CLASSES`."""
    tree, functions = cKDTree(mesh.vertices), spectrum.eigenvectors[:, 1:]
    odd = []
    for axis in (0, 1):
        mirrored = mesh.vertices * np.where(np.arange(3) == axis, -1, 1)
        image = functions[tree.query(mirrored)[1]]
        odd.append(np.einsum("nk,nk->k", functions, spectrum.mass @ image) < 0)
    return 2 * odd[0] + odd[1]


def tracks(n_steps: int) -> dict[str, np.ndarray]:
    """Return what is known at each of n + 1 moments, and at each of the n steps between them."""
    start = eight()
    t = es.geometry.mean_side_length(start) ** 2
    meshes = [moved(start, s) for s in np.linspace(0, 1, n_steps + 1)]
    kernel, linear, classes, matrices, crossing = [], [], [], [], 0
    for mesh in track(meshes, description="moments"):
        crossing += len(es.geometry.self_intersections(mesh))
        literal = es.mesh_laplacian(mesh, t=t)
        matrices.append(symmetric_matrix(literal))
        kernel.append(es.solve_spectrum(literal, K + 1).eigenvalues[1:])
        spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh, "averaged"), K + 1)
        linear.append(spectrum.eigenvalues[1:])
        classes.append(mirror_classes(start, spectrum))
    return {
        "matrices": np.array(matrices),
        "mesh": np.array(kernel),
        "cotangent": np.array(linear),
        "classes": np.array(classes),
        "points": np.array([mesh.vertices for mesh in meshes]),
        "crossing": np.array(crossing),
    }


def continuity(found: dict[str, np.ndarray], every: int) -> dict[str, float]:
    """Return the largest changes of a step, over δ_H, and how much of its bound each operator's change takes."""
    faces = eight().faces
    meshes = [es.TriangleMesh(points, faces) for points in found["points"][::every]]
    delta, factors = np.array([step_sizes(one, other) for one, other in pairwise(meshes)]).T
    row = {"largest δ": delta.max()}
    for name in ("mesh", "cotangent"):
        values = found[name][::every]
        change = np.abs(np.diff(values, axis=0) / values[:-1]).max(axis=1)
        row |= {
            f"{name}: largest change": change.max(),
            f"{name}: change / δ": (change / delta).max(),
        }
    weyl = [
        np.abs(np.linalg.eigvalsh(b - a)[[0, -1]]).max()
        for a, b in pairwise(found["matrices"][::every])
    ]
    absolute = np.abs(np.diff(found["mesh"][::every], axis=0)).max(axis=1)
    row["mesh: change / Weyl's bound"] = (absolute / weyl).max()
    values = found["cotangent"][::every]
    ratio = np.exp(np.abs(np.diff(np.log(values), axis=0)).max(axis=1)) - 1
    row["cotangent: change / bound"] = (ratio / factors).max()
    return row


def handovers(classes: np.ndarray) -> int:
    """Count the steps at which two eigenvalues that follow each other exchange their classes."""
    before, after = classes[:-1], classes[1:]
    swapped = (before[:, :-1] == after[:, 1:]) & (before[:, 1:] == after[:, :-1])
    return int((swapped & (before[:, :-1] != before[:, 1:])).sum())


def measure(found: dict[str, np.ndarray], most: int) -> dict[str, object]:
    """Return the rows of all step sizes, and what happened on the whole way."""
    rows = {str(n): continuity(found, most // n) for n in (most // 4, most // 2, most)}
    gaps = np.diff(found["cotangent"], axis=1) / found["cotangent"][:, :-1]
    names = ("mesh", "cotangent")
    return {
        "steps": rows,
        "faces that cross": int(found["crossing"]),
        "largest change on the way": {
            n: np.abs(found[n][-1] / found[n][0] - 1).max() for n in names
        },
        "exchanges": handovers(found["classes"]),
        "smallest gap": gaps.min(),
    }


def figure_tracks(found: dict[str, np.ndarray]) -> Figure:
    """Draw the loop at six moments, and all eigenvalues over s by both operators."""
    figure = Figure(figsize=(10.5, 8), layout="constrained", dpi=72)
    above, below = figure.subfigures(2, 1, height_ratios=[1, 2.6])
    start, n = eight(), len(found["points"])
    moments = np.linspace(0, 1, n)
    for axes, place in zip(above.subplots(1, 6), np.linspace(0, n - 1, 6).astype(int), strict=True):
        mesh = es.TriangleMesh(found["points"][place], start.faces)
        show_shape(
            axes,
            mesh,
            es.plot.aim_camera(mesh, up="z"),
            color="#d9c9a3",
            edges=0.15,
            reach=0.62,
        )
        axes.set_title(f"s = {moments[place]:.1f}", fontsize=9)
    left, right = below.subplots(1, 2)
    left.plot(moments, found["mesh"], color="#1f77b4", lw=1)
    label(
        left,
        "s (no unit)",
        "λᵢ in 1/diameter²",
        "mesh Laplacian as printed; n = 766, t = e² = 0.0018",
        legend=False,
    )
    right.plot(moments, found["cotangent"], color="#bbbbbb", lw=0.8, zorder=1)
    places = np.broadcast_to(moments[:, None], found["cotangent"].shape)
    for number, (name, color) in enumerate(zip(CLASSES, COLORS, strict=False)):
        kind = found["classes"] == number
        right.scatter(
            places[kind], found["cotangent"][kind], s=4, color=color, label=name, zorder=2
        )
    label(
        right,
        "s (no unit)",
        "λᵢ in 1/diameter²",
        "cotangent, averaged; n = 766, no t; by mirror class",
        legend=False,
    )
    right.legend(frameon=True, fontsize=8, loc="upper left", markerscale=3)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_ylim(0, 470)
    return figure


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    require_data()
    warnings.simplefilter(
        "ignore"
    )  # of thirty eigenvalues twenty are told apart from 1/t: the README says so
    most = 8 if arguments.quick else 80
    found = tracks(most)
    pictures = {} if arguments.quick else {"tracks": figure_tracks(found)}
    finish(rounded(measure(found, most)), pictures, arguments)


if __name__ == "__main__":
    main()
