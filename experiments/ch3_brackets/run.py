"""Do the brackets hold the eigenvalues of the shape? (the open question of thesis 3.5).

A hundred eigenvalues of ten shapes, by Neumann's condition and by Dirichlet's where there is a boundary. The truth is
known by formula, or by cubic elements on finer and finer pieces of the same flat simplices.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.progress import track

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import options_of, save_figures
from real_shapes import DATA

K = 100
QUICK = ("square, irregular", "polygon of 24 sides", "flat torus in R⁴", "tetrahedron")
FEW = 10  # eigenvalues whose brackets are followed through refinements
Mesh = es.TriangleMesh | es.SimplicialMesh


@dataclass(frozen=True)
class Case:
    """A shape, with what is known of it.

    `bracketed`, `refined` and `followed` are the times that its simplices are split for the brackets, for the truth and
    for the first of three meshes that show the order; `edge` is that of a tetrahedron, `period` of a torus, `sides`
    of a box.
    """

    mesh: Mesh
    bracketed: int = 0
    refined: int = 1
    followed: int = 0
    sides: tuple[float, ...] = ()
    period: float = 0.0
    edge: float = 0.0


def flat_torus(n: int) -> Case:
    """Return the product of two n-gons in R⁴."""
    i, j = np.divmod(np.arange(n * n), n)
    turns = 2 * np.pi / n * np.column_stack([i, j])
    points = np.column_stack([np.cos(turns), np.sin(turns)])
    return Case(
        es.SimplicialMesh(points, es.shapes.torus(n, n).faces), period=2 * n * np.sin(np.pi / n)
    )


def skin(solid: es.SimplicialMesh) -> es.TriangleMesh:
    """Return the boundary of a solid."""
    table = es.geometry.facet_table(solid)
    used, faces = np.unique(table.facets[table.boundary], return_inverse=True)
    return es.TriangleMesh(solid.points[used], faces.reshape(-1, 3))


def tetrahedron() -> es.TriangleMesh:
    """Return the skin of the regular tetrahedron with edges of length 1."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / 8**0.5
    return es.TriangleMesh(corners, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])


def made() -> dict[str, Case]:
    """Return the shapes that need no file."""
    rng = np.random.default_rng(0)
    return {
        "square, irregular": Case(es.shapes.irregular_grid(20, 20, rng=rng), sides=(1.0, 1.0)),
        "polygon of 24 sides": Case(es.shapes.disc(4), bracketed=2, refined=3, followed=2),
        "flat torus in R⁴": flat_torus(20),
        "tetrahedron": Case(tetrahedron(), bracketed=4, followed=4, edge=1.0),
        "cube": Case(skin(es.shapes.box(2, 2, 2)), bracketed=3, refined=4, followed=3),
        "polyhedron of 80 faces": Case(es.icosphere(1), bracketed=2, refined=3, followed=3),
        "box of tetrahedra": Case(es.shapes.box(4, 4, 4), bracketed=1, sides=(1.0, 1.0, 1.0)),
    }


def real() -> dict[str, Case]:
    """Return the shapes that are read, where they are there."""
    files = {
        "eight": (DATA / "classics" / "eight.off", 2, 0),
        "fox": (DATA / "nasty" / "geometrycentral" / "fox.ply", 3, 1),
        "glasses": (DATA / "retrieval" / "glasses" / "psb52.ply", 1, 0),
    }
    return {
        name: Case(es.read_shape(path), refined=refined, followed=followed)
        for name, (path, refined, followed) in files.items()
        if path.exists()
    }


def finer(mesh: Mesh, times: int) -> Mesh:
    """Split simplices at the middles of their edges, where they lie."""
    for _ in range(times):
        mesh = es.geometry.subdivide(mesh)
    return mesh


