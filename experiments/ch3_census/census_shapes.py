"""The operators of the census: shapes with multiple eigenvalues, by symmetry or by equal components."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp

import eigenshape as es

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("EIGENSHAPE_DATA", ROOT.parent / "shared" / "data"))
REAL = (
    "classics/eight.off",
    "retrieval/fourleg/psb398.ply",
    "nasty/trimesh/round.stl",
    "nasty/trimesh/fuze.ply",
    "nasty/trimesh/reference.ply",
)
Mesh = es.TriangleMesh | es.SimplicialMesh


@dataclass(frozen=True)
class Case:
    """One operator on one shape; `mesh` and `mass` are there where LaPy has the same operator."""

    family: str
    name: str
    laplacian: es.Laplacian
    mesh: es.TriangleMesh | None = None
    mass: str = ""


def octasphere(level: int) -> es.TriangleMesh:
    """Subdivide an octahedron onto the unit sphere."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    mesh = es.TriangleMesh(corners, np.array(faces))
    for _ in range(level):
        mesh = es.geometry.subdivide(mesh)
        mesh = es.TriangleMesh(
            mesh.vertices / np.linalg.norm(mesh.vertices, axis=1, keepdims=True), mesh.faces
        )
    return mesh


def cube_surface(level: int) -> es.TriangleMesh:
    """Subdivide the surface of the unit cube: its sides are the boundary of a box of one cell."""
    solid = es.shapes.box(1, 1, 1)
    sides = np.concatenate([np.delete(solid.simplices, corner, axis=1) for corner in range(4)])
    _, first, counts = np.unique(
        np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True
    )
    mesh = es.TriangleMesh(solid.points, sides[first[counts == 1]])
    for _ in range(level):
        mesh = es.geometry.subdivide(mesh)
    return mesh


def flat_torus(n_u: int, n_v: int) -> es.SimplicialMesh:
    """Return the product of two circles in R⁴ on a regular lattice."""
    u, v = (
        2 * np.pi * place.ravel() / n
        for place, n in zip(np.indices((n_u, n_v)), (n_u, n_v), strict=True)
    )
    points = np.column_stack([np.cos(u), np.sin(u), np.cos(v), np.sin(v)])
    return es.SimplicialMesh(points, es.shapes.torus(n_u, n_v).faces)


def copies(mesh: es.TriangleMesh, count: int) -> es.TriangleMesh:
    """Return equal components, all in one place."""
    return es.geometry.disjoint_union(*[mesh] * count)


def cycle(n: int) -> sp.csr_array:
    """Return the graph of n points in a ring."""
    steps = np.arange(n)
    ring = sp.coo_array((np.ones(n), (steps, (steps + 1) % n)), shape=(n, n))
    return sp.csr_array(ring + ring.T)


def product(*factors: sp.csr_array) -> sp.csr_array:
    """Return the Cartesian product of graphs."""
    result = factors[0]
    for factor in factors[1:]:
        result = sp.csr_array(sp.kronsum(result, factor))
    return result


SHAPES: dict[str, dict[str, Callable[[], Mesh]]] = {
    "spheres": {
        "icosphere 3": lambda: es.icosphere(3),
        "octasphere 4": lambda: octasphere(4),
        "icosphere 2": lambda: es.icosphere(2),
        "octasphere 3": lambda: octasphere(3),
    },
    "tori": {
        "torus 24 x 16": lambda: es.shapes.torus(24, 16),
        "torus 20 x 20": lambda: es.shapes.torus(20, 20),
        "torus 36 x 24": lambda: es.shapes.torus(36, 24),
        "torus 48 x 24": lambda: es.shapes.torus(48, 24),
        "flat torus 20 x 20": lambda: flat_torus(20, 20),
        "flat torus 32 x 24": lambda: flat_torus(32, 24),
    },
    "boxes": {
        "cube surface 3": lambda: cube_surface(3),
        "square": lambda: es.shapes.grid(20, 20),
        "box 6 x 6 x 6": lambda: es.shapes.box(6, 6, 6),
        "box 5 x 5 x 12": lambda: es.shapes.box(5, 5, 12, sides=(1.0, 1.0, 2.4)),
        "box 8 x 8 x 8": lambda: es.shapes.box(8, 8, 8),
        "ball 8": lambda: es.shapes.ball(8),
    },
    "equal components": {
        "10 icospheres 1": lambda: copies(es.icosphere(1), 10),
        "30 icosahedra": lambda: copies(es.icosphere(0), 30),
        "20 tori 6 x 5": lambda: copies(es.shapes.torus(6, 5), 20),
        "6 icospheres 2": lambda: copies(es.icosphere(2), 6),
        "2 icospheres 3": lambda: copies(es.icosphere(3), 2),
        "3 tori 16 x 12": lambda: copies(es.shapes.torus(16, 12), 3),
    },
    "discs": {
        "disc 10": lambda: es.shapes.disc(10),
        "disc 13": lambda: es.shapes.disc(13),
        "disc 16": lambda: es.shapes.disc(16),
        "disc 20": lambda: es.shapes.disc(20),
    },
}
GRAPHS: dict[str, Callable[[], sp.csr_array]] = {
    "cycle 400": lambda: cycle(400),
    "lattice 20 x 20": lambda: product(cycle(20), cycle(20)),
    "hypercube 9": lambda: product(*[sp.csr_array(np.ones((2, 2)) - np.eye(2))] * 9),
    "lattice 8 x 8 x 8": lambda: product(cycle(8), cycle(8), cycle(8)),
    "8 neighbors, icosphere": lambda: es.operators.neighbor_graph(es.icosphere(3).vertices, 8),
    "complete 320": lambda: sp.csr_array(np.ones((320, 320)) - np.eye(320)),
}
MASSES = ("lumped", "consistent", "averaged")


def cases(*, quick: bool) -> Iterator[Case]:
    """Yield every operator on every shape; quick takes the first two shapes of each family, two operators each."""
    for family, shapes in _families().items():
        for name, make in list(shapes.items())[: 2 if quick else None]:
            yield from list(_of_mesh(family, name, make()))[:: 2 if quick else 1]
    for name, make in list(GRAPHS.items())[: 2 if quick else None]:
        for kind in ("combinatorial", "normalized"):
            yield Case("graphs", f"{name}, {kind}", es.operators.graph_laplacian(make(), kind))


def _families() -> dict[str, dict[str, Callable[[], Mesh]]]:
    real = {
        path: lambda path=path: es.read_mesh(DATA / path) for path in REAL if (DATA / path).exists()
    }
    return SHAPES | ({"real shapes": real} if real else {})


def _of_mesh(family: str, name: str, mesh: Mesh) -> Iterator[Case]:
    flat = mesh if isinstance(mesh, es.TriangleMesh) else None
    for mass in MASSES:
        same = flat if mass != "averaged" else None
        yield Case(
            family,
            f"{name}, {mass}",
            es.cotangent_laplacian(mesh, mass),
            same,
            mass if same else "",
        )
    if flat is not None:
        yield Case(family, f"{name}, robust", es.robust_laplacian(flat))
    yield Case(family, f"{name}, graph", es.operators.graph_laplacian(mesh))
