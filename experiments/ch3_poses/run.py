"""How far do the eigenvalues of one cat change from pose to pose, by the operator that hears them? (thesis 3.4).

Eleven poses of one cat, each remeshed by itself. For each two of them the first 100 eigenvalues, times the area, are
compared one by one.
"""

import argparse
import json
import os
import warnings
from itertools import combinations
from pathlib import Path

import numpy as np
from rich.progress import track

import eigenshape as es

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("EIGENSHAPE_DATA", HERE.parents[2] / "shared" / "data"))
K = 101
OPERATORS = {
    "cotangent, lumped": es.cotangent_laplacian,
    "mesh, Euclidean": lambda mesh: es.mesh_laplacian(mesh, correct="log"),
    "mesh, geodesic": lambda mesh: es.mesh_laplacian(mesh, correct="log", distance="geodesic"),
}


def spectra(meshes: list[es.TriangleMesh], name: str) -> np.ndarray:
    """Return the eigenvalues above 0 of all poses, without unit."""
    rows = []
    for mesh in track(meshes, description=name):
        values = es.solve_spectrum(OPERATORS[name](mesh), K).eigenvalues[1:]
        rows.append(values * es.surface_area(mesh))
    return np.array(rows)


def differences(rows: np.ndarray) -> np.ndarray:
    """Return |λ/λ' - 1| of each two poses, the smaller below."""
    pairs = combinations(rows, 2)
    return np.array([np.maximum(one, two) / np.minimum(one, two) - 1 for one, two in pairs])


def leaks(mesh: es.TriangleMesh) -> np.ndarray:
    """Return at each vertex the share of its Euclidean kernel that belongs to points out of reach along the surface."""
    along = es.mesh_laplacian(mesh, distance="geodesic").stiffness
    near = along.copy()
    near.data[:] = 1
    through_space = es.mesh_laplacian(mesh).stiffness
    weights = np.array(-through_space.sum(axis=1) + through_space.diagonal())
    kept = through_space.multiply(near)
    return 1 - np.array(-kept.sum(axis=1) + kept.diagonal()) / weights


def main() -> None:
    """Measure, print the table, and draw where the Euclidean kernel leaks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=11)
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    parser.add_argument("--picture", type=Path, help="draw the leak (PNG)")
    arguments = parser.parse_args()
    paths = sorted((DATA / "retrieval" / "cat").glob("tosca_*.ply"))[: arguments.poses]
    meshes = [es.read_mesh(path) for path in paths]
    warnings.simplefilter("ignore")
    table = {}
    for name in OPERATORS:
        found = differences(spectra(meshes, name))
        table[name] = {
            "median": float(np.median(found)),
            "90 %": float(np.quantile(found, 0.9)),
            "median of pairs' worst": float(np.median(found.max(axis=1))),
        }
    shares = {path.stem: float(np.mean(leaks(mesh) > 0.1)) for path, mesh in zip(paths, meshes, strict=True)}
    for name, row in table.items():
        print(f"{name:<20}" + "".join(f"{key}: {value:.4f}   " for key, value in row.items()))
    print("vertices with over a tenth of their kernel elsewhere:", {k: round(v, 3) for k, v in shares.items()})
    if arguments.out:
        arguments.out.write_text(json.dumps({"differences": table, "leaks": shares}, indent=2) + "\n")
    if arguments.picture:
        worst = max(range(len(meshes)), key=lambda place: shares[paths[place].stem])
        mesh = meshes[worst]
        camera = es.three_quarter_view(mesh, up="auto")
        es.save_figure(
            es.figure_field(mesh, leaks(mesh), "share of the kernel out of reach", camera=camera), arguments.picture
        )


if __name__ == "__main__":
    main()
