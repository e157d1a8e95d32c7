"""How near does each operator come to eigenvalues that are known, and how quickly with more points? (thesis 3.4).

Every operator on every domain that it takes, at three resolutions: the median and the worst relative error of the first
eigenvalues above zero, the order fitted to the medians (error ~ n^(-order/m)), and the seconds to build and to solve at
the finest.
"""

import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from rich.progress import track

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import options_of, output_file, save_figures

SIZES = {"full": (1000, 2500, 6250), "quick": (300, 480, 750)}
QUICK = (  # each dimension, each kind of boundary, and each operator at least once
    "sphere, Fibonacci",
    "flat torus in R⁴",
    "3-sphere in R⁴",
    "interval",
    "square",
    "disc",
    "box",
    "square, Dirichlet",
    "disc, Dirichlet",
    "box, Dirichlet",
)
K = 36
Build = Callable[[es.TriangleMesh | es.SimplicialMesh], es.Laplacian]

LINEAR: dict[str, Build] = {
    "cotangent, lumped": lambda mesh: es.cotangent_laplacian(mesh, "lumped"),
    "cotangent, consistent": lambda mesh: es.cotangent_laplacian(mesh, "consistent"),
    "cotangent, averaged": lambda mesh: es.cotangent_laplacian(mesh, "averaged"),
}
HIGHER: dict[str, Build] = {
    "P2": es.operators.fem_laplacian,
    "P3": lambda mesh: es.operators.fem_laplacian(mesh, 3),
}
KERNELS: dict[str, Build] = {
    "mesh, literal": es.mesh_laplacian,
    "mesh, corrected": lambda mesh: es.mesh_laplacian(mesh, correct="log"),
    "mesh, random-walk": lambda mesh: es.mesh_laplacian(mesh, correct="log", form="random-walk"),
}
SURFACES: dict[str, Build] = {
    "robust": es.robust_laplacian,
    "mesh, geodesic": lambda mesh: es.mesh_laplacian(mesh, correct="log", distance="geodesic"),
}
POINTS: dict[str, Build] = {
    "point cloud": lambda mesh: es.point_cloud_laplacian(es.PointCloud(mesh.points, mesh.dim)),
    "point cloud, literal": lambda mesh: es.point_cloud_laplacian(
        es.PointCloud(mesh.points, mesh.dim), edge_factor=2, correct=None, form="literal"
    ),
}
CLOSED = LINEAR | {"P2": es.operators.fem_laplacian} | SURFACES | KERNELS | POINTS
FLAT = LINEAR | HIGHER | {"mesh, corrected": KERNELS["mesh, corrected"]} | POINTS
SOLID = (
    LINEAR
    | {"P2": es.operators.fem_laplacian, "mesh, corrected": KERNELS["mesh, corrected"]}
    | POINTS
)


def icosphere(n: int) -> es.TriangleMesh:
    """Return the icosphere with about n vertices."""
    return es.icosphere(max(1, round(float(np.log(n / 10) / np.log(4)))))


def flat_torus(n: int) -> es.SimplicialMesh:
    """Return the product of two circles in R⁴, its vertices moved about at random in the flat plane."""
    side = int(n**0.5)
    sheet = es.shapes.irregular_grid(side, side, rng=np.random.default_rng(0))
    u, v = 2 * np.pi * sheet.vertices[:, :2].T
    points = np.column_stack([np.cos(u), np.sin(u), np.cos(v), np.sin(v)])
    _, first, names = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return es.SimplicialMesh(points[first], names.ravel()[sheet.faces])


def random_sphere(n: int) -> es.TriangleMesh:
    """Return random points on the sphere, the same at every run."""
    return es.shapes.random_sphere(n, rng=np.random.default_rng(1))


def square(n: int) -> es.TriangleMesh:
    """Return the unit square in irregular triangles."""
    side = int(n**0.5)
    return es.shapes.irregular_grid(side, side, rng=np.random.default_rng(0))


