"""Compare mass matrices of linear elements on tetrahedra (thesis 1.1.2).

Twenty eigenvalues above zero by lumped, consistent and averaged mass and by quadratic elements, on boxes and balls,
whose eigenvalues are known, and on real meshes, where quadratic elements stand for them.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.progress import track
from scipy.spatial import Delaunay

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import give_out, options_of
from real_shapes import DATA

K = 20
MASSES = ("lumped", "consistent", "averaged")
REAL = {
    "ellipsoid": "ellipsoid.mesh",
    "sphere": "sphere.mesh",
    "octopus": "octopus-low.mesh",
    "bunny": "bunny.mesh",
}


def irregular_box(n: int) -> es.SimplicialMesh:
    """Return a unit cube of Delaunay tetrahedra, its points moved by up to 0.3 of their distance.

    Points on the sides move along them, so that no four lie on a circle, where rounding would decide.
    """
    axis = np.linspace(0, 1, n + 1)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    free = (points > 0) & (points < 1)
    points = points + free * np.random.default_rng(0).uniform(-0.3, 0.3, points.shape) / n
    mesh = es.SimplicialMesh(points, Delaunay(points).simplices)
    # Of four points in one plane Delaunay's method makes a flat tetrahedron.
    solid = es.geometry.simplex_volumes(mesh) > 1e-6 / n**3
    return es.SimplicialMesh(points, mesh.simplices[solid])


def shapes(*, quick: bool) -> Iterator[tuple[str, es.SimplicialMesh, np.ndarray | None]]:
    """Yield the shapes with their eigenvalues, where these are known."""
    box = es.shapes.box_eigenvalues(K + 1, (1, 1, 1))[1:]
    n = 4 if quick else 12
    yield "box", es.shapes.box(n, n, n), box
    yield "box, irregular", irregular_box(n), box
    yield "ball", es.shapes.ball(4 if quick else 10), es.shapes.ball_eigenvalues(K + 1)[1:]
    for name, file in REAL.items():
        if not quick and (DATA / "tets" / file).exists():
            yield name, es.read_shape(DATA / "tets" / file), None


def measure(mesh: es.SimplicialMesh, exact: np.ndarray | None) -> dict[str, object]:
    """Return the median relative error of each operator, and the error of its first eigenvalue."""
    operators = {mass: es.cotangent_laplacian(mesh, mass) for mass in MASSES}
    operators["P2"] = es.operators.fem_laplacian(mesh, order=2)
    values = {
        name: es.solve_spectrum(operator, K + 1).eigenvalues[1:]
        for name, operator in operators.items()
    }
    expected = values.pop("P2") if exact is None else exact
    errors = {name: found / expected - 1 for name, found in values.items()}
    return {
        "points": mesh.n_points,
        "median": {name: float(np.median(np.abs(error))) for name, error in errors.items()},
        "first": {name: float(error[0]) for name, error in errors.items()},
    }


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__, quick="coarse boxes and balls")
    arguments = parser.parse_args()
    tasks = list(shapes(quick=arguments.quick))
    table = {name: measure(mesh, exact) for name, mesh, exact in track(tasks, "tetrahedra")}
    give_out(table, arguments.out)


if __name__ == "__main__":
    main()
