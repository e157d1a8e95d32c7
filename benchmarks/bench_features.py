"""From a mesh to fifteen feature points with their heat at fifteen times, beside libraries put together for it.

    python benchmarks/bench_features.py                        15,000 to a million vertices; five minutes
    python benchmarks/bench_features.py --quick                2,500 vertices, seconds

The thesis preset: 300 pairs, heat at fifteen times, the most persistent maxima of the first (thesis 5.4, table 5.3).
Others have no such call: pyFM's and LaPy's eigenpairs, the sum of the signature (pyFM's own, NumPy's for LaPy), and
ToMATo of GUDHI on the graph of edges. A library is left out where its last time or memory, in proportion to vertices,
goes beyond 100 seconds or 10 GiB. Each call has a process of its own, after a small one that loads what it needs.
"""

import statistics
import tempfile
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from gudhi.clustering.tomato import Tomato
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of

import eigenshape as es

FULL = (
    (15_000, 0),
    (25_000, 1),
    (62_500, 2),
)  # vertices of a creature, and how often faces are split
QUICK = ((2_500, 0),)
LIMIT, MEMORY = 100.0, 10_000  # seconds and MiB
ONCE = 20.0  # seconds, from which one run is enough
K, N_FEATURES = 300, 15
OURS = ("eigenshape", "eigenshape, 1e-3")
PACKAGES = ["eigenshape", "pyfmaps", "lapy", "gudhi", "numpy", "scipy"]
COLUMNS = (
    "vertices",
    "method",
    "CPU s",
    "wall s",
    "MiB",
    "true error",
    "stated error",
    "features off",
    "same",
)


def surface(base: int, splits: int) -> es.TriangleMesh:
    """Return a giraffe in a unit box, each face split in four so often."""
    mesh = es.make_creature("giraffe", 1, n_vertices=base)
    for _ in range(splits):
        table = es.geometry.edge_table(mesh)
        a, b, c = mesh.faces.T
        x, y, z = (mesh.n_vertices + table.face_edges).T
        corners = [(a, z, y), (z, b, x), (y, x, c), (x, y, z)]
        points = np.concatenate([mesh.vertices, mesh.vertices[table.edges].mean(axis=1)])
        mesh = es.TriangleMesh(points, np.concatenate([np.column_stack(face) for face in corners]))
    return es.geometry.normalize_mesh(mesh, "box")


def times() -> np.ndarray:
    """Return the thesis' times."""
    return es.retrieval.THESIS.time_unit * np.array(es.retrieval.THESIS.scales)


def ours(mesh: es.TriangleMesh, accuracy: float = 1e-2) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the heat at the first time, the features, and the stated error; the accuracy is the usual one."""
    found = es.retrieval.find_heat_features(mesh, es.retrieval.THESIS, accuracy=accuracy)
    return found.heat, found.descriptor.vertices, found.error


def exact(mesh: es.TriangleMesh) -> tuple[np.ndarray, np.ndarray, float]:
    """Take the certified spectrum."""
    found = es.retrieval.find_heat_features(mesh, es.retrieval.THESIS)
    return found.heat, found.descriptor.vertices, 0.0


def pyfm(mesh: es.TriangleMesh) -> tuple[np.ndarray, np.ndarray, float]:
    """Take pyFM's spectrum and signature."""
    from pyFM.mesh import TriMesh
    from pyFM.signatures.HKS_functions import HKS

    theirs = TriMesh(np.array(mesh.vertices), np.array(mesh.faces)).process(k=K, intrinsic=False)
    heat = HKS(theirs.eigenvalues, theirs.eigenvectors, times())
    return heat[:, 0], tomato(mesh, heat[:, 0]), 0.0


def lapy(mesh: es.TriangleMesh) -> tuple[np.ndarray, np.ndarray, float]:
    """Take LaPy's spectrum, of the consistent mass, and sum the signature."""
    from lapy import Solver, TriaMesh

    values, vectors = Solver(TriaMesh(mesh.vertices, mesh.faces)).eigs(K)
    heat = vectors**2 @ np.exp(-np.outer(values, times()))
    return heat[:, 0], tomato(mesh, heat[:, 0]), 0.0


def tomato(mesh: es.TriangleMesh, heat: np.ndarray) -> np.ndarray:
    """Return the vertices of the most persistent maxima, highest first in each of ToMATo's clusters."""
    graph = sp.csr_array(es.operators.edge_graph(mesh))
    neighbors = np.split(graph.indices, graph.indptr[1:-1])
    found = Tomato(graph_type="manual", density_type="manual", n_clusters=N_FEATURES).fit(
        neighbors, weights=heat
    )
    order = np.lexsort((-heat, found.labels_))
    return order[np.unique(found.labels_[order], return_index=True)[1]]


