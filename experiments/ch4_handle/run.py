"""A torus attached to another grows until it is as large: how much do eigenvalues differ? (thesis 4.4, Figure 4.4).

Genus 1 becomes genus 2. Coupled and independent samples are compared by the first 300 eigenvalues of the
Gaussian-weighted graph Laplacian at heat times up to 1e-2; the cotangent Laplacian of the meshes is the contrast.
"""

import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
sys.path.append(str(FOLDER.parent))
from frame import finish, parse_arguments, rounded  # noqa: E402
from surgery import Surgery, attach  # noqa: E402
from topological import mesh_changes, mesh_spectra, sample_all, soundness  # noqa: E402
from topological_pictures import figure_changes, figure_meshes, figure_variants  # noqa: E402

import eigenshape as es  # noqa: E402

SIZES = (0.15, 0.3, 0.5, 0.75, 1.0)  # of the attached torus, in sizes of the first
AROUND, ACROSS = 320, 112
REACH = 0.1  # radius of the joint, and its length, in sizes of the attached torus (diameter 1)
# heat time, form, points, seeds
RUNS = (
    (1e-3, "coupled", 3000, 5),
    (1e-2, "coupled", 1500, 5),
    (3e-4, "coupled", 8000, 5),
    (1e-2, "independent", 1500, 5),
)
QUICK = ((1e-2, "coupled", 500, 2), (1e-2, "independent", 500, 2))
MESHED = ("s = 0.15", "s = 0.5", "s = 1")


def attached_tori(sizes: tuple[float, ...], *, coarser: int = 1) -> dict[str, Surgery]:
    """Return a torus of diameter 1 with another of each size attached at its outer side."""
    n_around, n_across = AROUND // coarser, ACROSS // coarser
    first = es.geometry.normalize_mesh(es.shapes.torus(n_around, n_across), "diameter")
    found = {}
    for size in sizes:
        finer = max(size, 0.4)
        around = 4 * round(n_around * finer / 4)
        other = es.geometry.normalize_mesh(
            es.shapes.torus(around, round(n_across * finer)), "diameter"
        )
        shift = 0.5 + size * (0.5 + REACH)
        placed = es.TriangleMesh(size * other.vertices + [shift, 0, 0], other.faces)
        end = around // 2 * (other.n_vertices // around)
        found[f"s = {size:g}"] = attach(first, placed, 0, end, REACH * size)
    return found


def main() -> None:
    """Measure, draw and print."""
    arguments = parse_arguments(__doc__, FOLDER)
    sizes = SIZES[3:] if arguments.quick else SIZES
    surgeries = attached_tori(sizes, coarser=2 if arguments.quick else 1)
    runs = sample_all(
        surgeries, QUICK if arguments.quick else RUNS, 100 if arguments.quick else 300
    )
    meshes = {}
    if not arguments.quick:
        meshes = mesh_spectra({name: surgeries[name] for name in MESHED}, kernel=False)
    results = {
        "surfaces": {
            name: soundness(surgery, close=not arguments.quick, widen=False)
            for name, surgery in surgeries.items()
        },
        "samples": {name: run["changes"] for name, run in runs.items()},
        "meshes": mesh_changes(meshes),
    }
    pictures = {
        "variants": figure_variants(
            surgeries, "A torus (M, diameter 1) and another of s times its size, attached"
        ),
        "changes": figure_changes(
            runs, sizes, "size s of the attached torus", shown=next(iter(runs))
        ),
    }
    if meshes:
        pictures["meshes"] = figure_meshes(meshes, ("cotangent",))
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
