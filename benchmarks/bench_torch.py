"""Gradients of spectra, operators of many meshes, and encodings of many graphs, beside what else is done.

    python benchmarks/bench_torch.py                    ten minutes
    python benchmarks/bench_torch.py --quick            small shapes, seconds
    python benchmarks/bench_torch.py --only encodings   one group

Torch must be installed: pip install 'eigenshape[torch]'. Each group has a process of its own with one thread; encodings
use two threads, and their peer two processes.
"""

import multiprocessing
import os
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import potpourri3d as pp3d
import scipy.linalg as sl
import scipy.sparse as sp
import scipy.sparse.linalg as sla
import torch
from report import THREADS, Report, Row, in_process, options_of
from ugly_shapes import (
    collapsed_faces,
    duplicate_faces,
    flipped_faces,
    loose_vertices,
    slivers,
    soup,
)

import eigenshape as es
import eigenshape.torch as et

DATA = Path(
    os.environ.get("EIGENSHAPE_DATA", Path(__file__).resolve().parents[2] / "shared" / "data")
)
PACKAGES = ["eigenshape", "torch", "torch_geometric", "numpy", "scipy"]
COLUMNS = ("what", "case", "ours", "beside it", "")
# Turns in which graphs are encoded, by us and by the peer.
TURNS = 10
HARMS = (loose_vertices, slivers, collapsed_faces, duplicate_faces, flipped_faces, soup)


def main() -> None:
    """Measure all groups, or one."""
    parser = options_of(__doc__)
    parser.add_argument("--only", choices=GROUPS, action="append")
    parser.add_argument("--graphs", type=int, default=100_000, help="that are encoded")
    options = parser.parse_args()
    report = Report(PACKAGES, options, COLUMNS, lambda row: row["cells"])
    os.environ |= dict.fromkeys(THREADS, "1")
    for name in options.only or GROUPS:
        # Freed memory goes back at once, so that none is used twice unseen.
        if name == "memory":
            os.environ["MALLOC_MMAP_THRESHOLD_"] = "65536"
        # Encodings start processes themselves.
        run = measure if name == "encodings" else partial(in_process, measure)
        count = options.graphs if name == "encodings" else options.repeats
        for row in run(name, options.quick, count)["rows"]:
            report.add(row)
        os.environ.pop("MALLOC_MMAP_THRESHOLD_", None)


def measure(name: str, quick: bool, count: int) -> Row:
    """Return the rows of a group; the count is that of repeats, or of graphs."""
    torch.set_num_threads(1)
    warnings.simplefilter("ignore")
    return {"rows": list(GROUPS[name](quick, count))}


