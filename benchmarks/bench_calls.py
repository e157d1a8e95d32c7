"""Single calls of the library, one after the other: what the pages say that they cost.

    python benchmarks/bench_calls.py                    two minutes
    python benchmarks/bench_calls.py --quick            small shapes, seconds
    python benchmarks/bench_calls.py --only matching    one group

Each group has a process of its own with one thread. It runs once on a small shape, which loads what it
needs.
"""

import time
from collections.abc import Callable, Iterator

import numpy as np
from report import Report, Row, in_process, options_of

import eigenshape as es

PACKAGES = ["eigenshape", "pyfmaps", "numpy", "scipy"]
COLUMNS = ("shape", "call", "CPU s", "wall s")
Call = tuple[str, Callable[[], object]]
BUILDS: dict[str, Callable[[es.TriangleMesh], es.Laplacian]] = {
    "cotangent_laplacian": es.cotangent_laplacian,
    "robust_laplacian": es.robust_laplacian,
    "fem_laplacian, order=2": es.operators.fem_laplacian,
    "mesh_laplacian": es.mesh_laplacian,
    'mesh_laplacian, correct="log"': lambda mesh: es.mesh_laplacian(mesh, correct="log"),
    'mesh_laplacian, distance="geodesic"': lambda mesh: es.mesh_laplacian(
        mesh, distance="geodesic"
    ),
    "point_cloud_laplacian": lambda mesh: es.point_cloud_laplacian(es.PointCloud(mesh.points, 2)),
}


def operators(*, small: bool) -> Iterator[Call]:
    """Yield builds and solves of operators on an even sphere."""
    mesh = es.shapes.fibonacci_sphere(600 if small else 6_250)
    for name, build in BUILDS.items():
        laplacian = build(mesh)
        yield f"{name}: build", lambda build=build: build(mesh)
        yield f"{name}: 36 pairs", lambda built=laplacian: es.solve_spectrum(built, 36)


def brackets(*, small: bool) -> Iterator[Call]:
    """Yield a hundred eigenvalues of an even sphere, and their brackets."""
    mesh = es.shapes.fibonacci_sphere(400 if small else 3_500)
    k = 20 if small else 100
    yield f"{k} certified pairs", lambda: es.solve_spectrum(es.cotangent_laplacian(mesh), k)
    yield f"{k} brackets", lambda: es.spectral.bracket_eigenvalues(mesh, k)


def tools(*, small: bool) -> Iterator[Call]:
    """Yield what works on a spectrum of a creature."""
    mesh = es.make_creature("giraffe", n_vertices=1_000 if small else 50_000)
    laplacian = es.cotangent_laplacian(mesh)
    spectrum = es.solve_spectrum(laplacian, 100)
    yield "100 certified pairs", lambda: es.solve_spectrum(laplacian, 100)
    yield (
        "project and reconstruct",
        lambda: es.spectral.reconstruct(es.spectral.project(mesh.vertices, spectrum), spectrum),
    )
    cutoff = spectrum.eigenvalues[50]

    def low(eigenvalues: np.ndarray) -> np.ndarray:
        return eigenvalues <= cutoff

    yield "filter_values", lambda: es.spectral.filter_values(mesh.vertices[:, 0], spectrum, low)
    yield "smooth_mesh", lambda: es.spectral.smooth_mesh(mesh, spectrum, low)
    sources = np.arange(10)
    yield "biharmonic distances of 10", lambda: es.spectral.spectral_distances(spectrum, sources)
    yield "8 clusters", lambda: es.spectral.spectral_clusters(spectrum, 8)
    area = es.geometry.surface_area(mesh)
    heat = mesh.vertices[:, [0]]
    yield (
        "apply_heat, without a spectrum",
        lambda: es.spectral.apply_heat(laplacian, heat, 0.01 * area),
    )


def compression(*, small: bool) -> Iterator[Call]:
    """Yield a mesh to its small file and back."""
    mesh = es.make_creature("giraffe", n_vertices=1_000 if small else 50_000)
    packed = es.spectral.compress_mesh(mesh)
    yield "compress_mesh", lambda: es.spectral.compress_mesh(mesh)
    yield "decompress_mesh", lambda: es.spectral.decompress_mesh(packed.data)


def matching(*, small: bool) -> Iterator[Call]:
    """Yield what is done with a whole, and with a part of it in another pose, seen from one side."""
    n = 1_500 if small else 5_000
    whole = es.make_creature("quadruped", 1, n_vertices=n)
    yield "100 certified pairs", lambda: es.solve_spectrum(es.cotangent_laplacian(whole), 100)
    yield "describe", lambda: es.describe(whole)
    yield "find_parts", lambda: es.find_parts(whole)
    part = es.partial_scan(es.make_creature("quadruped", 2, n_vertices=n), [0.9, 0.25, 0.45]).mesh
    target = es.matching.prepare_target(whole)
    yield "prepare_target", lambda: es.matching.prepare_target(whole)
    yield "match_shapes, a scan", lambda: es.match_shapes(part, target)
    pose = es.make_creature("quadruped", 3, n_vertices=n)
    yield "match_shapes, a whole", lambda: es.match_shapes(pose, target)
    yield "pyFM, the same two wholes", lambda: map_by_pyfm(pose, whole)


def map_by_pyfm(one: es.TriangleMesh, other: es.TriangleMesh) -> np.ndarray:
    """Return the map of pyFM as its documentation makes it, spectra included."""
    from pyFM.functional import FunctionalMapping  # noqa: PLC0415 - only this group needs it
    from pyFM.mesh import TriMesh  # noqa: PLC0415

    meshes = (TriMesh(np.array(mesh.vertices), np.array(mesh.faces)) for mesh in (one, other))
    model = FunctionalMapping(*meshes)
    model.preprocess()
    model.fit()
    model.zoomout_refine()
    return np.asarray(model.get_p2p())


GROUPS: dict[str, tuple[str, Callable[..., Iterator[Call]]]] = {
    "operators": ("sphere, 6,250 points", operators),
    "brackets": ("sphere, 3,500 points", brackets),
    "tools": ("giraffe, 50,000 vertices", tools),
    "compression": ("giraffe, 50,000 vertices", compression),
    "matching": ("quadruped, 5,000 vertices", matching),
}


def measured(group: str, repeats: int, quick: bool) -> Row:
    """Return medians of all calls of a group."""
    title, calls = GROUPS[group]
    for _, call in calls(small=True):
        call()
    rows = []
    for name, call in calls(small=quick):
        runs = []
        for _ in range(repeats):
            wall, cpu = time.perf_counter(), time.process_time()
            call()
            runs.append((time.process_time() - cpu, time.perf_counter() - wall))
        cpu, wall = np.median(runs, axis=0).tolist()
        rows.append({"shape": f"{title}{', smaller' if quick else ''}", "call": name})
        rows[-1] |= {"cpu": cpu, "wall": wall}
    return {"rows": rows}


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    return [row["shape"], row["call"], f"{row['cpu']:.2g}", f"{row['wall']:.2g}"]


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--only", nargs="+", choices=GROUPS, default=list(GROUPS))
    options = parser.parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells)
    for group in options.only:
        for row in in_process(measured, group, options.repeats, options.quick)["rows"]:
            report.add(row)


if __name__ == "__main__":
    main()
