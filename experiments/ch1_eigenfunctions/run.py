"""What do the lowest eigenfunctions of a head look like? (thesis 1.2.3, figure 1.2).

Twelve eigenvectors of the graph Laplacian of Max Planck's head, as in the thesis, and how much of
each lies in the eigenfunctions of the surface itself (cotangent Laplacian).
"""

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import finish, parse_arguments, rounded  # noqa: E402
from real_shapes import DATA, require_data  # noqa: E402

import eigenshape as es  # noqa: E402

COUNT = 12  # of the figure of the thesis; the constant function is not counted
WIDER = 2  # times as many eigenfunctions of the surface, in which those of the graph are sought


def load_shape(*, quick: bool) -> es.TriangleMesh:
    """Return the head; the quick form takes a synthetic animal of 1,500 vertices."""
    if quick:
        return es.make_creature("quadruped", n_vertices=1500)
    require_data()
    return es.read_mesh(DATA / "classics" / "decimated-max.obj")


def measure(graph: es.Spectrum, surface: es.Spectrum) -> list[dict[str, float]]:
    """Return the eigenvalue of each function, and its share in those of the surface."""
    rows = []
    for index in range(1, COUNT + 1):
        function = graph.eigenvectors[:, index]
        coefficients = es.spectral.project(function, surface)
        norm = function @ (surface.mass @ function)
        rows.append(
            {
                "eigenvalue": graph.eigenvalues[index],
                "share in the surface's functions": np.sum(coefficients**2) / norm,
            }
        )
    return rows


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    mesh = load_shape(quick=arguments.quick)
    graph = es.solve_spectrum(es.operators.graph_laplacian(mesh), COUNT + 1)
    surface = es.solve_spectrum(es.cotangent_laplacian(mesh), WIDER * COUNT + 1)
    results = {
        "vertices": mesh.n_vertices,
        "longest / shortest edge": np.divide(*np.sort(es.geometry.edge_lengths(mesh))[[-1, 0]]),
        "functions": measure(graph, surface),
    }
    pictures = {}
    if not arguments.quick:
        chosen = np.arange(1, COUNT + 1)
        figure = es.plot.figure_eigenfunctions(mesh, graph, chosen, view="front", up="y")
        figure.set_dpi(70)
        pictures["eigenfunctions"] = figure
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