def cpu_seconds(call: Callable[[], object], repeats: int) -> float:
    """Return the median CPU time of a call."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return float(np.median(times))


def peak_memory(call: Callable[[], object]) -> float:
    """Return by how many MiB memory grows while a call runs (Linux)."""
    status = Path("/proc/self/status")

    def read(field: str) -> float:
        line = next(each for each in status.read_text().splitlines() if each.startswith(field))
        return int(line.split()[1]) / 1024

    Path("/proc/self/clear_refs").write_text("5")
    before = read("VmRSS")
    call()
    return read("VmHWM") - before


def losses_of(quick: bool) -> tuple[es.Laplacian, int, dict[str, torch.Tensor]]:
    """Return an operator, a number of pairs, and losses whose backward pass has run once."""
    n, k = (1000, 20) if quick else (10_000, 100)
    mesh = es.make_creature("quadruped", n_vertices=n)
    vertices = torch.tensor(mesh.vertices, requires_grad=True)
    times = np.geomspace(1e-3, 0.5, 20) * es.geometry.surface_area(mesh)
    weights = torch.randn(len(mesh.vertices), 20, generator=torch.Generator().manual_seed(0))
    spectrum = et.solve_spectrum(vertices, mesh.faces, k)
    losses = {
        "heat kernel signature": (weights * et.heat_kernel_signature(spectrum, times)).sum(),
        "spectral loss": et.spectral_loss(spectrum, spectrum.eigenvalues.detach() * 1.1),
    }
    for loss in losses.values():
        loss.backward(retain_graph=True)
    return es.cotangent_laplacian(mesh), k, losses


def gradients(quick: bool, repeats: int) -> Iterator[Row]:
    """Yield the time of a backward pass beside that of the solve."""
    laplacian, k, losses = losses_of(quick)
    forward = cpu_seconds(lambda: es.solve_spectrum(laplacian, k), repeats)
    for name, loss in losses.items():
        seconds = cpu_seconds(partial(loss.backward, retain_graph=True), repeats)
        yield {
            "cells": [
                f"backward of the {name}, time",
                f"{laplacian.n_points:,} vertices, {k} pairs",
                f"{seconds:.2f} CPU s",
                f"`es.solve_spectrum`: {forward:.2f} CPU s",
                f"{seconds / forward:.1f} times as much",
            ],
            "figure": f"time of {name}",
            "ours": seconds,
            "forward": forward,
        }


def memory(quick: bool, _repeats: int) -> Iterator[Row]:
    """Yield the memory of a backward pass beside that of the solve."""
    laplacian, k, losses = losses_of(quick)
    forward = peak_memory(lambda: es.solve_spectrum(laplacian, k))
    for name, loss in losses.items():
        backward = peak_memory(partial(loss.backward, retain_graph=True))
        yield {
            "cells": [
                f"backward of the {name}, memory",
                f"{laplacian.n_points:,} vertices, {k} pairs",
                f"{backward:.0f} MiB",
                f"`es.solve_spectrum`: {forward:.0f} MiB",
                f"{backward / max(forward, 1):.1f} times as much",
            ],
            "figure": f"memory of {name}",
            "ours": backward,
            "forward": forward,
        }


def real_meshes(name: str) -> list[es.TriangleMesh]:
    """Return meshes of files: four of each class of real shapes, or awkward ones."""
    paths = {
        "real shapes": [
            path
            for folder in sorted((DATA / "retrieval").iterdir())
            if folder.is_dir()
            for path in sorted(folder.glob("*.ply"))[:4]
        ],
        "awkward files": sorted(each for each in (DATA / "nasty").rglob("*") if each.is_file()),
    }
    found = []
    for path in paths[name]:
        try:
            mesh = es.read_mesh(path)
        except (es.EigenshapeError, OSError, ValueError):
            continue
        if len(mesh.vertices) > 20:
            found.append(mesh)
    return found


def operators(quick: bool, _repeats: int) -> Iterator[Row]:
    """Yield the operators of real shapes, ours and as DiffusionNet publishes them."""
    if quick or not DATA.is_dir():
        creatures = [es.make_creature(each, n_vertices=500) for each in ("hand", "biped")]
        yield operators_row("creatures", creatures)
    else:
        yield operators_row("real shapes", real_meshes("real shapes"))


def awkward(quick: bool, _repeats: int) -> Iterator[Row]:
    """Yield the operators of awkward files, ours and as DiffusionNet publishes them."""
    if not quick and DATA.is_dir():
        yield operators_row("awkward files", real_meshes("awkward files"))


def operators_row(name: str, meshes: list[es.TriangleMesh]) -> Row:
    """Return the row of one set of meshes."""
    ours, theirs, failures, parts = 0.0, 0.0, [0, 0], 0.0
    es.spectral.operator_bundle(es.icosphere(3), 16)
    es.spectral.operator_bundle(es.icosphere(3), 16, operator="robust")
    for mesh in meshes:
        k = min(128, len(mesh.vertices) - 2)
        start = time.process_time()
        failures[0] += bundle_of(mesh, k) is None
        between = time.process_time()
        published = operators_of_diffusion_net(mesh, k)
        failures[1] += published is None
        ours, theirs = ours + between - start, theirs + time.process_time() - between
        parts += published.seconds if published else 0.0
    return {
        "cells": [
            "operators, 128 pairs",
            f"{len(meshes)} {name}",
            f"{ours:.0f} CPU s, {failures[0]} fail",
            f"DiffusionNet's method: {theirs:.0f} CPU s, {parts:.0f} of them for eigenpairs; "
            f"{failures[1]} fail",
            f"{theirs / ours:.0f} times, eigenpairs alone {parts / ours:.1f}",
        ],
        "figure": f"operators of {name}",
        "ours": ours,
        "theirs": theirs,
        "eigenpairs": parts,
        "failures": failures,
    }


def damaged(quick: bool, _repeats: int) -> Iterator[Row]:
    """Yield how far eigenvalues are off on damaged files of shapes whose surface is the same.

    Those of the sound shape are right. The error is relative, to the second one where it is 0.
    """
    k, meshes = 32, [es.make_creature("hand", n_vertices=500)]
    if not quick and DATA.is_dir():
        names = ("penguin.obj", "3holes.off", "bunny.off", "eight.off", "fertility.off")
        meshes = [es.read_mesh(DATA / "classics" / name) for name in names]
    wanted = [es.solve_spectrum(es.cotangent_laplacian(mesh), k).eigenvalues for mesh in meshes]
    for harm in HARMS:
        off: dict[str, list[float]] = {"ours": [], "theirs": []}
        failures = dict.fromkeys(off, 0)
        for number, (mesh, right) in enumerate(zip(meshes, wanted, strict=True)):
            generator = np.random.default_rng(number)
            broken = es.TriangleMesh(*harm(mesh.vertices, mesh.faces.copy(), generator))
            answers = {
                "ours": bundle_of(broken, k),
                "theirs": operators_of_diffusion_net(broken, k),
            }
            for whose, answer in answers.items():
                if answer is None:
                    failures[whose] += 1
                    continue
                errors = np.abs(answer.eigenvalues - right) / np.maximum(right, right[1])
                off[whose].append(float(errors.max()))
        worst = {whose: max(errors, default=np.nan) for whose, errors in off.items()}
        yield {
            "cells": [
                "eigenvalues of damaged files, 32 pairs",
                f"{len(meshes)} shapes with {harm.__name__.replace('_', ' ')}",
                f"{failures['ours']} fail, others at most {worst['ours']:.1%} off",
                f"DiffusionNet's method: {failures['theirs']} fail, "
                f"others at most {worst['theirs']:.1%} off",
                "",
            ],
            "figure": f"damaged by {harm.__name__}",
            "failures": failures,
            "off": off,
        }


def bundle_of(mesh: es.TriangleMesh, k: int) -> es.spectral.OperatorBundle | None:
    """Return our operators: cotangent ones, robust ones where a mesh is refused, or repaired.

    The repair is the one that refusals name.
    """
    for operator in ("cotangent", "robust"):
        try:
            return es.spectral.operator_bundle(mesh, k, operator=operator)
        except es.EigenshapeError:
            continue
    try:
        repaired = es.geometry.repair(mesh, ["auto"]).mesh
        return es.spectral.operator_bundle(repaired, min(k, repaired.n_vertices), operator="robust")
    except es.EigenshapeError:
        return None


@dataclass(frozen=True)
class Published:
    """Eigenvalues by DiffusionNet's method, and the CPU time of the eigenpairs."""

    eigenvalues: np.ndarray
    seconds: float