Case = tuple[
    Callable[[int], "es.TriangleMesh | es.SimplicialMesh"],
    Callable[[int], np.ndarray],
    dict[str, Build],
    bool,
]
CASES: dict[str, Case] = {
    "sphere, Fibonacci": (es.shapes.fibonacci_sphere, es.shapes.sphere_eigenvalues, CLOSED, False),
    "sphere, icosphere": (icosphere, es.shapes.sphere_eigenvalues, CLOSED, False),
    "sphere, 4:1 density": (es.shapes.uneven_sphere, es.shapes.sphere_eigenvalues, CLOSED, False),
    "sphere, random": (random_sphere, es.shapes.sphere_eigenvalues, CLOSED, False),
    "flat torus in R⁴": (
        flat_torus,
        lambda k: es.shapes.flat_torus_eigenvalues(k, 2 * np.pi * np.eye(2)),
        LINEAR | KERNELS | POINTS,
        False,
    ),
    "3-sphere in R⁴": (
        lambda n: es.shapes.three_sphere(n // 3),
        lambda k: es.shapes.sphere_eigenvalues(k, 3),
        LINEAR | KERNELS | POINTS,
        False,
    ),
    "projective plane in R⁵": (
        lambda n: es.shapes.projective_plane(max(1, round(float(np.log(n / 5) / np.log(4))))),
        es.shapes.projective_plane_eigenvalues,
        LINEAR | KERNELS,
        False,
    ),
    "interval": (
        lambda n: es.shapes.interval(n // 4),
        lambda k: es.shapes.box_eigenvalues(k, [1.0]),
        FLAT,
        False,
    ),
    "square": (square, es.shapes.box_eigenvalues, FLAT | SURFACES, False),
    "disc": (
        lambda n: es.shapes.disc(int((n / 3) ** 0.5)),
        es.shapes.disc_eigenvalues,
        FLAT | SURFACES,
        False,
    ),
    "box": (
        lambda n: es.shapes.box(*[int((n / 4) ** (1 / 3))] * 3),
        lambda k: es.shapes.box_eigenvalues(k, (1, 1, 1)),
        SOLID,
        False,
    ),
    "ball": (
        lambda n: es.shapes.ball(int((n / 4) ** (1 / 3))),
        es.shapes.ball_eigenvalues,
        SOLID,
        False,
    ),
    "square, Dirichlet": (
        square,
        lambda k: es.shapes.box_eigenvalues(k, (1, 1), "dirichlet"),
        LINEAR | HIGHER,
        True,
    ),
    "disc, Dirichlet": (
        lambda n: es.shapes.disc(int((n / 3) ** 0.5)),
        lambda k: es.shapes.disc_eigenvalues(k, "dirichlet"),
        LINEAR | HIGHER,
        True,
    ),
    "box, Dirichlet": (
        lambda n: es.shapes.box(*[int((n / 4) ** (1 / 3))] * 3),
        lambda k: es.shapes.box_eigenvalues(k, (1, 1, 1), "dirichlet"),
        LINEAR | {"P2": es.operators.fem_laplacian},
        True,
    ),
    "ball, Dirichlet": (
        lambda n: es.shapes.ball(int((n / 4) ** (1 / 3))),
        lambda k: es.shapes.ball_eigenvalues(k, "dirichlet"),
        LINEAR | {"P2": es.operators.fem_laplacian},
        True,
    ),
}
ORDERS = {"P2": 2, "P3": 3}


def solved(
    mesh: es.TriangleMesh | es.SimplicialMesh, name: str, build: Build, k: int, held: bool
) -> dict[str, object]:
    """Build and solve, and return eigenvalues, size and seconds."""
    start = time.perf_counter()
    laplacian = build(mesh)
    built = time.perf_counter()
    if held:
        boundary = es.operators.fem_boundary_nodes(mesh, ORDERS.get(name, 1))
        values = es.solve_spectrum(laplacian, k, fixed=boundary).eigenvalues
    else:
        values = es.solve_spectrum(laplacian, k).eigenvalues
    return {
        "values": values,
        "n": laplacian.n_points,
        "row": laplacian.stiffness.nnz / laplacian.n_points,
        "seconds": (built - start, time.perf_counter() - built),
    }


def measured(case: Case, name: str, sizes: tuple[int, ...]) -> dict[str, object]:
    """Return errors, order and cost of one operator on one domain."""
    make, eigenvalues, operators, held = case
    medians, worsts, counts = [], [], []
    for size in sizes:
        mesh = make(size)
        k = min(K, mesh.n_points // 4)
        if held:  # a small solid has few points inside, and no more eigenvalues than these
            k = min(k, (mesh.n_points - len(es.operators.fem_boundary_nodes(mesh, 1))) // 2)
        found, exact = solved(mesh, name, operators[name], k, held), eigenvalues(k)
        errors = np.abs(found["values"][exact > 0] / exact[exact > 0] - 1)
        medians.append(float(np.median(errors)))
        worsts.append(float(errors.max()))
        counts.append(int(found["n"]))
    slope = np.polyfit(np.log(counts), np.log(medians), 1)[0]
    return {
        "n": counts,
        "median": medians,
        "worst": worsts,
        "order": float(-slope * mesh.dim),
        "row": round(float(found["row"]), 1),
        "seconds": [round(second, 3) for second in found["seconds"]],
    }


def draw(path: Path, n: int) -> None:
    """Draw the error of 300 eigenvalues on the unit sphere, an operator a line, the copies of one as one."""
    mesh, exact = es.shapes.fibonacci_sphere(n), es.shapes.sphere_eigenvalues(300)
    operators = {
        name: build for name, build in CLOSED.items() if name not in ("robust", "mesh, random-walk")
    }
    figure = Figure(figsize=(9, 5.2), layout="constrained")
    axes = figure.subplots()
    colors = mpl.colormaps["tab10"].colors
    for color, (name, build) in zip(
        colors, track(operators.items(), description="picture"), strict=False
    ):
        values = solved(mesh, name, build, 300, held=False)["values"]
        squares = (values[1:] / exact[1:] - 1) ** 2
        degrees = np.floor(np.sqrt(np.arange(1, 300))).astype(int)
        errors = np.sqrt(np.bincount(degrees, squares)[1:] / np.bincount(degrees)[1:])
        axes.semilogy(np.arange(1, len(errors) + 1), errors, ".-", color=color, lw=1.4, label=name)
    axes.set(
        xlabel="degree l of the eigenvalue l(l + 1), which comes 2l + 1 times",
        ylabel="relative error, RMS",
    )
    axes.set_title(f"The unit sphere heard by {n} points")
    axes.set_ylim(1e-4, 1)
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right upper", frameon=False)
    figure.savefig(path, dpi=130)


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__, quick="smaller meshes")
    parser.add_argument("--picture", type=output_file, help="draw errors on the sphere (PNG)")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    sizes = SIZES["quick" if arguments.quick else "full"]
    cases = QUICK if arguments.quick else CASES
    tasks = [(case, name) for case in cases for name in CASES[case][2]]
    table: dict[str, dict[str, object]] = {}
    for case, name in track(tasks, description="cases"):
        row = table.setdefault(case, {})[name] = measured(CASES[case], name, sizes)
        print(
            f"{case:<24} {name:<22} n {row['n'][-1]:>6}  median {row['median'][-1]:.5f}  worst {row['worst'][-1]:.5f}"
            f"  order {row['order']:5.2f}  entries a row {row['row']:6.1f}  seconds {row['seconds']}"
        )
    save_figures(table, arguments.out)
    if arguments.picture:
        draw(arguments.picture, 1000 if arguments.quick else 4000)


if __name__ == "__main__":
    main()