def solved(mesh: Mesh, order: int, k: int, condition: str) -> np.ndarray:
    """Return eigenvalues of elements of an order."""
    laplacian = es.operators.fem_laplacian(mesh, order)
    if condition == "neumann":
        return es.solve_spectrum(laplacian, k).eigenvalues
    fixed = es.operators.fem_boundary_nodes(mesh, order)
    return es.solve_spectrum(laplacian, k, fixed=fixed).eigenvalues


def truth(case: Case, k: int, condition: str) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues and how far the last refinement moved them, 0 where they are known by formula."""
    if case.sides:
        return es.shapes.box_eigenvalues(k, case.sides, condition), np.zeros(k)
    if case.period:
        return es.shapes.flat_torus_eigenvalues(k, case.period * np.eye(2)), np.zeros(k)
    if (
        case.edge
    ):  # a torus of twice the edge with opposite points made one, which keep every cosine
        periods = case.edge * np.array([[2, 0], [1, 3**0.5]])
        return es.shapes.flat_torus_eigenvalues(2 * k, periods)[
            np.r_[0, 1 : 2 * k - 1 : 2]
        ], np.zeros(k)
    levels = case.refined - 1, case.refined
    coarse, fine = (solved(finer(case.mesh, level), 3, k, condition) for level in levels)
    return fine, np.abs(fine - coarse)


def widths(mesh: Mesh, k: int, condition: str) -> np.ndarray:
    """Return how wide the brackets of positive eigenvalues are."""
    found = es.bracket_eigenvalues(mesh, k, boundary=condition)
    return (found.upper - found.lower)[found.n_zero :]


def order(case: Case, condition: str) -> list[float]:
    """Return the least and the largest order at which brackets narrow over three meshes."""
    meshes = [finer(case.mesh, case.followed + times) for times in range(3)]
    rows = np.array([widths(mesh, FEW, condition) for mesh in meshes])
    slopes = -np.polyfit(np.arange(3) * np.log(2), np.log(rows), 1)[0]
    return [float(slopes.min()), float(slopes.max())]


def measured(case: Case, condition: str, *, with_order: bool) -> dict[str, object]:
    """Return how many brackets hold, how surely, and how wide they are."""
    mesh = finer(case.mesh, case.bracketed)
    found = es.bracket_eigenvalues(mesh, K, boundary=condition)
    known, moved = truth(case, K, condition)
    known = np.where(np.arange(K) < found.n_zero, 0.0, known)
    positive = slice(found.n_zero, None)
    room = np.minimum(known - found.lower, found.upper - known)[positive]
    width = (found.upper - found.lower)[positive]
    relative = width / known[positive]
    return {
        "points": mesh.n_points,
        "held": int(np.count_nonzero((found.lower <= known) & (known <= found.upper))),
        "moved / width": float((moved[positive] / width).max()),
        "room / moved": float((room / moved[positive]).min()) if moved.any() else None,
        "first": float(relative[0]),
        "median": float(np.median(relative)),
        "last": float(relative[-1]),
        "order": order(case, condition) if with_order else None,
    }


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__, quick=f"{', '.join(QUICK)}, without orders")
    parser.add_argument("--only", nargs="*", help="names of shapes")
    arguments = parser.parse_args()
    chosen = arguments.only or (QUICK if arguments.quick else None)
    cases = {name: case for name, case in (made() | real()).items() if not chosen or name in chosen}
    open_ones = {
        name for name, case in cases.items() if es.geometry.facet_table(case.mesh).boundary.size
    }
    tasks = [(name, condition) for name in cases for condition in ("neumann", "dirichlet")]
    tasks = [
        (name, condition)
        for name, condition in tasks
        if condition == "neumann" or name in open_ones
    ]
    table = {}
    for name, condition in track(tasks, description="shapes"):
        label = f"{name}, {condition.capitalize()}" if name in open_ones else name
        table[label] = measured(cases[name], condition, with_order=not arguments.quick)
        print(label, table[label], flush=True)
    save_figures(table, arguments.out)


if __name__ == "__main__":
    main()