def operators_of_diffusion_net(mesh: es.TriangleMesh, k: int) -> Published | None:
    """Compute operators as Sharp, Attaiki, Crane and Ovsjanikov 2022 publish them.

    Return None where the method fails: an error, or numbers that are not finite.
    """
    shift = 1e-8
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    try:
        L = pp3d.cotan_laplacian(vertices, faces, denom_eps=1e-10)
        masses = pp3d.vertex_areas(vertices, faces)
        masses += shift * masses.mean()
        start = time.process_time()
        shifted = (L + sp.identity(len(masses)) * shift).tocsc()
        for attempt in range(5):
            try:
                values, _ = sla.eigsh(shifted, k=k, M=sp.diags(masses), sigma=shift)
                break
            except Exception:  # as the published loop does, whatever it is
                if attempt == 4:
                    raise
                shifted = shifted + sp.identity(len(masses)) * (shift * 10 ** (attempt + 1))
        seconds = time.process_time() - start
        fitted = fit_gradients(vertices, faces, L.tocoo())
    except Exception:  # noqa: BLE001 - a failure is what is counted
        return None
    finite = np.isfinite(values).all() and np.isfinite(fitted.data).all()
    return Published(values, seconds) if finite else None


def fit_gradients(vertices: np.ndarray, faces: np.ndarray, L: sp.coo_matrix) -> sp.csr_array:
    """Return complex gradients: at each vertex the least squares over its edges, regularized by 1e-5."""
    corners = vertices[faces]
    normal_of_face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(normal, faces[:, corner], normal_of_face)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-6
    axis = np.where(np.abs(normal[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    first = np.cross(axis, normal)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normal, first)
    neighbors: list[list[int]] = [[] for _ in vertices]
    for tail, tip in zip(L.row, L.col, strict=True):
        if tail != tip:
            neighbors[tail].append(tip)
    rows, columns, entries = [], [], []
    for point, tips in enumerate(neighbors):
        sides = vertices[tips] - vertices[point]
        flat = np.stack([sides @ first[point], sides @ second[point]], axis=1)
        solve = np.linalg.inv(flat.T @ flat + 1e-5 * np.identity(2)) @ flat.T
        values = solve @ np.hstack([-np.ones((len(tips), 1)), np.identity(len(tips))])
        rows += [point] * (len(tips) + 1)
        columns += [point, *tips]
        entries += (values[0] + 1j * values[1]).tolist()
    return sp.csr_array((entries, (rows, columns)), shape=(len(vertices),) * 2)


def encodings(quick: bool, count: int) -> Iterator[Row]:
    """Yield the encodings of many small graphs, beside SciPy's dense solver in a pool."""
    from torch_geometric.data import Batch, Data  # noqa: PLC0415 - takes seconds
    from torch_geometric.transforms import AddLaplacianEigenvectorPE  # noqa: PLC0415

    n_graphs, generator = (300 if quick else count), np.random.default_rng(0)
    sizes = generator.integers(30, 61, n_graphs)
    edges = [random_edges(n, generator) for n in sizes.tolist()]
    graphs = [
        Data(edge_index=torch.from_numpy(pairs), num_nodes=n)
        for pairs, n in zip(edges, sizes.tolist(), strict=True)
    ]
    encode = et.ProjectorEncoding(8)
    es.set_threads(2)
    ours, theirs = [], []
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        pool.map(solve_one, [(edges[0], int(sizes[0]))] * 2)  # imports
        # In turn, so that what else the machine does slows both alike.
        for first in range(0, n_graphs, n_graphs // TURNS):
            part = slice(first, first + n_graphs // TURNS)
            start = time.perf_counter()
            encode(Batch.from_data_list(graphs[part]))
            between = time.perf_counter()
            work = zip(edges[part], sizes[part].tolist(), strict=True)
            for _ in pool.imap(solve_one, work, chunksize=500):
                pass
            ours.append(between - start)
            theirs.append(time.perf_counter() - between)
    ratios = np.divide(theirs, ours)
    yield {
        "cells": [
            "encodings by projectors",
            f"{n_graphs:,} graphs of 30 to 60 nodes",
            f"{sum(ours):.0f} s, two threads",
            f"`scipy.linalg.eigh` alone, two processes: {sum(theirs):.0f} s",
            f"{sum(theirs) / sum(ours):.1f} times ({ratios.min():.1f} to {ratios.max():.1f} "
            f"in {len(ours)} turns)",
        ],
        "figure": "encodings",
        "ours": ours,
        "theirs": theirs,
    }

    # The same graphs with their nodes in another order.
    worst, other = 0.0, 0
    torch.set_default_dtype(torch.float64)
    for graph in graphs[:100]:
        order = torch.randperm(graph.num_nodes, generator=torch.Generator().manual_seed(0))
        moved = Data(edge_index=order[graph.edge_index], num_nodes=graph.num_nodes)
        one, two = encode(graph.clone()), encode(moved)
        worst = max(worst, float((one.projector_nodes - two.projector_nodes[order]).abs().max()))
        first, again = (
            AddLaplacianEigenvectorPE(8, attr_name="pe", is_undirected=True)(graph.clone()).pe
            for _ in range(2)
        )
        other += float((first - again).abs().max()) > 1e-6
    yield {
        "cells": [
            "the same, renumbered or repeated",
            "100 of them",
            f"differ by {worst:.0e} at most, renumbered",
            "`AddLaplacianEigenvectorPE` of PyG, same numbering, run twice",
            f"{other} of 100 differ",
        ],
        "figure": "repeated",
        "worst": worst,
        "different": other,
    }


def random_edges(n: int, generator: np.random.Generator) -> np.ndarray:
    """Return the edges of a random tree with n / 5 more edges, as molecules have them, both ways."""
    parents = [(generator.integers(i), i) for i in range(1, n)]
    more = [tuple(np.sort(generator.choice(n, 2, replace=False))) for _ in range(n // 5)]
    pairs = np.unique(np.array(parents + more), axis=0)
    return np.concatenate([pairs, pairs[:, ::-1]]).T.copy()


def solve_one(work: tuple[np.ndarray, int]) -> np.ndarray:
    """Return the eigenpairs of the normalized Laplacian of one graph."""
    (rows, columns), n = work
    adjacency = np.zeros((n, n))
    adjacency[rows, columns] = 1.0
    roots = adjacency.sum(axis=1) ** -0.5
    _, vectors = sl.eigh(np.identity(n) - adjacency * roots * roots[:, None])
    return vectors[:, :8]


GROUPS = {
    "gradients": gradients,
    "memory": memory,
    "operators": operators,
    "awkward": awkward,
    "damaged": damaged,
    "encodings": encodings,
}

if __name__ == "__main__":
    main()
