"""Hashes of what every kernel computes, kept from before the loops were written in C.

    python tests/house/kernel_hashes.py                 compare all with kernel_hashes.json; a minute
    python tests/house/kernel_hashes.py --check front   compare the loops of front_loops.py alone; seconds
    python tests/house/kernel_hashes.py --write         keep what is computed now
    python tests/house/kernel_hashes.py --run           run the cases alone, under a sanitizer for example

A case calls public functions. A loop is hashed by all its arrays after each call, and what it
returns, on one thread; what the functions return is hashed on one, two and four threads. A loop may
gain arguments that are numbers, and split into a function that allocates and a loop: the hash does
not change as long as the outer one keeps its name and its arrays.

The digits are those of any processor with AVX2: other kernels of BLAS, and other functions of NumPy,
are switched off before these are loaded.
"""

# ruff: noqa: E402 - NumPy is loaded below these lines
import os
import sys

NEWER = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR X86_V4"
os.environ |= {"OPENBLAS_CORETYPE": "Haswell", "OPENBLAS_NUM_THREADS": "1"}
os.environ.setdefault("NPY_DISABLE_CPU_FEATURES", NEWER)

import argparse
import hashlib
import json
import tempfile
import types
import warnings
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

import eigenshape as es
from eigenshape.geometry.resolution import thinning
from eigenshape.io.attributes import MeshAttributes
from eigenshape.retrieval.search import coarse
from eigenshape.spectral.multilevel import approximate as multilevel

KEPT = Path(__file__).with_suffix(".json")
THREADS = (1, 2, 4)


def creature(n: int = 900, kind: str = "giraffe", pose: int = 1) -> es.TriangleMesh:
    """Return a posed creature."""
    return es.make_creature(kind, pose, n_vertices=n)


def damaged() -> es.TriangleMesh:
    """Return a sphere without some faces, and with an edge of three faces."""
    ball = es.icosphere(2)
    return es.TriangleMesh(
        ball.vertices * [1, 0.7, 0.5], np.delete(ball.faces, [3, 40, 41, 90], axis=0)
    )


def crossed() -> es.TriangleMesh:
    """Return two spheres that cut each other."""
    ball = es.icosphere(2)
    return es.geometry.disjoint_union(
        ball, es.TriangleMesh(ball.vertices + np.array([0.9, 0.1, 0.2]), ball.faces)
    )


def rough(mesh: es.TriangleMesh) -> np.ndarray:
    """Return a value for each vertex with many maxima."""
    return np.sin(9 * mesh.vertices).sum(axis=1)


def spectra() -> Any:
    found = [
        es.solve_spectrum(es.cotangent_laplacian(mesh), k=40)
        for mesh in (es.icosphere(3), creature())
    ]
    solid = es.shapes.ball(5)
    found.append(es.solve_spectrum(es.operators.fem_laplacian(solid), k=10))
    graph = sp.random_array((300, 300), density=0.02, rng=np.random.default_rng(3))
    links = sp.csr_array(sp.triu(graph, 1))
    found.append(es.solve_spectrum(es.operators.graph_laplacian(links + links.T, "weighted"), k=12))
    return found


def larger_spectrum() -> Any:
    return es.solve_spectrum(es.cotangent_laplacian(creature(5000, "quadruped")), k=60)


def approximate() -> Any:
    multilevel.CERTIFIED_POINTS = 0  # smaller ones would be certified
    return es.solve_spectrum(es.cotangent_laplacian(creature(5000)), k=20, method="approximate")


def merging() -> Any:
    mesh = creature()
    rng = np.random.default_rng(5)
    graph = sp.random_array((60, 50), density=0.05, rng=rng)
    cloud = es.PointCloud(rng.normal(size=(300, 3)), 2)
    return [
        es.segment(es.merge_tree(mesh, rough(mesh)), n_regions=12),
        es.features.condense(mesh, rough(mesh)),
        es.features.persistence_diagram(mesh, rough(mesh)),
        es.features.persistence_diagram(cloud, cloud.points[:, 0]),
        es.stability.maximum_matching(graph.tocsr()),
        es.stability.bottleneck_matching(rng.normal(size=(40, 3)), rng.normal(size=(40, 3))),
    ]


