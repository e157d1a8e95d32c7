"""Milliseconds to bend a shape: steps 1 and 2, and step 3, beside as-rigid-as-possible (thesis table 6.1).

    python benchmarks/bench_deform.py                       7,000 to 100,000 vertices; three minutes
    python benchmarks/bench_deform.py --quick               2,500 vertices, seconds

The tail half of a giraffe turns by 60° (8 modes), or one leg (50). `bind`, and details of a skeleton, are done once a
region, steps 1 and 2 at each move of the hand, step 3 when it lets go. ARAP starts at rest, the same vertices held: ten
rounds of ours, ten of libigl's after its preparation. Each size has a process of its own.
"""

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import igl
import numpy as np
from bench_features import surface
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of

import eigenshape as es

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "experiments" / "ch6_deformation")]
from peers import as_rigid_as_possible  # noqa: E402

FULL = {  # vertices, splits, region: the thesis' modes, steps 1 and 2, and step 3, on a model of that size, in ms
    (7_000, 0, "half"): ("camel, 7k, 8 modes", 2, 49),
    (6_250, 1, "leg"): ("armadillo, 25k, 50 modes", 18, 125),
    (6_250, 1, "half"): ("dragon, 22.5k, 8 modes", 13, 161),
    (25_000, 1, "leg"): ("", None, None),
    (25_000, 1, "half"): ("", None, None),
}
QUICK = {(2_500, 0, "half"): ("", None, None)}
ROUNDS = 10
PACKAGES = ["eigenshape", "numpy", "scipy", "libigl"]
STEPS = {
    "rig": "rig, once",
    "bind": "bind",
    "detail": "details",
    "drag": "steps 1 and 2",
    "thesis": "step 3, thesis",
    "graded": "step 3, graded",
    "arap": "ARAP, ours",
    "igl_ready": "libigl, preparation",
    "igl": "ARAP, libigl",
}
COLUMNS = (
    "vertices, region",
    "modes",
    "free",
    *STEPS.values(),
    "MiB",
    "the thesis, then: 1 and 2; 3",
)


def region_of(mesh: es.TriangleMesh, name: str) -> np.ndarray:
    """Return the half nearest to the tail, or what lies within a quarter of the height of a foot, along the surface."""
    if name == "half":
        # In one piece: of the half behind the middle, a front foot was a patch of its own.
        (away,) = es.geometry.geodesic_distances(mesh, [int(np.argmin(mesh.vertices[:, 2]))])
        return away < np.median(away)
    height = np.ptp(mesh.vertices[:, 1])
    foot = int(np.argmin(mesh.vertices[:, 1] + 1e-3 * mesh.vertices[:, 2]))
    return es.deformation.region_mask(
        mesh, es.deformation.BrushRegion(mesh.vertices[foot], 0.25 * height)
    )


def by_libigl(
    binding: es.deformation.Binding,
    goal: np.ndarray,
    timed: Callable[[str, Callable[[], object]], object],
) -> None:
    """Measure libigl's preparation and rounds."""
    mesh = binding.rig.mesh
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    held = np.setdiff1d(np.arange(mesh.n_vertices), binding.part.free).astype(np.int32)
    data, places = igl.ARAPData(), np.ascontiguousarray(goal[held])
    data.max_iter = ROUNDS
    timed("igl_ready", lambda: igl.arap_precomputation(vertices, faces, 3, held, data))
    timed("igl", lambda: igl.arap_solve(places, data, vertices))


def bent(saved: str, region: str) -> Row:
    """Measure all steps on one mesh; run in a process of its own."""
    with np.load(saved) as arrays:
        mesh = es.TriangleMesh(arrays["vertices"], arrays["faces"])
    row: Row = {}

    def timed(step: str, work: Callable[[], object]) -> object:
        start = time.process_time()
        done = work()
        row[step] = 1e3 * (time.process_time() - start)
        return done

    def often(step: str, work: Callable[[], object], times: int = 5) -> object:
        done = work()
        seconds = []
        for _ in range(times):
            timed(step, work)
            seconds.append(row[step])
        row[step] = statistics.median(seconds)
        return done

    before, mask = memory_now(), region_of(mesh, region)
    rig = timed("rig", lambda: es.rig_shape(mesh))
    binding = often("bind", lambda: es.deformation.bind(rig, [mask]))
    skeleton = often("detail", lambda: es.deformation.detailed_skeleton(binding))
    pivot = mesh.vertices[es.deformation.region_boundary(mesh, mask)].mean(axis=0)
    handles = [es.Rotation(pivot, [1, 0, 0], np.pi / 3)]
    often("drag", lambda: es.deformation.move_skeleton(skeleton.response, handles))
    often("thesis", lambda: es.deformation.eigen_deformation(skeleton, handles))
    goal = often("graded", lambda: es.deformation.bend(binding, handles)).vertices
    often("arap", lambda: as_rigid_as_possible(binding, handles, n_rounds=ROUNDS))
    by_libigl(binding, goal, timed)
    free = len(binding.part.free) / mesh.n_vertices
    return row | {"modes": int(binding.n_modes[0]), "free": free, "memory": peak_memory() - before}


def measure(
    sizes: dict[tuple[int, int, str], tuple[str, int | None, int | None]], report: Report
) -> None:
    """Measure shapes of several sizes."""
    for (base, splits, region), printed in sizes.items():
        mesh = surface(base, splits)
        with tempfile.TemporaryDirectory() as folder:
            saved = str(Path(folder) / "mesh.npz")
            np.savez(saved, vertices=mesh.vertices, faces=mesh.faces)
            runs = [in_process(bent, saved, region) for _ in range(report.options.repeats)]
        medians = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
        report.add({"what": f"{mesh.n_vertices:,}, {region}", "printed": printed} | medians)


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    name, early, late = row["printed"]
    then = f"{early}; {late} ({name})" if name else ""
    times = [f"{row[step]:,.0f}" if row[step] >= 100 else f"{row[step]:.3g}" for step in STEPS]
    return [
        row["what"],
        f"{row['modes']}",
        f"{100 * row['free']:.0f} %",
        *times,
        f"{row['memory']:.0f}",
        then,
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    options = options_of(__doc__).parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells)
    measure(QUICK if options.quick else FULL, report)


if __name__ == "__main__":
    main()
