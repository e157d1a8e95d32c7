"""What the first call of a process costs: imports and work, beside peers.

    python benchmarks/bench_first_call.py                    all calls, about two minutes
    python benchmarks/bench_first_call.py --quick            one call and its peers on a small mesh, seconds
    python benchmarks/bench_first_call.py --calls solve,find_parts

Libraries take turns, each run in a process of its own, and figures are medians. NumPy is imported before the clock
starts, since every library needs it. CPU seconds are of all threads, user and system.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from report import THREADS, Report, Row, options_of, ratio_text

COLUMNS = (
    "call",
    "library",
    "import, CPU s",
    "first call",
    "ratio",
    "both",
    "second call",
)
N_VERTICES = 5000
QUICK = ("solve", 600)  # the call, and vertices of its mesh

# What a user writes: imports, then the call, on vertices v and faces f.
OURS = "import eigenshape as es"
CALLS = {
    "solve": {
        "eigenshape": (
            OURS,
            "es.solve_spectrum(es.cotangent_laplacian(es.TriangleMesh(v, f)), 100)",
        ),
        "LaPy": ("import lapy", "lapy.Solver(lapy.TriaMesh(v, f), lump=True).eigs(100)"),
        "robust_laplacian": (
            "import robust_laplacian; from scipy.sparse.linalg import eigsh",
            "L, M = robust_laplacian.mesh_laplacian(v, f); eigsh(L, 100, M, sigma=1e-8)",
        ),
    },
    "describe": {
        "eigenshape": (OURS, "es.describe(es.TriangleMesh(v, f), es.retrieval.SCALE_FREE)"),
        "LaPy, ShapeDNA": (
            "import lapy.shapedna",
            "lapy.shapedna.compute_shapedna(lapy.TriaMesh(v, f), k=50)",
        ),
    },
    "describe by patches": {"eigenshape": (OURS, "es.describe(es.TriangleMesh(v, f))")},
    "find_parts": {"eigenshape": (OURS, "es.find_parts(es.TriangleMesh(v, f))")},
    "mesh_laplacian": {
        "eigenshape": (
            OURS,
            "es.solve_spectrum(es.operators.mesh_laplacian(es.TriangleMesh(v, f)), 50)",
        ),
    },
    "deform": {
        "eigenshape": (
            OURS,
            "es.deform(es.rig_shape(es.TriangleMesh(v, f)), "
            "es.deformation.BrushRegion(v[v[:, 1].argmax()], 0.5), "
            "es.deformation.Rotation(v.mean(axis=0), (0, 0, 1), 0.4))",
        ),
    },
}
WORKER = """
import json, sys, time
import numpy as np

imports, call, path = sys.argv[1:]
with np.load(path) as arrays:
    v, f = arrays["v"], arrays["f"]
times = [time.process_time()]
for step in (imports, call, call):
    exec(step)
    times.append(time.process_time())
print(json.dumps(np.diff(times).tolist()))
"""


def run_once(imports: str, call: str, mesh: Path) -> list[float]:
    """Return the CPU seconds of the imports, of the first and of the second call in a new process."""
    environment = os.environ | dict.fromkeys(THREADS, "1")
    command = [sys.executable, "-W", "ignore", "-c", WORKER, imports, call, str(mesh)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{call} failed:\n{done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def rows_of(name: str, mesh: Path, repeats: int) -> list[Row]:
    """Measure all libraries on one call, taking turns; the median of each."""
    runs: dict[str, list[Row]] = {library: [] for library in CALLS[name]}
    for _ in range(repeats):
        for library, done in runs.items():
            loaded, first, again = run_once(*CALLS[name][library], mesh)
            done.append({"import": loaded, "first": first, "both": loaded + first, "second": again})
    rows = []
    for library, done in runs.items():
        medians = {key: statistics.median(run[key] for run in done) for key in done[0]}
        rows.append({"call": name, "library": library, "runs": done} | medians)
    return [row | {"ratio": row["first"] / rows[0]["first"]} for row in rows]


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    seconds = [f"{row[key]:.2f}" for key in ("import", "first", "both", "second")]
    return [row["call"], row["library"], *seconds[:2], ratio_text(row["ratio"]), *seconds[2:]]


def save_mesh(path: Path, n_vertices: int) -> None:
    """Write a mesh in a process of its own: this one loads nothing that it measures."""
    code = (
        "import sys; import numpy as np; import eigenshape as es; "
        "mesh = es.make_creature('quadruped', n_vertices=int(sys.argv[2])); "
        "np.savez(sys.argv[1], v=mesh.vertices, f=mesh.faces)"
    )
    subprocess.run([sys.executable, "-c", code, str(path), str(n_vertices)], check=True)


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--calls", help=f"of {', '.join(CALLS)}, separated by commas")
    options = parser.parse_args()
    chosen, n_vertices = (QUICK[:1], QUICK[1]) if options.quick else (tuple(CALLS), N_VERTICES)
    if options.calls:
        chosen = tuple(options.calls.split(","))
        unknown = [name for name in chosen if name not in CALLS]
        if unknown:
            sys.exit(f"Calls must be of {', '.join(CALLS)}; {unknown[0]!r} is not.")
    packages = ["eigenshape", "lapy", "robust_laplacian", "numpy", "scipy"]
    report = Report(packages, options, COLUMNS, cells)
    with tempfile.TemporaryDirectory() as folder:
        mesh = Path(folder) / "mesh.npz"
        save_mesh(mesh, n_vertices)
        for name in chosen:
            for row in rows_of(name, mesh, options.repeats):
                report.add(row)


if __name__ == "__main__":
    main()
