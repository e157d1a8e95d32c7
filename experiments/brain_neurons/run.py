"""Do meshes of neurons go through as they are, and how few regions hold the heat of one.

Five projection neurons of a fruit fly (hemibrain) from the wheel of navis, where they are read: pip install --no-deps
navis. Lengths are in voxels of 8 nm.
"""

import sys
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, chart, finish, label, parse_arguments, rounded  # noqa: E402

import eigenshape as es  # noqa: E402

MODES = (20, 50, 200)
TIMES = np.geomspace(1.5e6, 1.5e8, 8)  # in voxels²; 10 to 100 µm
TOLERANCES = (0.2, 0.1, 0.05, 0.02, 0.01)


def neuron_files() -> list[Path]:
    """Return the meshes of the wheel of navis, which need not be imported."""
    found = find_spec("navis")
    if found is None:
        sys.exit("neurons are absent: pip install --no-deps navis")
    return sorted(Path(str(found.origin)).parent.glob("data/obj/*.obj"))


def measure(path: Path, modes: tuple[int, ...]) -> dict[str, Any]:
    """Return what is wrong with a neuron, what its spectra cost, and how few regions hold its heat."""
    mesh = es.read_mesh(path)
    edges = es.geometry.edge_table(mesh)
    repaired = es.repair(mesh, ["auto"]).mesh
    sizes = np.bincount(es.geometry.vertex_components(repaired)[1])
    laplacian = es.cotangent_laplacian(repaired)
    row: dict[str, Any] = {
        "vertices": mesh.n_vertices,
        "pieces": len(sizes),
        "faces twice": mesh.n_faces - repaired.n_faces,
        "edges of more than two faces": int(np.count_nonzero(edges.n_faces > 2)),
        "still": int(np.count_nonzero(es.geometry.edge_table(repaired).n_faces > 2)),
    }
    whole = es.repair(repaired, ["largest_component"]).mesh
    row["largest piece, vertices"] = whole.n_vertices
    for name, part in (("all pieces", repaired), ("largest", whole)):
        laplacian, zero = es.cotangent_laplacian(part), 1e-9 / es.geometry.surface_area(part)
        row[name] = {}
        for k in modes:
            start = time.process_time()
            spectrum = es.solve_spectrum(laplacian, k)
            row[name][f"{k}"] = {
                "certified": spectrum.certificate.complete,
                "seconds": time.process_time() - start,
                "zeros": int(np.count_nonzero(spectrum.eigenvalues < zero)),
            }
    heat = heat_of(spectrum)
    row["regions"] = {
        f"{tolerance}": len(es.features.condense(whole, heat, tolerance).areas)
        for tolerance in TOLERANCES
    }
    return row


def heat_of(spectrum: es.Spectrum) -> np.ndarray:
    """Return the logarithm of the heat."""
    return np.log(es.heat_kernel_signature(spectrum, TIMES))


def measure_large(path: Path, n_splits: int, k: int, *, exact: bool) -> dict[str, object]:
    """Return the stated error of the heat of a neuron of split triangles, and its regions beside those before."""
    coarse = es.repair(es.read_mesh(path), ["auto", "largest_component"]).mesh
    mesh = coarse
    for _ in range(n_splits):
        mesh = es.geometry.subdivide(mesh)
    laplacian = es.cotangent_laplacian(mesh)
    start = time.process_time()
    found = es.spectral.approximate_heat_signature(laplacian, k, TIMES)
    row = {"vertices": mesh.n_vertices, "heat, s": time.process_time() - start}
    row["stated error"] = found.errors.max()
    start = time.process_time()
    regions = es.features.condense(mesh, np.log(found.values))
    row |= {
        "condense, s": time.process_time() - start,
        "regions": len(regions.areas),
        "lost": regions.lost,
    }
    if exact:
        true = es.heat_kernel_signature(es.solve_spectrum(laplacian, k), TIMES)
        areas = es.geometry.dual_volumes(mesh)
        errors = areas @ (found.values - true) ** 2 / (areas @ true**2)
        row["true error"] = float(np.sqrt(errors.max()))
    return row


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    files = neuron_files()
    modes = MODES[:2] if arguments.quick else MODES
    neurons = {path.stem: measure(path, modes) for path in files[: 2 if arguments.quick else 5]}
    results = {"neurons": neurons}
    if arguments.quick:
        # Times say nothing about a result.
        for row in neurons.values():
            for name in ("all pieces", "largest"):
                for found in row[name].values():
                    found.pop("seconds")
    else:
        results["large"] = {
            "split twice": measure_large(files[0], 2, MODES[-1], exact=True),
            "split four times": measure_large(files[0], 4, MODES[-1], exact=False),
        }
    pictures = {"regions": plot_regions(neurons)}
    if not arguments.quick:
        pictures |= draw(files[0])
    finish(rounded(results), pictures, arguments)


def plot_regions(neurons: dict[str, dict[str, Any]]) -> Figure:
    """Plot the number of regions against the share of the variance that they lose."""
    figure, (axes,) = chart()
    for (name, row), color in zip(neurons.items(), COLORS, strict=False):
        lost = [float(tolerance) for tolerance in row["regions"]]
        axes.loglog(list(row["regions"].values()), lost, color=color, label=name, marker=".")
    label(
        axes, "regions", "share of the variance of log heat that is lost",
        "condensed heat of neurons, of the largest piece, at eight times",
    )  # fmt: skip
    return figure


def draw(path: Path) -> dict[str, Figure]:
    """Draw the heat of a neuron, and its means over regions."""
    mesh = es.repair(es.read_mesh(path), ["auto", "largest_component"]).mesh
    heat = heat_of(es.solve_spectrum(es.cotangent_laplacian(mesh), MODES[-1]))
    regions = es.features.condense(mesh, heat)
    limits = tuple(np.quantile(heat[:, 2], [0.01, 0.99]))
    return {
        name: es.figure_field(mesh, values, text, limits=limits)
        for name, values, text in (
            ("heat", heat[:, 2], "log heat of a vertex"),
            (
                "condensed",
                regions.values[regions.labels, 2],
                f"log heat, means over {len(regions.areas)} regions",
            ),
        )
    }


if __name__ == "__main__":
    main()
