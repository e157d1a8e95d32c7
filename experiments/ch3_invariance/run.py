"""Do eigenvalues stay when nothing has changed? Units, place, numbering, threads (thesis 3.1).

Fifty eigenvalues of four shapes by four operators: scaled by 1e-100 to 1e100, shifted by a million diameters,
with vertices and faces in another order, and with one thread and two.
"""

import sys
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from rich.progress import track
from threadpoolctl import threadpool_limits

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import options_of, save_figures
from real_shapes import DATA

K = 50
SCALES = (1e-100, 1e-30, 1e-3, 0.7, 25.4, 1e30, 1e100)
EXPONENTS = (-300, -1, 7, 300)
DIAMETERS = 1e6
OPERATORS: dict[str, Callable[[es.TriangleMesh], es.Laplacian]] = {
    "cotangent": es.cotangent_laplacian,
    "robust": es.robust_laplacian,
    "mesh": es.mesh_laplacian,
    "P2": partial(es.operators.fem_laplacian, order=2),
}
COLUMNS = ("scaled", "scaled by 2ᵖ", "shifted", "renumbered", "threads")


def shapes(*, quick: bool) -> Iterator[tuple[str, es.TriangleMesh]]:
    """Yield the shapes; real ones where they are."""
    yield "icosphere", es.icosphere(2 if quick else 4)
    yield "quadruped", es.make_creature("quadruped", 1, n_vertices=500 if quick else 2500)
    for name, path in {"glasses": "glasses/psb58.ply", "octopus": "octopus/psb124.ply"}.items():
        if not quick and (DATA / "retrieval" / path).exists():
            yield name, es.read_mesh(DATA / "retrieval" / path)


def eigenvalues(
    operator: Callable[[es.TriangleMesh], es.Laplacian], mesh: es.TriangleMesh
) -> np.ndarray:
    """Return the lowest ones."""
    return es.solve_spectrum(operator(mesh), K).eigenvalues


def moved(mesh: es.TriangleMesh, points: np.ndarray) -> es.TriangleMesh:
    """Return the mesh with its vertices elsewhere."""
    return es.TriangleMesh(points, mesh.faces)


def renumbered(mesh: es.TriangleMesh, rng: np.random.Generator) -> es.TriangleMesh:
    """Return the mesh with vertices, faces and the first corner of each face in another order."""
    order = rng.permutation(mesh.n_points)
    names = np.argsort(order)
    faces = names[mesh.faces][rng.permutation(len(mesh.faces))]
    turns = (np.arange(3) + rng.integers(3, size=(len(faces), 1))) % 3
    return es.TriangleMesh(mesh.vertices[order], np.take_along_axis(faces, turns, axis=1))


def scaled_error(values: np.ndarray, scaled: np.ndarray, factor: float) -> float:
    """Return the worst relative error of eigenvalues above 0 that should be 1/factor² times as large."""
    return float(np.abs(scaled[1:] * factor**2 / values[1:] - 1).max())


def threaded(
    operator: Callable[[es.TriangleMesh], es.Laplacian], mesh: es.TriangleMesh, count: int
) -> es.Spectrum:
    """Solve with so many threads of BLAS and of our own loops."""
    es.set_threads(count)
    with threadpool_limits(count):
        return es.solve_spectrum(operator(mesh), K)


def measured(
    operator: Callable[[es.TriangleMesh], es.Laplacian], mesh: es.TriangleMesh
) -> dict[str, float]:
    """Return the worst of each error."""
    values, points = eigenvalues(operator, mesh), np.array(mesh.vertices)
    powers = [
        np.ldexp(eigenvalues(operator, moved(mesh, np.ldexp(points, p))), 2 * p) for p in EXPONENTS
    ]
    diameter = float(np.linalg.norm(np.ptp(points, axis=0)))
    off = points + DIAMETERS * diameter * np.array([1.0, -1.0, 0.5])
    one, two = (threaded(operator, mesh, count) for count in (1, 2))
    last = values[-1]
    return {
        "scaled": max(
            scaled_error(values, eigenvalues(operator, moved(mesh, s * points)), s) for s in SCALES
        ),
        "scaled by 2ᵖ": max(float(np.abs(found - values).max() / last) for found in powers),
        "shifted": float(np.abs(eigenvalues(operator, moved(mesh, off)) - values).max() / last),
        "renumbered": float(
            np.abs(eigenvalues(operator, renumbered(mesh, np.random.default_rng(0))) - values).max()
            / last
        ),
        "threads": float(
            max(
                np.abs(one.eigenvalues - two.eigenvalues).max(),
                np.abs(one.eigenvectors - two.eigenvectors).max(),
            )
        ),
    }


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__, quick="small made-up shapes")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    tasks = [
        (f"{shape}, {name}", operator, mesh)
        for shape, mesh in shapes(quick=arguments.quick)
        for name, operator in OPERATORS.items()
    ]
    table = {}
    for name, operator, mesh in track(tasks, description="invariance"):
        table[name] = measured(operator, mesh)
        print(
            f"{name:<22}" + "".join(f"{key}: {value:.1e}   " for key, value in table[name].items())
        )
    save_figures(table, arguments.out)


if __name__ == "__main__":
    main()