def parts() -> Any:
    return es.find_parts(creature(1500))


def robust() -> Any:
    cloud = es.PointCloud(es.icosphere(3).vertices * [1, 0.8, 0.6], 2)
    return [
        es.robust_laplacian(damaged()),
        es.robust_laplacian(creature()),
        es.robust_laplacian(cloud),
        es.calculus.heat_distances(creature(), [0, 5]),
    ]


def clouds() -> Any:
    points = np.random.default_rng(1).normal(size=(500, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    cloud = es.PointCloud(points, 2)
    return [
        es.point_cloud_laplacian(cloud),
        es.operators.gaussian_laplacian(points, 0.01, 2),
        es.operators.local_triangles(cloud),
        es.geometry.shape_quadrature(cloud),
    ]


def repairs() -> Any:
    ball = es.icosphere(2)
    faces = ball.faces.copy()
    faces[::2] = faces[::2, ::-1]
    inner = es.TriangleMesh(ball.vertices / 3, ball.faces)
    nested = es.geometry.disjoint_union(es.TriangleMesh(ball.vertices, faces), inner)
    return [es.repair(damaged(), ["fill_holes"]), es.repair(nested, ["orient"])]


def polygons() -> Any:
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    radii = np.where(np.arange(12) % 2, 0.4, 1.0)
    star = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(12)])
    lines = ["OFF", "12 1 0", *(" ".join(map(repr, row.tolist())) for row in star)]
    lines.append("12 " + " ".join(map(str, range(12))))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "star.off"
        path.write_text("\n".join(lines) + "\n")
        return es.read_mesh(path)


def distances() -> Any:
    mesh = creature()
    rng = np.random.default_rng(2)
    points = rng.uniform(mesh.vertices.min(axis=0), mesh.vertices.max(axis=0), size=(200, 3))
    return [
        es.geometry.geodesic_distances(mesh, [0, 17, 400]),
        es.geometry.average_geodesic_distance(mesh, n_bases=30),
        es.geometry.geodesic_balls(mesh, 0.1),
        es.geometry.closest_points(mesh, points),
        es.geometry.signed_distance(mesh, points),
        es.geometry.winding_numbers(mesh, points),
        es.geometry.self_intersections(crossed()),
    ]


def scans() -> Any:
    return [
        es.scans.simulate_scan(creature(), np.random.default_rng(4)),
        es.scans.partial_scan(creature(), [0, 0.3, 1], resolution=128),
    ]


def matching() -> Any:
    whole = creature(1200, "lizard", 0)
    scan = es.scans.partial_scan(creature(1200, "lizard", 2), [0, 0, 1]).mesh
    return es.match_shapes(scan, whole)


def thinned_matching() -> Any:
    whole = creature(5500, "bird", 0)
    return es.match_shapes(
        es.scans.partial_scan(whole, [1, 0, 0.2]).mesh, creature(1500, "bird", 0)
    )


def deforming() -> Any:
    mesh = creature(800)
    turned = mesh.vertices.copy()
    head = turned[:, 0] > np.quantile(turned[:, 0], 0.8)
    turned[head] += [0, 0.1, 0.05]
    rest = np.arange(mesh.n_vertices)
    rig = es.rig_shape(mesh)
    motion = es.Rotation(turned.mean(axis=0), [0, 0, 1], 0.6)
    return [
        es.deformation.transfer_deformation(mesh, es.TriangleMesh(turned, mesh.faces), mesh, rest),
        es.deform(rig, head, motion),
    ]


def searching() -> Any:
    with tempfile.TemporaryDirectory() as folder:
        index = es.ShapeIndex.create(Path(folder) / "index")
        for place, kind in enumerate(["giraffe", "lizard", "quadruped", "bird"]):
            index.add(f"{kind}", creature(700, kind, place))
        found = index.query(creature(700, "giraffe", 3), n_matches=3)
        described = [es.describe(creature(600, kind)) for kind in ("giraffe", "lizard")]
        return [
            [(match.name, match.score) for match in found],
            es.retrieval.patch_scores(described[0], described),
        ]


