"""Figure 3.4 drawn by the operator of the thesis: five poses of a man beside a cat and a horse (thesis 3.4).

The mesh Laplacian as printed at t = e², with Euclidean and with geodesic distances, and linear elements. Shapes have
area 1; the mean of |λ/λ' - 1| to the first pose is printed, also for diameter 1, as the thesis normalizes.
"""

import sys
import warnings
from pathlib import Path

import numpy as np
from families import difference
from matplotlib.figure import Figure
from rich.progress import track

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, finish, label, parse_arguments, rounded  # noqa: E402
from real_shapes import DATA, require_data  # noqa: E402
from shape_panels import show_shape  # noqa: E402

import eigenshape as es  # noqa: E402

SHAPES = DATA / "retrieval"
OPERATORS = {
    "mesh, as printed": es.mesh_laplacian,
    "mesh, geodesic": lambda mesh: es.mesh_laplacian(mesh, distance="geodesic"),
    "cotangent, averaged": lambda mesh: es.cotangent_laplacian(mesh, "averaged"),
}
DRAWN = ("michael0", "michael2", "michael5", "michael10", "michael16", "cat0", "horse0")
QUICK = ("michael0", "michael10", "horse0")


def read(name: str) -> es.TriangleMesh:
    """Read a shape of TOSCA."""
    return es.read_mesh(next(SHAPES.glob(f"*/tosca_{name}.ply")))


def spectra(names: tuple[str, ...], operator: str, n_values: int) -> dict[str, np.ndarray]:
    """Return the eigenvalues above 0 of each shape, in 1/length² of its file."""
    found = {}
    for name in track(names, description=operator):
        spectrum = es.solve_spectrum(OPERATORS[operator](read(name)), n_values + 1)
        found[name] = spectrum.eigenvalues[1:]
    return found


def sizes(names: tuple[str, ...]) -> dict[str, dict[str, float]]:
    """Return the square of what each shape is divided by: by area, and by diameter."""
    found = {}
    for name in names:
        mesh = read(name)
        unit = es.geometry.normalize_mesh(mesh, "diameter")
        area = es.geometry.surface_area(mesh)
        found[name] = {"area 1": area, "diameter 1": area / es.geometry.surface_area(unit)}
    return found


def distances(
    rows: dict[str, np.ndarray], size: dict[str, dict[str, float]], unit: str
) -> dict[str, float]:
    """Return how far each spectrum is from the first one, in the mean over eigenvalues."""
    first, *others = rows
    return {
        name: difference(rows[name] * size[name][unit], rows[first] * size[first][unit]).mean()
        for name in others
    }


def figure_spectra(
    rows: dict[str, dict[str, np.ndarray]], size: dict[str, dict[str, float]]
) -> Figure:
    """Draw the shapes in a row, and below their spectra by each operator."""
    figure = Figure(figsize=(11.5, 6.4), layout="constrained", dpi=85)
    above, below = figure.subfigures(2, 1, height_ratios=[1, 1.9])
    for axes, name, color in zip(above.subplots(1, len(DRAWN)), DRAWN, COLORS, strict=False):
        mesh = read(name)
        show_shape(axes, mesh, es.plot.aim_camera(mesh, up="z"), color=color)
        axes.set_title(name, fontsize=9)
    for axes, (operator, found) in zip(
        below.subplots(1, 3, sharey=True), rows.items(), strict=True
    ):
        for (name, values), color in zip(found.items(), COLORS, strict=False):
            style = "-" if name.startswith("michael") else "--"
            scaled = values * size[name]["area 1"]
            axes.plot(np.arange(1, len(values) + 1), scaled, style, color=color, lw=1.2, label=name)
        axes.spines[["top", "right"]].set_visible(False)
        first = operator == "mesh, as printed"
        caption = f"{operator}{'' if operator.startswith('cot') else '; t = e²'}"
        label(axes, "index i", "λᵢ · area (no unit)" if first else "", caption, legend=first)
    return figure


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    require_data()
    warnings.simplefilter("ignore")  # kernels warn of the eigenvalues near 1/t
    names, n_values = (QUICK, 15) if arguments.quick else (DRAWN, 50)
    operators = [name for name in OPERATORS if not (arguments.quick and "geodesic" in name)]
    rows = {operator: spectra(names, operator, n_values) for operator in operators}
    size = sizes(names)
    results = {
        unit: {operator: distances(found, size, unit) for operator, found in rows.items()}
        for unit in ("area 1", "diameter 1")
    }
    pictures = {} if arguments.quick else {"figure_3_4": figure_spectra(rows, size)}
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