METHODS: dict[str, Callable[[es.TriangleMesh], tuple[np.ndarray, np.ndarray, float]]] = {
    "eigenshape, certified": exact,
    "eigenshape": ours,
    "eigenshape, 1e-3": partial(ours, accuracy=1e-3),
    "pyFM and ToMATo": pyfm,
    "LaPy, NumPy and ToMATo": lapy,
}


def measured(method: str, saved: str, reference: str) -> Row:
    """Return seconds and MiB of one call, and how far it is from the certified one; run in a process of its own."""
    warnings.simplefilter("ignore")
    METHODS[method](es.make_creature("hand", n_vertices=1500))
    if method in OURS:
        es.spectral.approximate_heat_signature(
            es.cotangent_laplacian(es.shapes.torus(120, 80)), 9, [0.1]
        )
    with np.load(saved) as arrays:
        mesh = es.TriangleMesh(arrays["vertices"], arrays["faces"])
    before, wall, cpu = memory_now(), time.perf_counter(), time.process_time()
    heat, features, stated = METHODS[method](mesh)
    row = {
        "wall": time.perf_counter() - wall,
        "cpu": time.process_time() - cpu,
        "memory": peak_memory() - before,
    }
    if method == "eigenshape, certified":
        np.savez(reference, heat=heat, features=features)
    return row | {"stated": stated} | compared(mesh, heat, features, reference)


def compared(mesh: es.TriangleMesh, heat: np.ndarray, features: np.ndarray, reference: str) -> Row:
    """Return the heat's relative error, how many features are beyond 2 % of √area from all certified, and equal."""
    if not Path(reference).exists():
        return {}
    with np.load(reference) as arrays:
        known, points = arrays["heat"], arrays["features"]
    mass = es.geometry.dual_volumes(mesh)
    apart = np.linalg.norm(mesh.vertices[features][:, None] - mesh.vertices[points], axis=2).min(
        axis=1
    )
    off = apart > 0.02 * np.sqrt(es.geometry.surface_area(mesh))
    true = float(np.sqrt(mass @ (heat - known) ** 2 / (mass @ known**2)))
    return {
        "true": true,
        "features_off": int(off.sum()),
        "same": len(np.intersect1d(features, points)),
    }


def measure(base: int, splits: int, last: dict[str, np.ndarray], report: Report) -> None:
    """Measure all methods that the limit allows on one surface; the median of each."""
    mesh = surface(base, splits)
    with tempfile.TemporaryDirectory() as folder:
        saved, reference = str(Path(folder) / "mesh.npz"), str(Path(folder) / "known.npz")
        np.savez(saved, vertices=mesh.vertices, faces=mesh.faces)
        for method in METHODS:
            expected = last.get(method, np.zeros(2)) * mesh.n_vertices
            row: Row = {"n": mesh.n_vertices, "method": method, "expected": expected.tolist()}
            if method in OURS or (expected <= [LIMIT, MEMORY]).all():
                row |= median_of(method, saved, reference, report.options.repeats)
                last[method] = np.array([row["cpu"], row["memory"]]) / mesh.n_vertices
            report.add(row)


def median_of(method: str, saved: str, reference: str, repeats: int) -> Row:
    """Return the medians of runs, of one where it is long."""
    runs: list[Row] = []
    while len(runs) < repeats and not (runs and runs[0]["cpu"] > ONCE):
        runs.append(in_process(measured, method, saved, reference))
    medians = {
        key: statistics.median(run[key] for run in runs) for key in ("cpu", "wall", "memory")
    }
    return {"runs": len(runs)} | runs[0] | medians


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    name = [f"{row['n']:,}", row["method"]]
    seconds, mebibytes = row["expected"]
    if "cpu" not in row:
        return [*name, f"not run: {seconds:.0f} or more", "", f"{mebibytes:.0f} or more", *[""] * 4]
    runs = "" if row["runs"] >= 3 else f" ({row['runs']} run{'s' * (row['runs'] > 1)})"
    true = f"{row['true']:.1e}" if "true" in row else "not known"
    off, same = (str(row.get(key, "not known")) for key in ("features_off", "same"))
    stated = f"{row['stated']:.1e}" if row["stated"] else ""
    return [
        *name,
        f"{row['cpu']:.1f}{runs}",
        f"{row['wall']:.1f}",
        f"{row['memory']:.0f}",
        true,
        stated,
        off,
        same,
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    options, last = options_of(__doc__).parse_args(), {}
    report = Report(PACKAGES, options, COLUMNS, cells)
    for base, splits in QUICK if options.quick else FULL:
        measure(base, splits, last, report)


if __name__ == "__main__":
    main()