def thinned() -> Any:
    return thinning.thin_out(creature(2000), 900)


def functional() -> Any:
    measure = es.geometry.shape_quadrature(es.icosphere(3))
    return es.operators.functional_laplacian(measure, 0.02) @ measure.points


def carried() -> Any:
    ball = es.icosphere(3)
    colors = np.random.default_rng(6).integers(0, 256, size=(ball.n_faces, 3, 4)).astype(np.uint8)
    attributes = replace(MeshAttributes.plain(ball), colors=colors)
    return es.io.carry_attributes(attributes, es.icosphere(2)).colors


def scanning() -> Any:
    rng = np.random.default_rng(7)
    query = rng.integers(-200, 200, size=(5, 96), dtype=np.int16)
    rows = rng.integers(-127, 128, size=(40, 5, 96), dtype=np.int8)
    found = np.empty(40, dtype=np.float32)
    coarse.scan(query, rows, 1e-6, 0.01, found)
    return found


CASES: dict[str, Callable[[], Any]] = {
    case.__name__: case
    for case in (
        spectra, larger_spectrum, approximate, merging, parts, robust, clouds, repairs, polygons,
        distances, scans, matching, thinned_matching, thinned, deforming, searching, scanning,
        functional, carried,
    )
}  # fmt: skip


class Hash:
    """One md5 of arrays and numbers in the order in which they come."""

    def __init__(self) -> None:
        self.state = hashlib.md5(usedforsecurity=False)

    def add(self, value: Any) -> None:
        """Add a value, or the values in it."""
        if isinstance(value, np.ndarray):
            self.state.update(f"{value.dtype.str}{value.shape}".encode())
            self.state.update(np.ascontiguousarray(value).tobytes())
        elif sp.issparse(value):
            self.add((value.indptr, value.indices, value.data))
        elif is_dataclass(value):
            for field in fields(value):
                self.add(getattr(value, field.name))
        elif isinstance(value, list | tuple):
            for one in value:
                self.add(one)
        elif isinstance(value, int | float | complex | bool | np.generic):
            self.state.update(np.asarray(value, dtype=complex).tobytes())

    def digest(self) -> str:
        """Return the hash in short; the number of loops is far below 2^64."""
        return self.state.hexdigest()[:16]


def arrays_in(values: Any) -> list[np.ndarray]:
    """Return all arrays among arguments, also those in tuples."""
    if isinstance(values, np.ndarray):
        return [values]
    return (
        [array for value in values for array in arrays_in(value)]
        if isinstance(values, tuple)
        else []
    )


