"""How small does a mesh become by its spectral coefficients, beside Draco and gzip? (thesis 1.2.3).

Bits a vertex against the error, at several precisions. Draco is measured where DracoPy is installed.
"""

import gzip
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.progress import track
from scipy.spatial import cKDTree

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, finish, parse_arguments, rounded  # noqa: E402
from real_shapes import DATA, require_data  # noqa: E402
from shape_panels import show_shape  # noqa: E402

import eigenshape as es  # noqa: E402

try:
    import DracoPy
except ImportError:  # the curves of Draco are left out
    DracoPy = None

CLASSICS = ("bunny.off", "camel.off", "elk.off")
BITS = (8, 10, 12, 14)
QUICK_BITS = (8, 10, 12)
SHOWN_BITS = (6, 7, 8, 10)
OURS, OUR_COORDINATES = "eigenshape", "eigenshape, coordinates alone"
DRACO, GZIP, GZIP_COORDINATES = "Draco", "gzip", "gzip, coordinates alone"
STYLES = {
    OURS: (COLORS[0], "-"),
    OUR_COORDINATES: (COLORS[0], "--"),
    DRACO: (COLORS[1], "-"),
    GZIP: (COLORS[2], "-"),
    GZIP_COORDINATES: (COLORS[2], "--"),
}


def root_mean_square(gaps: np.ndarray, mesh: es.TriangleMesh) -> float:
    """Return the root mean square of the lengths of rows, divided by the diagonal of the box."""
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    return float(np.sqrt((gaps**2).sum(axis=1).mean()) / diagonal)


def by_coefficients(mesh: es.TriangleMesh, bits: int) -> dict[str, tuple[float, float]]:
    """Return bits a vertex and error of our files, and of their coordinates alone."""
    packed = es.spectral.compress_mesh(mesh, bits)
    again = es.spectral.decompress_mesh(packed.data)
    error = root_mean_square(again.vertices - mesh.vertices[packed.vertex_order], mesh)
    sizes = {OURS: len(packed.data), OUR_COORDINATES: packed.n_geometry_bytes}
    return {name: (8 * size / mesh.n_vertices, error) for name, size in sizes.items()}


def by_gzip(mesh: es.TriangleMesh, bits: int) -> dict[str, tuple[float, float]]:
    """Return bits a vertex and error of rounded coordinates, with and without the faces.

    Coordinates are whole numbers of two bytes, as they are or as differences of neighbors in the
    file, whichever becomes smaller; so are the indices of faces, of four bytes.
    """
    low, side = mesh.vertices.min(axis=0), np.ptp(mesh.vertices, axis=0).max()
    step = side / 2**bits
    rounded_places = np.rint((mesh.vertices - low) / step).astype(np.int64)
    error = root_mean_square(low + step * rounded_places - mesh.vertices, mesh)
    coordinates = _gzipped(rounded_places, np.int16)
    sizes = {
        GZIP: coordinates + _gzipped(mesh.faces, np.int32),
        GZIP_COORDINATES: coordinates,
    }
    return {name: (8 * size / mesh.n_vertices, error) for name, size in sizes.items()}


def _gzipped(rows: np.ndarray, dtype: type) -> int:
    forms = (rows, np.diff(rows, axis=0, prepend=0))
    return min(len(gzip.compress(form.astype(dtype).tobytes(), 9, mtime=0)) for form in forms)


def by_draco(mesh: es.TriangleMesh, bits: int) -> dict[str, tuple[float, float]]:
    """Return bits a vertex and error of Draco's smallest files; empty without DracoPy."""
    if DracoPy is None:
        return {}
    data = DracoPy.encode(
        mesh.vertices.astype(np.float32),
        mesh.faces.astype(np.uint32),
        quantization_bits=bits,
        compression_level=10,
    )
    # Draco changes the order of vertices; the nearest vertex is the same one at these precisions.
    points = np.asarray(DracoPy.decode(data).points, dtype=float)
    _, partners = cKDTree(points).query(mesh.vertices)
    return {
        DRACO: (
            8 * len(data) / mesh.n_vertices,
            root_mean_square(points[partners] - mesh.vertices, mesh),
        )
    }


def curves(mesh: es.TriangleMesh, bits: tuple[int, ...], name: str) -> dict[str, np.ndarray]:
    """Return for each method a row (bits of precision, bits a vertex, error) for each precision."""
    rows: dict[str, list[tuple[float, float, float]]] = {}
    for precision in track(bits, description=name):
        for method in (by_coefficients, by_gzip, by_draco):
            for label, (size, error) in method(mesh, precision).items():
                rows.setdefault(label, []).append((precision, size, error))
    return {label: np.array(row) for label, row in rows.items()}


