"""Two tori joined by a bridge that grows: what do eigenvalues of samples hear of it? (thesis 4.4, Figure 4.2).

Samples of both surfaces are compared by the first 300 eigenvalues of the Gaussian-weighted graph Laplacian: independent
ones, and coupled ones, which share their points outside the place of surgery. Operators on the meshes are the contrast.
"""

import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
sys.path.append(str(FOLDER.parent))
from frame import finish, parse_arguments, rounded  # noqa: E402
from surgery import Surgery, bridge  # noqa: E402
from topological import mesh_changes, mesh_spectra, sample_all, soundness  # noqa: E402
from topological_pictures import figure_changes, figure_meshes, figure_variants  # noqa: E402

import eigenshape as es  # noqa: E402

RADII = (0.014, 0.03, 0.045, 0.06, 0.08, 0.1)
GAP = 0.18  # between the tori, in their larger radii
AROUND, ACROSS = 160, 56
# heat time, form, points, seeds
RUNS = (
    (1e-3, "coupled", 2000, 5),
    (3e-4, "coupled", 3000, 5),
    (1e-4, "coupled", 6500, 5),
    (1e-3, "independent", 2000, 5),
)
QUICK = ((1e-3, "coupled", 800, 2), (1e-3, "independent", 800, 2))
MESHED = ("r = 0.014", "r = 0.045", "r = 0.1")


def bridged_tori(radii: tuple[float, ...]) -> dict[str, Surgery]:
    """Return two tori side by side, diameter 1, joined by a bridge of each radius where they are nearest."""
    left = es.shapes.torus(AROUND, ACROSS)
    right = es.TriangleMesh(left.vertices + np.array([2.8 + GAP, 0, 0]), left.faces)
    tori = es.geometry.normalize_mesh(es.geometry.disjoint_union(left, right), "diameter")
    across = left.n_vertices + AROUND // 2 * ACROSS
    return {f"r = {radius:g}": bridge(tori, 0, across, radius) for radius in radii}


def main() -> None:
    """Measure, draw and print."""
    arguments = parse_arguments(__doc__, FOLDER)
    radii = RADII[::3] if arguments.quick else RADII
    surgeries = bridged_tori(radii)
    runs = sample_all(
        surgeries, QUICK if arguments.quick else RUNS, 100 if arguments.quick else 300
    )
    meshes = {} if arguments.quick else mesh_spectra({name: surgeries[name] for name in MESHED})
    results = {
        "surfaces": {
            name: soundness(surgery, close=not arguments.quick)
            for name, surgery in surgeries.items()
        },
        "samples": {name: run["changes"] for name, run in runs.items()},
        "meshes": mesh_changes(meshes),
    }
    pictures = {
        "variants": figure_variants(
            surgeries, "Two tori (M) and bridges of radius r; the diameter of M is 1"
        ),
        "changes": figure_changes(
            runs, radii, "radius of the bridge (diameter of M: 1)", shown=next(iter(runs))
        ),
    }
    if meshes:
        pictures["meshes"] = figure_meshes(meshes, ("cotangent", "mesh, corrected"))
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
