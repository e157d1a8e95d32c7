"""How much of a horse do its lowest eigenvectors hold? (thesis 1.2.3, figure 1.1).

The coordinates are projected on the eigenvectors of the cotangent Laplacian and reconstructed from
the first 3, 10, 25, 50, 100, 200 and 300 of them.
"""

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import finish, parse_arguments, rounded  # noqa: E402
from real_shapes import DATA, require_data  # noqa: E402

import eigenshape as es  # noqa: E402

COUNTS = (3, 10, 25, 50, 100, 200, 300)  # of the figure of the thesis
# Share of the squared diagonal below which Parseval's identity holds; rounding leaves 1e-14.
ROUNDING = 1e-10


def load_shape(*, quick: bool) -> es.TriangleMesh:
    """Return the horse; the quick form takes a synthetic one of 1,500 vertices."""
    if quick:
        return es.make_creature("quadruped", n_vertices=1500)
    require_data()
    # the file's faces point inward, so its volume would count as negative
    return es.repair(es.read_mesh(DATA / "classics" / "horse.ply"), ["orient"]).mesh


def measure(
    mesh: es.TriangleMesh, spectrum: es.Spectrum, counts: list[int]
) -> tuple[dict[str, dict[str, float]], dict[str, es.TriangleMesh]]:
    """Return the errors of each reconstruction, and the reconstructions."""
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    areas = spectrum.mass.sum(axis=1)
    volume = es.geometry.enclosed_volume(mesh)
    coefficients = es.spectral.project(mesh.vertices, spectrum)
    table, shapes = {}, {}
    for count in counts:
        points = es.spectral.reconstruct(coefficients[:count], spectrum)
        away = np.linalg.norm(points - mesh.vertices, axis=1)
        shapes[f"{count} modes"] = es.TriangleMesh(points, mesh.faces)
        table[f"{count}"] = {
            "mean / diagonal": np.sqrt(areas @ away**2 / areas.sum()) / diagonal,
            "largest / diagonal": away.max() / diagonal,
            # three modes span a plane, in which rounding decides the sign
            "volume": abs(es.geometry.enclosed_volume(shapes[f"{count} modes"])) / volume,
            "area": es.geometry.surface_area(shapes[f"{count} modes"])
            / es.geometry.surface_area(mesh),
        }
    return table, shapes


def check_identities(mesh: es.TriangleMesh, spectrum: es.Spectrum) -> dict[str, bool]:
    """Say whether projecting twice changes nothing, and whether norms agree (Parseval)."""
    coefficients = es.spectral.project(mesh.vertices, spectrum)
    found = es.spectral.reconstruct(coefficients, spectrum)
    again = es.spectral.project(found, spectrum)
    size = np.abs(coefficients).max()
    norms = np.einsum("nd,nd->", found, spectrum.mass @ found), np.sum(coefficients**2)
    return {
        "round trip": bool(np.abs(again - coefficients).max() <= ROUNDING * size),
        "Parseval": bool(abs(norms[0] - norms[1]) <= ROUNDING * norms[1]),
    }


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    mesh = load_shape(quick=arguments.quick)
    counts = [count for count in COUNTS if not arguments.quick or count <= 50]
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), counts[-1])
    table, shapes = measure(mesh, spectrum, counts)
    results = {
        "vertices": mesh.n_vertices,
        "errors": table,
        "exact to 1e-10": check_identities(mesh, spectrum),
    }
    pictures = {}
    if not arguments.quick:
        title = f"the horse, {mesh.n_vertices:,} vertices"
        pictures["horse"] = es.plot.figure_poses({title: mesh, **shapes})
        pictures["horse"].set_dpi(60)
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
