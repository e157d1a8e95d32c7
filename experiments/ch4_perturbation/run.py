"""Points of a surface moved ever more by noise: how smoothly do eigenvalues change? (thesis 4.4, Figure 4.3).

Points thrown on a made-up giraffe are moved by Gaussian noise of a standard deviation of ε diameters in all directions.
The first 300 eigenvalues of the Gaussian-weighted graph Laplacian before and after are compared, against δ, the largest
displacement; operators on the mesh, whose vertices are moved likewise, are the contrast.
"""

import sys
from pathlib import Path

import numpy as np
from rich.progress import track

FOLDER = Path(__file__).resolve().parent
sys.path.append(str(FOLDER.parent))
from frame import finish, parse_arguments, rounded  # noqa: E402
from surgery import moved  # noqa: E402
from topological import changes, eigenvalues, mesh_changes, mesh_spectra, summary  # noqa: E402
from topological_pictures import figure_changes, figure_meshes  # noqa: E402

import eigenshape as es  # noqa: E402

NOISE = (0.0005, 0.001, 0.002, 0.004, 0.008, 0.016)
# heat time, points, seeds
RUNS = ((1e-4, 3000, 5), (3e-4, 2000, 5), (1e-3, 1500, 5))
QUICK = ((1e-3, 600, 2), (3e-4, 600, 2))
MESHED = ("ε = 0.0005", "ε = 0.002", "ε = 0.004")


def giraffe() -> es.TriangleMesh:
    """Return the surface, its diameter 1."""
    return es.geometry.normalize_mesh(es.make_creature("giraffe", n_vertices=6000), "diameter")


def shaken(mesh: es.TriangleMesh, noise: tuple[float, ...]) -> dict[str, es.TriangleMesh]:
    """Move the vertices of a mesh by one draw of noise of each size."""
    draw = np.random.default_rng(0).standard_normal(mesh.vertices.shape)
    return {
        f"ε = {size:g}": es.TriangleMesh(mesh.vertices + size * draw, mesh.faces) for size in noise
    }


def measure(
    mesh: es.TriangleMesh, t: float, n: int, k: int, seeds: int, noise: tuple[float, ...]
) -> dict:
    """Measure how the spectra of points change when they are moved by noise of each size; one draw a seed."""
    volume = es.geometry.surface_area(mesh)
    rows: dict[str, list[dict[str, float]]] = {f"ε = {size:g}": [] for size in noise}
    again, spectra = [], {}
    for seed in range(seeds):
        rng = np.random.default_rng([seed, n])
        points, others = (es.geometry.sample_surface(mesh, n, rng=rng).points for _ in range(2))
        draw = rng.standard_normal(points.shape)
        before = eigenvalues(points, t, k, volume)
        again.append(changes(before, eigenvalues(others, t, k, volume)))
        found = {"M": before}
        for size, (name, table) in zip(noise, rows.items(), strict=True):
            found[name] = eigenvalues(points + size * draw, t, k, volume)
            delta = size * np.linalg.norm(draw, axis=1).max()
            table.append({**changes(before, found[name]), "δ": delta})
        spectra = spectra or found
    return {"changes": {"M again": summary(again), **{name: summary(table) for name, table in rows.items()}},
            "spectra": spectra}  # fmt: skip


def growth(measured: dict, noise: tuple[float, ...]) -> dict[str, float]:
    """Fit the power of δ with which changes grow, over the four smallest noises."""
    rows = [measured[f"ε = {size:g}"] for size in noise][:4]
    log_delta = np.log([row["δ"]["mean"] for row in rows])
    return {
        key: np.polyfit(log_delta, np.log([row[key]["mean"] for row in rows]), 1)[0]
        for key in ("largest", "mean")
    }


def main() -> None:
    """Measure, draw and print."""
    arguments = parse_arguments(__doc__, FOLDER)
    noise = NOISE[1::2] if arguments.quick else NOISE
    mesh = giraffe()
    runs = {}
    for t, n, seeds in track(QUICK if arguments.quick else RUNS, description="samples"):
        k = 100 if arguments.quick else 300
        runs[f"t = {t:g}, n = {n}"] = measure(mesh, t, n, k, seeds, noise)
    meshed = {name: other for name, other in shaken(mesh, noise).items() if name in MESHED}
    surgeries = {name: moved(mesh, other.vertices) for name, other in meshed.items()}
    meshes = {} if arguments.quick else mesh_spectra(surgeries)
    results = {
        "samples": {name: run["changes"] for name, run in runs.items()},
        "power of δ": {name: growth(run["changes"], noise) for name, run in runs.items()},
        "meshes": mesh_changes(meshes),
    }
    poses = {"M": mesh, **shaken(mesh, noise[-4:-1])}
    pictures = {
        "variants": es.plot.figure_poses(poses, camera=es.plot.aim_camera(mesh, size=300)),
        "changes": figure_changes(
            runs,
            noise,
            "ε, standard deviation of the noise (diameter: 1)",
            shown=next(iter(runs)),
            log=(True, True),
        ),
    }
    if meshes:
        pictures["meshes"] = figure_meshes(meshes, ("cotangent", "mesh, corrected"), k=60)
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
