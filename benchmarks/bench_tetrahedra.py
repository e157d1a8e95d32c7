"""What eigenpairs of a solid cost: linear, quadratic and cubic elements on the same tetrahedra, beside others.

    python benchmarks/bench_tetrahedra.py             34,992 tetrahedra of a box; eight minutes
    python benchmarks/bench_tetrahedra.py --quick     750 tetrahedra, seconds

Each solve runs in a process of its own, on one core with one thread, after a small one that loads
what it needs, and includes the matrices. ARPACK solves our matrices with the factors of SciPy (SuperLU), which
take more memory for cubic elements than most machines have, and with those of CHOLMOD (cholespy). So it does
the matrices of scikit-fem, which has no cubic elements. What is not installed of these two is left out.
"""

import statistics
import time
from importlib.util import find_spec

import numpy as np
import scipy.sparse as sp
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of, ratio_text
from scipy.sparse.linalg import eigsh
from spectrum_libraries import arpack_with, cholmod_factor

import eigenshape as es

COLUMNS = ("elements", "library", "nodes", "CPU s", "ratio", "MiB", "largest error")
LINEAR, CUBIC = 1, 3
PAIRS = 4
PEERS = {"CHOLMOD": "cholespy", "scikit-fem": "skfem"}  # left out where they are not installed
SIDES = 1.0, 0.9, 0.8  # no two equal, so that every eigenvalue is simple


def eigenvalues(library: str, mesh: es.SimplicialMesh, order: int) -> np.ndarray:
    """Return the lowest eigenvalues of one library, from the mesh on."""
    if library == "LaPy":
        import lapy  # noqa: PLC0415 - a process loads only the library that it measures

        tetrahedra = lapy.TetMesh(np.array(mesh.points), np.array(mesh.simplices))
        return lapy.Solver(tetrahedra).eigs(PAIRS)[0]
    if library == "eigenshape":
        return certified_eigenvalues(mesh, order)
    if library.startswith("scikit-fem"):
        stiffness, mass = scikit_fem_matrices(mesh, order)
    else:
        laplacian = es.operators.fem_laplacian(mesh, order)
        stiffness, mass = laplacian.stiffness.tocsc(), laplacian.mass.tocsc()
    if library.endswith("CHOLMOD"):
        return np.sort(arpack_with(cholmod_factor, stiffness, mass, PAIRS)[0])
    return np.sort(eigsh(stiffness, PAIRS, mass, sigma=-0.01, return_eigenvectors=False))


def certified_eigenvalues(mesh: es.SimplicialMesh, order: int) -> np.ndarray:
    """Return the lowest eigenvalues by eigenshape."""
    found = es.solve_spectrum(es.operators.fem_laplacian(mesh, order), PAIRS)
    if not found.certificate.complete:
        raise RuntimeError(f"order {order}: the spectrum is not certified")
    return found.eigenvalues


def scikit_fem_matrices(mesh: es.SimplicialMesh, order: int) -> tuple[sp.csc_array, sp.csc_array]:
    """Return W and B of scikit-fem, as its own documentation writes them."""
    import skfem  # noqa: PLC0415 - a process loads only the library that it measures
    from skfem.models.poisson import laplace, mass  # noqa: PLC0415

    element = {1: skfem.ElementTetP1, 2: skfem.ElementTetP2}[order]()
    basis = skfem.Basis(skfem.MeshTet(mesh.points.T, mesh.simplices.T), element)
    return sp.csc_array(laplace.assemble(basis)), sp.csc_array(mass.assemble(basis))


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
    libraries = ["eigenshape", "ARPACK, CHOLMOD"]
    if order < CUBIC:
        libraries += ["ARPACK", "scikit-fem, ARPACK", "scikit-fem, CHOLMOD"]
    if order == LINEAR:
        libraries += ["LaPy"]
    absent = [word for word, module in PEERS.items() if find_spec(module) is None]
    libraries = [name for name in libraries if not any(word in name for word in absent)]
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
    report = Report(
        ["eigenshape", "numpy", "scipy", "lapy", "scikit-fem", "cholespy"], options, COLUMNS, cells
    )
    for order in range(LINEAR, CUBIC + 1):
        for row in measured(order, options.repeats, 5 if options.quick else 18):
            report.add(row)


if __name__ == "__main__":
    main()