class Recorder:
    """Replace every loop, in all modules that call it, by one that hashes what it computes."""

    def __init__(self) -> None:
        self.found: dict[str, Hash] = {}
        self.replaced: list[tuple[types.ModuleType, str, Any]] = []
        self.empty, self.empty_like = np.empty, np.empty_like

    def __enter__(self) -> "Recorder":
        for module in list(sys.modules.values()):
            name = getattr(module, "__name__", "")
            if not name.startswith(("certeig.", "eigenshape.")) or name.endswith("_loops"):
                continue
            for key, value in list(vars(module).items()):
                if isinstance(value, types.ModuleType) and value.__name__.endswith("_loops"):
                    loops = {k: self.wrapped(v) for k, v in vars(value).items()}
                    self.put(module, key, types.SimpleNamespace(**loops))
                elif (wrapped := self.wrapped(value)) is not value:
                    self.put(module, key, wrapped)
        self.clear_memory(True)
        return self

    def __exit__(self, *_: object) -> None:
        self.clear_memory(False)
        for module, key, value in self.replaced:
            setattr(module, key, value)

    def put(self, module: types.ModuleType, key: str, value: Any) -> None:
        self.replaced.append((module, key, getattr(module, key)))
        setattr(module, key, value)

    def clear_memory(self, wanted: bool) -> None:
        """Let new arrays be cleared, or not: scratch memory holds what was there before."""
        np.empty = self.cleared(self.empty) if wanted else self.empty
        np.empty_like = self.cleared(self.empty_like) if wanted else self.empty_like

    @staticmethod
    def cleared(make: Callable[..., np.ndarray]) -> Callable[..., np.ndarray]:
        def make_cleared(*arguments: Any, **options: Any) -> np.ndarray:
            array = make(*arguments, **options)
            if array.dtype.kind in "biufc":
                array[...] = 0
            return array

        return make_cleared

    def wrapped(self, value: Any) -> Any:
        if not callable(value) or isinstance(value, type):
            return value
        home = getattr(value, "__module__", None) or ""
        if (
            not (home.startswith(("certeig.", "eigenshape.")) and home.endswith("_loops"))
            or "blas" in home
        ):
            return value  # BLAS lies elsewhere in every process
        name = f"{home.rpartition('.')[2].removesuffix('_loops')}.{value.__name__}"

        def recorded(*arguments: Any) -> Any:
            self.clear_memory(False)  # inside, as before
            try:
                result = value(*arguments)
            finally:
                self.clear_memory(True)
            found = self.found.setdefault(name, Hash())
            found.add(arrays_in(arguments))
            found.add(result)
            return result

        return recorded


def hash_results(case: str) -> str:
    """Return the hash of what the functions of a case return, on any number of threads."""
    digests = []
    for n in THREADS:
        es.set_threads(n)
        found = Hash()
        found.add(CASES[case]())
        digests.append(found.digest())
    if len(set(digests)) > 1:
        sys.exit(f"{case} gives other digits on {THREADS} threads: {digests}.")
    return digests[0]


def hash_loops(case: str) -> dict[str, str]:
    """Return the hash of each loop that a case calls."""
    CASES[case]()  # modules are loaded before NumPy is changed
    es.set_threads(1)
    with Recorder() as recorder:
        CASES[case]()
    return {name: found.digest() for name, found in sorted(recorder.found.items())}


def check_all(kept: dict[str, Any]) -> list[str]:
    """Return what differs, of all results and loops."""
    failed = []
    for case, hashes in kept.items():
        found = {"result": hash_results(case), **hash_loops(case)}
        wanted = {"result": hashes["result"], **hashes["loops"]}
        failed += [
            f"{case}: {name}" for name, digest in wanted.items() if found.get(name) != digest
        ]
        print(f"{case} done", flush=True)
    return failed


def check_file(kept: dict[str, Any], file: str) -> list[str]:
    """Return which loops of a file differ, each in the first case that calls it."""
    cases: dict[str, list[str]] = {}
    seen: set[str] = set()
    for case, wanted in kept.items():
        new = [name for name in wanted["loops"] if name.partition(".")[0] == file]
        new = [name for name in new if name not in seen]
        seen.update(new)
        if new:
            cases[case] = new
    if not cases:
        sys.exit(f"No case calls a loop of {file}_loops.py.")
    failed = []
    for case, names in cases.items():
        found = hash_loops(case)
        for name in names:
            same = found.get(name) == kept[case]["loops"][name]
            failed += [] if same else [f"{case}: {name}"]
            print(f"{name} in {case}: {'same bits' if same else 'DIFFERS'}", flush=True)
    return failed


def main() -> None:
    """Compare, or keep, what is computed now."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--check", metavar="FILE", help="the loops of FILE_loops.py alone")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--run", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    if options.run:
        for case in CASES.values():
            case()
        return
    if options.write:
        made = {case: {"result": hash_results(case), "loops": hash_loops(case)} for case in CASES}
        KEPT.write_text(json.dumps(made, indent=1) + "\n")
        return
    kept = json.loads(KEPT.read_text())
    failed = check_file(kept, options.check) if options.check else check_all(kept)
    print("\n".join(["differs:", *failed]) if failed else "same bits")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
