"""Time and memory of `merge_tree` beside GUDHI on wavy and on random functions, in one run on one core.

    python benchmarks/bench_merge.py                        15,000, 100,000 and a million vertices; a few minutes
    python benchmarks/bench_merge.py --quick                600 vertices, seconds

GUDHI is asked three times: for the persistence of the whole mesh, whose pairs of triangles and edges are ours and are
compared with them; for that of its vertices and edges alone, which is enough for maxima; and for ToMATo on the same
graph, which returns a label a vertex as we do a label a face. Its complexes are filled by `insert_batch`, as its
documentation advises. Each call has a process of its own, after a small one that loads what it needs.
"""

import statistics
import time
import warnings
from collections.abc import Callable

import gudhi
import numpy as np
import scipy.sparse as sp
from gudhi.clustering.tomato import Tomato
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of, ratio_text

import eigenshape as es

FULL, QUICK = (15_000, 100_000, 1_000_000), (600,)
COLUMNS = ("vertices, function", "method", "CPU s", "ratio", "wall s", "MiB", "maxima")


def surface(n: int) -> es.TriangleMesh:
    """Return a torus of about n vertices."""
    around = round((3 * n) ** 0.5)
    return es.shapes.torus(around, max(n // around, 3))


def values(mesh: es.TriangleMesh, function: str) -> np.ndarray:
    """Return waves of some twenty maxima, or noise with a maximum at every seventh vertex."""
    if function == "noise":
        return np.random.default_rng(0).standard_normal(mesh.n_vertices)
    x, y, z = mesh.vertices.T
    return np.sin(6 * x + 1) * np.cos(5 * y) + 0.3 * np.sin(9 * z)


def ours(mesh: es.TriangleMesh, height: np.ndarray) -> np.ndarray:
    """Return persistences of the maxima, falling."""
    return es.merge_tree(mesh, height).persistence


def gudhi_mesh(mesh: es.TriangleMesh, height: np.ndarray) -> np.ndarray:
    """Pair triangles with edges in the sublevel filtration; a triangle that is never paired lasts for ever."""
    complex_ = _complex(mesh, height)
    complex_.insert_batch(np.ascontiguousarray(mesh.faces.T), height[mesh.faces].max(axis=1))
    complex_.compute_persistence(homology_coeff_field=2, persistence_dim_max=True)
    pairs = (
        complex_.persistence_intervals_in_dimension(1),
        complex_.persistence_intervals_in_dimension(2),
    )
    finite = pairs[0][np.isfinite(pairs[0][:, 1])]
    return np.sort(np.concatenate([finite[:, 1] - finite[:, 0], pairs[1][:, 1]]))[::-1]


def gudhi_graph(mesh: es.TriangleMesh, height: np.ndarray) -> np.ndarray:
    """Pair vertices with edges where minus the function falls."""
    complex_ = _complex(mesh, -height)
    complex_.compute_persistence(homology_coeff_field=2)
    pairs = complex_.persistence_intervals_in_dimension(0)
    return np.sort(pairs[:, 1] - pairs[:, 0])[::-1]


def _complex(mesh: es.TriangleMesh, height: np.ndarray) -> gudhi.SimplexTree:
    edges = es.geometry.edge_table(mesh).edges
    complex_ = gudhi.SimplexTree()
    complex_.insert_batch(np.arange(mesh.n_vertices)[None], height)
    complex_.insert_batch(np.ascontiguousarray(edges.T), height[edges].max(axis=1))
    return complex_


def gudhi_tomato(mesh: es.TriangleMesh, height: np.ndarray) -> np.ndarray:
    """Let ToMATo climb and merge on the graph of edges."""
    graph = sp.csr_array(es.operators.edge_graph(mesh))
    neighbors = np.split(graph.indices, graph.indptr[1:-1])
    found = Tomato(graph_type="manual", density_type="manual").fit(neighbors, weights=height)
    finite = -np.diff(found.diagram_, axis=1)[:, 0]
    return np.sort(np.append(finite[finite > 0], np.full(len(found.max_weight_per_cc_), np.inf)))[
        ::-1
    ]


METHODS: dict[str, Callable[[es.TriangleMesh, np.ndarray], np.ndarray]] = {
    "eigenshape": ours,
    "GUDHI, whole mesh": gudhi_mesh,
    "GUDHI, vertices and edges": gudhi_graph,
    "GUDHI, ToMATo": gudhi_tomato,
}


def measured(method: str, n: int, function: str) -> Row:
    """Return seconds and MiB of one call, and what it found; run in a process of its own."""
    warnings.simplefilter("ignore")
    small = surface(200)
    METHODS[method](small, values(small, function))
    mesh = surface(n)
    height, before = values(mesh, function), memory_now()
    wall, cpu = time.perf_counter(), time.process_time()
    persistence = METHODS[method](mesh, height)
    found = {
        "wall": time.perf_counter() - wall,
        "cpu": time.process_time() - cpu,
        "memory": peak_memory() - before,
    }
    equal = method == "GUDHI, whole mesh" and np.array_equal(persistence, ours(mesh, height))
    return found | {"n": mesh.n_vertices, "maxima": len(persistence), "equals_ours": bool(equal)}


def rows_of(n: int, function: str, repeats: int) -> list[Row]:
    """Measure all methods on one function, taking turns; the median of each."""
    runs: dict[str, list[Row]] = {method: [] for method in METHODS}
    for _ in range(repeats):
        for method, done in runs.items():
            done.append(in_process(measured, method, n, function))
    rows = []
    for method, done in runs.items():
        medians = {
            key: statistics.median(run[key] for run in done) for key in ("cpu", "wall", "memory")
        }
        rows.append({"method": method, "function": function, "runs": len(done)} | done[0] | medians)
    return [row | {"ratio": row["cpu"] / rows[0]["cpu"]} for row in rows]


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    return [
        f"{row['n']:,}, {row['function']}",
        row["method"] + (" (same pairs)" if row["equals_ours"] else ""),
        f"{row['cpu']:.3f}",
        ratio_text(row["ratio"]),
        f"{row['wall']:.3f}",
        f"{row['memory']:.0f}",
        f"{row['maxima']:,}",
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    options = options_of(__doc__).parse_args()
    report = Report(["eigenshape", "gudhi", "numpy", "scipy"], options, COLUMNS, cells)
    for n in QUICK if options.quick else FULL:
        for function in ("waves", "noise"):
            for row in rows_of(n, function, options.repeats):
                report.add(row)


if __name__ == "__main__":
    main()
