"""Two tori joined by a bridge that grows: what do eigenvalues of samples hear of it? (thesis 4.4, Figure 4.2).

Samples of both surfaces are compared by the first 300 eigenvalues of the Gaussian-weighted graph Laplacian: independent
ones, and coupled ones, which share their points outside the place of surgery. Operators on the meshes are the contrast.
"""

import sys
from pathlib import Path

import numpy as np
from rich.progress import track

FOLDER = Path(__file__).resolve().parent
sys.path.append(str(FOLDER.parent))
from frame import chart, finish, label, parse_arguments, rounded  # noqa: E402
from surgery import Surgery, bridge  # noqa: E402
from topological import measure, mesh_changes, mesh_spectra, soundness  # noqa: E402
from topological_pictures import draw_changes, draw_differences, draw_spectra, figure_variants  # noqa: E402

import eigenshape as es  # noqa: E402

RADII = (0.014, 0.03, 0.045, 0.06, 0.08, 0.1)
GAP = 0.18  # between the tori, in their larger radii
AROUND, ACROSS = 160, 56
# heat time, form, points, seeds
RUNS = ((1e-3, "coupled", 2000, 5), (3e-4, "coupled", 3000, 3), (1e-4, "coupled", 6500, 3), (1e-3, "independent", 2000, 5))
QUICK = ((1e-3, "coupled", 800, 2), (1e-3, "independent", 800, 2))
MESHED = ("r = 0.014", "r = 0.045", "r = 0.1")


def bridged_tori(radii: tuple[float, ...]) -> dict[str, Surgery]:
    """Return two tori side by side, diameter 1, joined by a bridge of each radius where they are nearest."""
    left = es.torus(AROUND, ACROSS)
    right = es.TriangleMesh(left.vertices + [2.8 + GAP, 0, 0], left.faces)
    tori = es.normalize_diameter(es.disjoint_union(left, right))
    across = left.n_vertices + AROUND // 2 * ACROSS
    return {f"r = {radius:g}": bridge(tori, 0, across, radius) for radius in radii}


def pictures(surgeries: dict[str, Surgery], runs: dict[str, dict], meshes: dict, radii: tuple[float, ...]) -> dict:
    """Draw the variants, the spectra at one time, and the changes."""
    figure, panels = chart(15, 4.6, columns=3)
    first, *_ = runs
    draw_spectra(panels[0], runs[first]["spectra"])
    label(panels[0], "i", "t vol(M) λ$_i$", f"Eigenvalues, {first}, seed 0")
    draw_differences(panels[1], runs[first]["spectra"])
    label(panels[1], "i", "t vol(M) (λ$_i$(Q) - λ$_i$(P))", f"Their change, {first}, seed 0")
    for number, (name, run) in enumerate(runs.items()):
        draw_changes(panels[2], radii, run["changes"], "largest", name=name, number=number)
    panels[2].set_yscale("log")
    label(panels[2], "radius of the bridge (diameter of both tori: 1)", "largest change of t vol(M) λ$_i$, i ≤ 300",
          "Mean over seeds; bars: least and most")  # fmt: skip
    drawn = {"variants": figure_variants(surgeries, "Two tori and bridges of radius r (diameter of M: 1)")}
    return drawn | {"changes": figure} | ({"meshes": _mesh_picture(meshes)} if meshes else {})


def _mesh_picture(meshes: dict) -> object:
    figure, panels = chart(10, 4.2, columns=2)
    for panel, operator in zip(panels, ("cotangent", "mesh, corrected"), strict=True):
        first = {name: values[:20] for name, values in meshes[operator].items()}
        draw_spectra(panel, first)
        label(panel, "i", "vol(M) λ$_i$", f"{operator}: the first 20 eigenvalues")
    return figure


def main() -> None:
    """Measure, draw and print."""
    arguments = parse_arguments(__doc__, FOLDER)
    radii = RADII[::3] if arguments.quick else RADII
    surgeries = bridged_tori(radii)
    k = 100 if arguments.quick else 300
    runs = {}
    for t, form, n, seeds in track(QUICK if arguments.quick else RUNS, description="samples"):
        runs[f"t = {t:g}, n = {n}, {form}"] = measure(surgeries, t, n, k=k, seeds=seeds, form=form)
    meshes = {} if arguments.quick else mesh_spectra({name: surgeries[name] for name in MESHED})
    results = {
        "surfaces": {name: soundness(surgery) for name, surgery in surgeries.items()},
        "samples": {name: run["changes"] for name, run in runs.items()},
        "meshes": mesh_changes(meshes),
    }
    finish(rounded(results), pictures(surgeries, runs, meshes, radii), arguments)


if __name__ == "__main__":
    main()
