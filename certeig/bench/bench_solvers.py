"""CPU time, memory and missed eigenvalues of certeig and its peers, on five matrices without a shape in them.

    python bench/bench_solvers.py > table.md

Each solver runs in a process of its own, on one thread, and asks for the 50 lowest pairs. What it missed is counted
by the inertia of W - σB (certeig.count_below), and by LAPACK too where n is at most 3,000. The peers take `pip install
cholespy pyamg`.
"""

import json
import platform
import resource
import signal
import subprocess
import sys
import time
from importlib.metadata import version

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import LinearOperator, eigsh, lobpcg
from scipy.spatial import Delaunay

import certeig

K = 50
LONGEST = 60  # seconds of CPU time
DENSE = 3000  # rows up to which LAPACK checks the count
CLOSE = 1e-6  # relative error with which an eigenvalue counts as found


def grid():
    """Return the 7-point Laplacian of a cube of 24³ points with fixed sides: most eigenvalues are multiple."""
    n = 24
    line = sp.diags_array([2.0, -1.0, -1.0], offsets=[0, 1, -1], shape=(n, n))
    return sp.kronsum(sp.kronsum(line, line), line), sp.eye_array(n**3)


def beam():
    """Return a free Euler-Bernoulli beam of 1,000 cubic elements, with its consistent mass."""
    n, length = 1000, 1 / 1000
    s = length
    bending = np.array(
        [
            [12, 6 * s, -12, 6 * s],
            [6 * s, 4 * s * s, -6 * s, 2 * s * s],
            [-12, -6 * s, 12, -6 * s],
            [6 * s, 2 * s * s, -6 * s, 4 * s * s],
        ]
    )
    inertia = np.array(
        [
            [156, 22 * s, 54, -13 * s],
            [22 * s, 4 * s * s, 13 * s, -3 * s * s],
            [54, 13 * s, 156, -22 * s],
            [-13 * s, -3 * s * s, -22 * s, 4 * s * s],
        ]
    )
    places = 2 * np.arange(n)[:, None] + np.arange(4)
    rows, columns = np.repeat(places, 4, axis=1).ravel(), np.tile(places, 4).ravel()

    def assemble(element):
        return sp.csr_array((np.tile(element.ravel(), n), (rows, columns)), shape=(2 * n + 2,) * 2)

    return assemble(bending / s**3), assemble(inertia * s / 420)


def photonic():
    """Return -Δu = λ ε u in a periodic cell of 96² points: rods of permittivity 9 in air, four cells of them."""
    n = 96
    ring = sp.diags_array(
        [2.0, -1.0, -1.0, -1.0, -1.0], offsets=[0, 1, -1, n - 1, 1 - n], shape=(n, n)
    )
    x = (np.arange(n) + 0.5) / (n // 2) % 1 - 0.5
    rods = x[:, None] ** 2 + x**2 < 0.2**2
    return sp.kronsum(ring, ring) * n**2, sp.diags_array(np.where(rods, 9.0, 1.0).ravel())


def road():
    """Return a road map: a triangulation without two in five of its edges, its largest part, weighted by 1/length."""
    rng = np.random.default_rng(0)
    points = rng.random((20000, 2))
    corners = Delaunay(points).simplices
    edges = np.unique(
        np.sort(np.vstack([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [0, 2]]])), axis=0
    )
    edges = edges[rng.random(len(edges)) < 0.6]
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    half = sp.coo_array((1 / lengths, edges.T), shape=(20000, 20000))
    graph = sp.csr_array(half + half.T)
    parts = connected_components(graph, directed=False)[1]
    largest = np.flatnonzero(parts == np.bincount(parts).argmax())
    graph = graph[largest][:, largest]
    return sp.diags_array(graph.sum(axis=1)) - graph, sp.eye_array(len(largest))


def ill_scaled():
    """Return a grid of 50² points with weights over eight decades and masses over six."""
    rng = np.random.default_rng(1)
    path = sp.diags_array([1.0, 1.0], offsets=[1, -1], shape=(50, 50))
    upper = sp.triu(sp.kronsum(path, path)).tocoo()
    upper.data = 10 ** rng.uniform(-4, 4, len(upper.data))
    graph = sp.csr_array(upper + upper.T)
    masses = 10 ** rng.uniform(-3, 3, 2500)
    return sp.diags_array(graph.sum(axis=1)) - graph, sp.diags_array(masses)


MATRICES = {
    "3D grid": grid,
    "beam": beam,
    "photonic cell": photonic,
    "road map": road,
    "ill-scaled grid": ill_scaled,
}


def small_shift(stiffness, mass):
    """Return a shift a little below zero, where W - σB is definite."""
    return -1e-3 * stiffness.trace() / mass.trace() / stiffness.shape[0] ** 0.5


def by_certeig(stiffness, mass):
    return certeig.eigenpairs(stiffness, mass, k=K).eigenvalues


