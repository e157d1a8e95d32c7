"""The shapes of `bench_spectrum.py`: made-up ones with multiple eigenvalues, real ones, graphs of neighbors."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import eigenshape as es

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("EIGENSHAPE_DATA", ROOT.parent / "shared" / "data"))


@dataclass(frozen=True)
class Case:
    """A shape and how many eigenpairs of it; `make` returns a mesh, or the points of a graph of neighbors."""

    title: str
    make: Callable[[], es.TriangleMesh | np.ndarray]
    k: int
    neighbors: int = 0

    @property
    def takes(self) -> str:
        """What libraries must take."""
        return "graph" if self.neighbors else "mesh"

    def save(self, path: Path) -> int:
        """Write the arrays of the shape, and return how many points it has."""
        if not self.neighbors:
            mesh = self.make()
            np.savez(path, vertices=mesh.vertices, faces=mesh.faces)
            return mesh.n_points
        graph = es.operators.neighbor_graph(self.make(), self.neighbors).tocoo()
        np.savez(path, n=graph.shape[0], rows=graph.row, columns=graph.col, weights=graph.data)
        return graph.shape[0]


def real(title: str, path: str, k: int = 300) -> Case:
    """Return a case of a mesh in the folder of real shapes."""
    return Case(title, lambda: es.read_mesh(DATA / path), k)


FULL = {
    "sphere-10k": Case("icosphere", lambda: es.icosphere(5), 300),
    "sphere-40k": Case("icosphere", lambda: es.icosphere(6), 300),
    "sphere-160k": Case("Fibonacci sphere", lambda: es.shapes.fibonacci_sphere(160_000), 50),
    "glasses": real("glasses (psb58)", "retrieval/glasses/psb58.ply"),
    "octopus": real("octopus (psb124)", "retrieval/octopus/psb124.ply"),
    "airplane": real("airplane (psb66)", "retrieval/airplane/psb66.ply"),
    "armadillo": real("armadillo", "classics/armadillo.obj"),
    "dragon": real("dragon", "classics/dragon.off"),
    "graph-sphere": Case(
        "10 neighbors, sphere",
        lambda: np.array(es.shapes.fibonacci_sphere(10_000).vertices),
        50,
        10,
    ),
    "graph-bunny": Case(
        "10 neighbors, bunny",
        lambda: np.asarray(es.io.read_points(DATA / "points" / "bunny16k.pts").points),
        50,
        10,
    ),
}
QUICK = {
    "sphere": Case("icosphere", lambda: es.icosphere(3), 30),
    "torus": Case("torus", lambda: es.shapes.torus(36, 24), 30),
    "graph": Case(
        "8 neighbors, sphere", lambda: np.array(es.shapes.fibonacci_sphere(800).vertices), 20, 8
    ),
}
