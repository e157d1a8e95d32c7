"""The first 300 eigenvalues of the unit sphere by the mesh Laplacian at t = e², printed and corrected (thesis 3.4).

Fibonacci points, more and more of them, as in Figure 3.2; then noise along the radius, half an edge length strong, as
in Figure 3.3, heard by both forms of the operator and by linear elements.
"""

import argparse
import json
import warnings
from pathlib import Path

import numpy as np
from rich.progress import track

import eigenshape as es

K = 300
SIZES = (1000, 2000, 4000, 8000, 16000)
NOISY = 4000


def errors(laplacian: es.Laplacian) -> list[float]:
    """Return the median and the worst relative error of the eigenvalues above zero."""
    exact = es.sphere_eigenvalues(K)[1:]
    found = np.abs(es.solve_spectrum(laplacian, K).eigenvalues[1:] / exact - 1)
    return [round(float(np.median(found)), 5), round(float(found.max()), 5)]


def noisy_sphere() -> tuple[es.TriangleMesh, float]:
    """Return the sphere with its vertices moved along the radius, and t = e² of the clean one."""
    mesh = es.fibonacci_sphere(NOISY)
    edge = es.mean_side_length(mesh)
    heights = 1 + 0.5 * edge * np.random.default_rng(0).standard_normal((NOISY, 1))
    return es.TriangleMesh(mesh.vertices * heights, mesh.faces), edge**2


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--most", type=int, default=SIZES[-1], help="largest number of points")
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    table: dict[str, dict[str, list[float]]] = {}
    for n in track([size for size in SIZES if size <= arguments.most], description="sizes"):
        mesh = es.fibonacci_sphere(n)
        table[f"n = {n}"] = {
            "literal": errors(es.mesh_laplacian(mesh)),
            "corrected": errors(es.mesh_laplacian(mesh, correct="log")),
        }
    noisy, t = noisy_sphere()
    table["noise"] = {
        "corrected": errors(es.mesh_laplacian(noisy, t=t, correct="log")),
        "random-walk": errors(es.mesh_laplacian(noisy, t=t, correct="log", form="random-walk")),
        "cotangent": errors(es.cotangent_laplacian(noisy)),
    }
    for name, row in table.items():
        print(f"{name:<10}" + "".join(f"{what}: median {m:.4f} worst {w:.4f}   " for what, (m, w) in row.items()))
    if arguments.out:
        arguments.out.write_text(json.dumps(table, indent=2) + "\n")


if __name__ == "__main__":
    main()