def by_eigsh(stiffness, mass):
    return eigsh(
        stiffness.tocsc(), K, mass.tocsc(), sigma=small_shift(stiffness, mass), which="LM"
    )[0]


def by_cholmod(stiffness, mass):
    """`eigsh` with the Cholesky factor of CHOLMOD, as the package cholespy has it."""
    from cholespy import CholeskySolverD, MatrixType

    sigma = small_shift(stiffness, mass)
    moved = sp.coo_array(stiffness - sigma * mass)
    n = moved.shape[0]
    solver = CholeskySolverD(n, moved.row, moved.col, moved.data, MatrixType.COO)

    def solve(right):
        solution = np.zeros((n, 1))
        solver.solve(np.ascontiguousarray(right.reshape(n, 1), dtype=np.float64), solution)
        return solution[:, 0]

    inverse = LinearOperator((n, n), matvec=solve, dtype=np.float64)
    return eigsh(stiffness.tocsc(), K, mass.tocsc(), sigma=sigma, which="LM", OPinv=inverse)[0]


def by_lobpcg(stiffness, mass):
    """LOBPCG with smoothed aggregation of PyAMG as its preconditioner."""
    from pyamg import smoothed_aggregation_solver

    moved = sp.csr_matrix(stiffness - small_shift(stiffness, mass) * mass)
    moved.indices, moved.indptr = moved.indices.astype(np.int32), moved.indptr.astype(np.int32)
    precondition = smoothed_aggregation_solver(moved).aspreconditioner()
    start = np.random.default_rng(0).standard_normal((moved.shape[0], K + 10))
    values, _ = lobpcg(
        stiffness.tocsr(), start, mass.tocsr(), precondition, largest=False, tol=1e-8, maxiter=300
    )
    return np.sort(values)[:K]


SOLVERS = {
    "certeig": by_certeig,
    "eigsh": by_eigsh,
    "eigsh, CHOLMOD": by_cholmod,
    "LOBPCG, PyAMG": by_lobpcg,
}


def run_alone(matrix, solver):
    """Solve in this process, and print the CPU seconds, the peak of memory and the eigenvalues as JSON."""
    stiffness, mass = (sp.csr_array(each) for each in MATRICES[matrix]())
    before = peak_memory()
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST + 5))
    start = time.process_time()
    values = SOLVERS[solver](stiffness, mass)
    facts = {
        "seconds": time.process_time() - start,
        "megabytes": peak_memory() - before,
        "values": np.sort(values).tolist(),
    }
    print(json.dumps(facts))


def peak_memory():
    """Return the largest memory of this process so far, in MB."""
    unit = 2**20 if platform.system() == "Darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def missed(values, exact, stiffness, mass):
    """Count the eigenvalues below the last one found that no found one is close to, by inertia and by LAPACK."""
    size = max(abs(values[-1]), 1e-300)
    top = values[-1] - CLOSE * size
    by_inertia = certeig.count_below(stiffness, mass, top) - int(np.count_nonzero(values < top))
    if exact is None:
        return f"{by_inertia}"
    off = int(np.count_nonzero(np.abs(values - exact[:K]) > CLOSE * max(exact[K - 1], 1e-300)))
    return f"{by_inertia} ({off} differ from LAPACK)"


def main():
    """Print a table in Markdown."""
    names = ("numpy", "scipy", "certeig", "cholespy", "pyamg")
    versions = ", ".join(f"{name} {version(name)}" for name in names)
    print(f"{platform.machine()}, Python {platform.python_version()}, {versions}; k = {K}\n")
    print("| matrix | n | solver | CPU seconds | MB beyond the matrices | missed |")
    print("|---|---|---|---|---|---|")
    for matrix, make in MATRICES.items():
        stiffness, mass = (sp.csr_array(each) for each in make())
        n = stiffness.shape[0]
        exact = None
        if n <= DENSE:
            exact = sl.eigh(stiffness.toarray(), mass.toarray(), subset_by_index=[0, K - 1])[0]
        for solver in SOLVERS:
            command = [sys.executable, __file__, matrix, solver]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode == -signal.SIGXCPU:
                print(f"| {matrix} | {n} | {solver} | more than {LONGEST} | | |", flush=True)
                continue
            if done.returncode:
                error = done.stderr.strip().splitlines()[-1][:80]
                print(f"| {matrix} | {n} | {solver} | failed: {error} | | |", flush=True)
                continue
            facts = json.loads(done.stdout.splitlines()[-1])
            try:
                count = missed(np.array(facts["values"]), exact, stiffness, mass)
            except certeig.ConvergenceError:
                count = "not counted: rounding"
            numbers = f"{facts['seconds']:.1f} | {facts['megabytes']:.0f}"
            print(f"| {matrix} | {n} | {solver} | {numbers} | {count} |", flush=True)


if __name__ == "__main__":
    if sys.argv[1:]:
        run_alone(*sys.argv[1:])
    else:
        main()