def at_equal_error(found: dict[str, np.ndarray], label: str, other: str) -> np.ndarray:
    """Return the size of `label` divided by that of `other`, at each error that both reach."""
    mine, theirs = found[label], found[other]
    low = max(mine[:, 2].min(), theirs[:, 2].min())
    high = min(mine[:, 2].max(), theirs[:, 2].max())
    errors = np.geomspace(low, high, 8)
    sizes = [
        np.interp(np.log(errors), np.log(rows[::-1, 2]), rows[::-1, 1]) for rows in (mine, theirs)
    ]
    return sizes[0] / sizes[1]


def ratios(found: dict[str, np.ndarray]) -> dict[str, float]:
    """Return the largest share of other files that ours take at equal error."""
    rows = {
        "coordinates, of gzip's": at_equal_error(found, OUR_COORDINATES, GZIP_COORDINATES).max(),
        "all, of gzip's": at_equal_error(found, OURS, GZIP).max(),
        "all, of gzip's coordinates": at_equal_error(found, OURS, GZIP_COORDINATES).max(),
    }
    if DRACO in found:
        against = at_equal_error(found, OURS, DRACO)
        rows |= {"all, of Draco's, most": against.max(), "all, of Draco's, least": against.min()}
    return rows


def draw_curves(results: dict[str, dict[str, np.ndarray]]) -> Figure:
    """Draw the error against the size, a panel a shape."""
    figure = Figure(figsize=(4.2 * len(results), 4.2), layout="constrained", dpi=110)
    panels = figure.subplots(1, len(results), sharey=True, squeeze=False)[0]
    for axes, (name, found) in zip(panels, results.items(), strict=True):
        for label, rows in found.items():
            color, style = STYLES[label]
            axes.semilogy(rows[:, 1], rows[:, 2], style, color=color, label=label, marker=".")
        axes.set_title(name, fontsize=10, loc="left")
        axes.set_xlabel("bits a vertex")
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.25)
    panels[0].set_ylabel("error (root mean square, of the diagonal)")
    panels[-1].legend(frameon=False, fontsize=8)
    return figure


def draw_precisions(mesh: es.TriangleMesh, camera: es.plot.Camera) -> Figure:
    """Draw one shape as it comes back at several precisions."""
    figure = Figure(figsize=(12, 3.6), layout="constrained", dpi=110)
    panels = figure.subplots(1, len(SHOWN_BITS) + 1)
    show_shape(panels[0], mesh, camera)
    panels[0].set_title(f"as it was: {mesh.n_vertices:,} vertices", fontsize=9)
    for axes, bits in zip(panels[1:], SHOWN_BITS, strict=True):
        packed = es.spectral.compress_mesh(mesh, bits)
        show_shape(axes, es.spectral.decompress_mesh(packed.data), camera)
        size = 8 * len(packed.data) / mesh.n_vertices
        axes.set_title(f"{bits} bits: {size:.1f} bits a vertex", fontsize=9)
    return figure


def table(found: dict[str, np.ndarray]) -> dict[str, dict[str, list[float]]]:
    """Return the curves as lists: bits a vertex and error by precision."""
    return {
        label: {f"{int(bits)} bits": [size, error] for bits, size, error in rows}
        for label, rows in found.items()
    }


def main() -> None:
    """Run the experiment."""
    arguments = parse_arguments(__doc__, HERE)
    if arguments.quick:
        ball = es.icosphere(3)
        wave = 1 + 0.2 * np.sin(4 * ball.vertices).prod(axis=1, keepdims=True)
        shapes = {"bumpy sphere": es.TriangleMesh(wave * ball.vertices, ball.faces)}
    else:
        require_data()
        shapes = {Path(name).stem: es.read_mesh(DATA / "classics" / name) for name in CLASSICS}
    bits = QUICK_BITS if arguments.quick else BITS
    found = {name: curves(mesh, bits, name) for name, mesh in shapes.items()}
    results: dict[str, object] = {
        "at equal error": {name: ratios(rows) for name, rows in found.items()},
        "curves": {name: table(rows) for name, rows in found.items()},
    }
    pictures = {}
    if arguments.figures:
        first = next(iter(shapes.values()))
        bunny = shapes.get("bunny", first)
        camera = es.plot.aim_camera(bunny)
        pictures = {"curves": draw_curves(found), "precisions": draw_precisions(bunny, camera)}
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
