"""At which points does L f come near to Δf? (thesis 2.1, theorem 2.1.1).

f = xy + z² on the unit sphere, where Δf = 6xy + 6z² - 2. Even, random and noisy meshes; the mesh Laplacian at three
rules for t, and cotangent weights. The largest error over all points is compared with that of coarser meshes.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.progress import track

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, chart, finish, label, parse_arguments, rounded  # noqa: E402

import eigenshape as es  # noqa: E402

SIZES = (1000, 4000, 16000)
QUICK_SIZES = (250, 500, 1000)
NOISE = 0.1  # standard deviation of the radius, in mean edge lengths
THEOREM = 1 / 2.5  # power of e in the theorem's t, for α to 0
FACTORS = (0.1, 0.2, 0.3, 0.5, 0.8)  # of e in t, in units of the radius
RULES = ("t = e²", "t = pointwise", "t = e^(1/2.5)", "cotangent")


def values_of(points: np.ndarray) -> np.ndarray:
    """Return f = xy + z²."""
    x, y, z = points.T
    return x * y + z * z


def exact(points: np.ndarray) -> np.ndarray:
    """Return Δf with the sign of eigenvalues: xy and z² - 1/3 are harmonics of degree 2, eigenvalue 6."""
    x, y, z = points.T
    return 6 * x * y + 6 * z * z - 2


def meshes(n: int) -> dict[str, tuple[es.TriangleMesh, np.ndarray]]:
    """Return each mesh with the points of the sphere that its vertices stand for."""
    even = es.shapes.fibonacci_sphere(n)
    random = es.shapes.random_sphere(n, rng=np.random.default_rng(n))
    heights = NOISE * es.geometry.mean_side_length(even)
    radii = 1 + heights * np.random.default_rng(n).standard_normal((n, 1))
    noisy = es.TriangleMesh(even.vertices * radii, even.faces)
    return {
        "even": (even, even.vertices),
        "random": (random, random.vertices),
        "noisy": (noisy, even.vertices),
    }


def largest_error(mesh: es.TriangleMesh, points: np.ndarray, t: float) -> float:
    """Return the largest error of L f, without storing the matrix of `es.mesh_laplacian`."""
    operator = es.operators.functional_laplacian(es.geometry.shape_quadrature(mesh), t, cutoff=4.0)
    return np.abs(operator @ values_of(points) - exact(points)).max()


def errors_by_rule(mesh: es.TriangleMesh, points: np.ndarray) -> dict[str, float]:
    """Return the largest error by each rule, and by cotangent weights."""
    e = es.geometry.mean_side_length(mesh)
    times = e**2, es.operators.pointwise_time(mesh), e**THEOREM
    found = {rule: largest_error(mesh, points, t) for rule, t in zip(RULES[:3], times, strict=True)}
    linear = es.cotangent_laplacian(mesh)
    applied = (linear.stiffness @ values_of(points)) / linear.mass.diagonal()
    return found | {"cotangent": np.abs(applied - exact(points)).max()}


def rates(rows: dict[str, dict[str, float]], edges: list[float]) -> dict[str, float]:
    """Return the power of e with which each error falls, by least squares."""
    return {
        rule: np.polyfit(np.log(edges), np.log([row[rule] for row in rows.values()]), 1)[0]
        for rule in RULES
    }


def measure(sizes: tuple[int, ...]) -> dict[str, object]:
    """Return errors of all meshes, sizes and rules, their rates, and errors by the factor of e in t."""
    table: dict[str, dict[str, dict[str, float]]] = {}
    edges: dict[str, list[float]] = {}
    factors: dict[str, dict[str, dict[str, float]]] = {}
    for n in track(sizes, description="sizes"):
        for kind, (mesh, points) in meshes(n).items():
            e = es.geometry.mean_side_length(mesh)
            edges.setdefault(kind, []).append(e)
            table.setdefault(kind, {})[str(n)] = errors_by_rule(mesh, points)
            if n < sizes[-1]:
                factors.setdefault(kind, {})[str(n)] = {
                    str(factor): largest_error(mesh, points, factor * e) for factor in FACTORS
                }
    return {
        "errors": table,
        "rates": {kind: rates(rows, edges[kind]) for kind, rows in table.items()},
        "factors": factors,
    }


def figure_errors(found: dict[str, object]) -> Figure:
    """Draw the largest error over the number of points, a panel for each kind of mesh."""
    figure, panels = chart(11, 3.9, columns=3)
    for axes, (kind, rows) in zip(panels, found["errors"].items(), strict=True):
        sizes = [int(n) for n in rows]
        for rule, color in zip(RULES, COLORS, strict=False):
            errors = [row[rule] for row in rows.values()]
            axes.loglog(sizes, errors, "o-", color=color, label=rule)
        axes.set_xticks(sizes, [f"{n:,}" for n in sizes])
        axes.minorticks_off()
        axes.set_ylim(0.05, 50)
        label(
            axes,
            "number of points n",
            "largest error of L f",
            f"{kind} mesh of the unit sphere",
            legend=kind == "even",
        )
    return figure


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    found = measure(QUICK_SIZES if arguments.quick else SIZES)
    pictures = {} if arguments.quick else {"errors": figure_errors(found)}
    finish(rounded(found), pictures, arguments)


if __name__ == "__main__":
    main()
