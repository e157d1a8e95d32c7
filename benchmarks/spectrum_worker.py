"""One solve by one library, in a process of its own: reads a task as JSON, writes what it took and what came back.

`bench_spectrum.py` starts it. Everything that a library loads on first use is used once before the clock
starts, on a small shape.
"""

import gc
import json
import os
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from machine import memory_now, peak_memory
from scipy.sparse.linalg import splu
from spectrum_libraries import LIBRARIES, Library, Matrices, Shape, pencil
from threadpoolctl import threadpool_limits

import eigenshape as es

WRONG = 1e-6  # of the largest eigenvalue in the list
CLEAR = 1e-4  # of the same: a gap that a factor's rounding does not cross


def load(path: Path) -> Shape:
    """Read a shape as `bench_spectrum.py` has put it down."""
    with np.load(path) as arrays:
        shape = dict(arrays)
    if "n" in shape:
        ends = shape["rows"], shape["columns"]
        shape["adjacency"] = sp.csr_array((shape["weights"], ends), shape=(int(shape["n"]),) * 2)
    return shape


def warm_up(library: Library) -> None:
    """Solve something small, by the road that large ones take."""
    sphere = es.icosphere(3)
    shape = {"vertices": np.array(sphere.vertices), "faces": np.array(sphere.faces)}
    shape["adjacency"] = es.operators.neighbor_graph(sphere.vertices, 6)
    try:
        library.solve(library.build(shape), 20)
    except Exception as err:  # noqa: BLE001  (what fails on the real shape is reported there)
        sys.stderr.write(f"{err}\n")


def measured(
    library: Library, shape: Shape, k: int
) -> tuple[dict[str, float], tuple[np.ndarray, np.ndarray], Matrices]:
    """Return seconds and MiB of one call, its eigenpairs, and the pencil that they are of."""
    gc.collect()
    level = memory_now()
    wall, cpu = time.perf_counter(), time.process_time()
    state = library.build(shape)
    built = time.process_time()
    values, vectors = library.solve(state, k)
    took = {
        "cpu": time.process_time() - cpu,
        "wall": time.perf_counter() - wall,
        "cpu_build": built - cpu,
    }
    peak = peak_memory()
    stiffness, mass = pencil(library, state)
    if values is None:  # vectors only: their Rayleigh quotients
        values = (vectors * (stiffness @ vectors)).sum(axis=0) / (vectors * (mass @ vectors)).sum(
            axis=0
        )
    order = np.argsort(values)
    return (
        took | {"memory": peak - level, "memory_peak": peak},
        (values[order], vectors[:, order]),
        (stiffness, mass),
    )


def worst_residual(values: np.ndarray, vectors: np.ndarray, matrices: Matrices) -> float:
    """Return the worst |Wφ - λBφ| / (λ_k |φ|), in the norms of 1/D and D, D the diagonal of B.

    With a diagonal B that is a bound of the distance from λ to an eigenvalue, relative to the last in the list.
    """
    stiffness, mass = matrices
    diagonal = mass.diagonal()[:, None]
    worst = 0.0
    for column in range(0, len(values), 32):
        part, at = vectors[:, column : column + 32], values[column : column + 32]
        rest = stiffness @ part - (mass @ part) * at
        norms = np.sqrt((rest**2 / diagonal).sum(axis=0) / (part**2 * diagonal).sum(axis=0))
        worst = max(worst, float(norms.max()))
    return worst / float(np.abs(values).max())


def reference(matrices: Matrices, k: int) -> np.ndarray:
    """Return the certified eigenvalues of a pencil, solved with its points in another order."""
    order = np.random.default_rng(0).permutation(matrices[0].shape[0])
    stiffness, mass = (sp.csr_array(matrix[order][:, order]) for matrix in matrices)
    return es.solve_spectrum(es.Laplacian(stiffness, mass), k).eigenvalues


def wrong(values: np.ndarray, expected: np.ndarray) -> int:
    """Count the places of the list where another eigenvalue belongs."""
    return int(np.count_nonzero(~(np.abs(values - expected) <= WRONG * expected[-1])))


def missing(values: np.ndarray, expected: np.ndarray) -> int:
    """Count the expected eigenvalues that the list does not have, copies counted."""
    place, absent = 0, 0
    for one in expected:
        while place < len(values) and values[place] < one - WRONG * expected[-1]:
            place += 1
        if place < len(values) and values[place] <= one + WRONG * expected[-1]:
            place += 1
        else:
            absent += 1
    return absent


def missing_by_inertia(values: np.ndarray, matrices: Matrices) -> int | None:
    """Count what lies below the last clear gap of the list and is not in the list (Sylvester's law).

    A factor by SuperLU alone, without a line of our solver; None where SuperLU had to exchange rows.
    """
    gaps = np.diff(values)
    last = int(np.flatnonzero(gaps >= min(CLEAR * np.abs(values).max(), gaps.max()))[-1])
    shift = (values[last] + values[last + 1]) / 2
    factor = splu(
        sp.csc_matrix(matrices[0] - shift * matrices[1]),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    if not np.array_equal(factor.perm_r, factor.perm_c):
        return None
    return int(np.count_nonzero(factor.U.diagonal() < 0)) - (last + 1)


def main() -> None:
    """Run the task of the command line."""
    task = json.loads(sys.argv[1])
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {task["core"]})
    warnings.simplefilter("ignore")
    library, k = LIBRARIES[task["library"]], task["k"]
    with threadpool_limits(1):
        shape = load(Path(task["shape"]))
        warm_up(library)
        try:
            found, (values, vectors), matrices = measured(library, shape, k)
        except Exception as err:  # noqa: BLE001  (a peer may raise anything: that is a result)
            print(json.dumps({"status": "failed", "reason": f"{type(err).__name__}: {err}"[:200]}))
            return
        found |= {"residual": worst_residual(values, vectors, matrices), "last": float(values[-1])}
        if task["check"]:
            expected = reference(matrices, k)
            found |= {"wrong": wrong(values, expected), "missing": missing(values, expected)}
            found["missing_by_inertia"] = missing_by_inertia(values, matrices)
    print(json.dumps({"status": "ok"} | found))


if __name__ == "__main__":
    main()
