"""What eigenpairs of a solid cost: linear, quadratic and cubic elements on the same tetrahedra, beside others.

    python benchmarks/bench_tetrahedra.py             34,992 tetrahedra of a box; three minutes
    python benchmarks/bench_tetrahedra.py --quick     750 tetrahedra, seconds

Each solve runs in a process of its own, on one core with one thread, after a small one that loads
what it needs, and includes the matrices. ARPACK solves the same matrices with the
factors of SciPy (SuperLU); of cubic elements these take more memory than most machines have.
"""

import statistics
import time

import numpy as np
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of, ratio_text
from scipy.sparse.linalg import eigsh

import eigenshape as es

COLUMNS = ("elements", "library", "nodes", "CPU s", "ratio", "MiB", "largest error")
LINEAR, CUBIC = 1, 3
PAIRS = 4
SIDES = 1.0, 0.9, 0.8  # no two equal, so that every eigenvalue is simple


def eigenvalues(library: str, mesh: es.SimplicialMesh, order: int) -> np.ndarray:
    """Return the lowest eigenvalues of one library, from the mesh on."""
    if library == "LaPy":
        import lapy  # noqa: PLC0415 - a process loads only the library that it measures

        tetrahedra = lapy.TetMesh(np.array(mesh.points), np.array(mesh.simplices))
        return lapy.Solver(tetrahedra).eigs(PAIRS)[0]
    laplacian = es.operators.fem_laplacian(mesh, order)
    if library == "ARPACK":
        stiffness, mass = laplacian.stiffness.tocsc(), laplacian.mass.tocsc()
        return np.sort(eigsh(stiffness, PAIRS, mass, sigma=-0.01, return_eigenvectors=False))
    found = es.solve_spectrum(laplacian, PAIRS)
    if not found.certificate.complete:
        raise RuntimeError(f"order {order}: the spectrum is not certified")
    return found.eigenvalues


def solve(library: str, order: int, n_cells: int) -> Row:
    """Solve once, in this process, after a small solve."""
    eigenvalues(library, es.shapes.box(4, 4, 4, sides=SIDES), order)
    mesh = es.shapes.box(n_cells, n_cells, n_cells, sides=SIDES)
    exact = es.shapes.box_eigenvalues(PAIRS, SIDES)
    held, start = memory_now(), time.process_time()
    values = eigenvalues(library, mesh, order)
    took, peak = time.process_time() - start, peak_memory()
    error = float(np.abs(values[1:] / exact[1:] - 1).max())
    nodes = es.operators.fem_nodes(mesh, order)
    return {"n": len(nodes), "cpu": took, "memory": peak - held, "error": error}


def measured(order: int, repeats: int, n_cells: int) -> list[Row]:
    """Return a row for each library on elements of one order; libraries take turns."""
    libraries = ["eigenshape", *["ARPACK"] * (order < CUBIC), *["LaPy"] * (order == LINEAR)]
    runs: dict[str, list[Row]] = {library: [] for library in libraries}
    for _ in range(repeats):
        for library, done in runs.items():
            done.append(in_process(solve, library, order, n_cells))
    rows = [
        {"order": order, "library": library}
        | {key: statistics.median(run[key] for run in done) for key in done[0]}
        for library, done in runs.items()
    ]
    return [row | {"ratio": row["cpu"] / rows[0]["cpu"]} for row in rows]


def cells(row: Row) -> list[str]:
    """Return the texts of a row."""
    costs = f"{row['cpu']:.2f}", ratio_text(row["ratio"]), f"{row['memory']:.0f}"
    return [f"P{row['order']}", row["library"], f"{row['n']:,}", *costs, f"{row['error']:.1e}"]


def main() -> None:
    """Measure, print, and write what was asked for."""
    options = options_of(__doc__).parse_args()
    report = Report(["eigenshape", "numpy", "scipy", "lapy"], options, COLUMNS, cells)
    for order in range(LINEAR, CUBIC + 1):
        for row in measured(order, options.repeats, 5 if options.quick else 18):
            report.add(row)


if __name__ == "__main__":
    main()
