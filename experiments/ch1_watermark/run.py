"""Is a watermark found after smoothing and noise, and never where it is not? (thesis 1.2.3).

Each shape is marked and attacked; the right key is tested after each attack, and wrong keys after one.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import igl
import numpy as np
import scipy.linalg as sl
from matplotlib.figure import Figure
from rich.progress import track

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, finish, label, parse_arguments, rounded  # noqa: E402
from real_shapes import DATA, manifest, require_data  # noqa: E402

import eigenshape as es  # noqa: E402

N_REAL = 20  # classes of the collection, in the order of the alphabet
N_FACES = 2_400  # after decimation: all modes of 1,200 vertices take a second
KEY = "the key of the owner"
N_SYNTHETIC = 500  # vertices of a creature, in the quick form
FOUND = 1e-6  # false-alarm probability below which a mark counts as found
N_TRIES = 10_000  # wrong keys in all
NOISE = 1e-3  # standard deviation of each coordinate, as a share of the diagonal
KEPT = 0.7  # share of the modes that a low-pass keeps
NOISY = "noise of 0.1 %"

Points = np.ndarray


def shapes(quick: bool) -> dict[str, es.TriangleMesh]:
    """Return the shapes by name."""
    if quick:
        return {
            kind: es.make_creature(kind, n_vertices=N_SYNTHETIC)
            for kind in ("octopus", "quadruped")
        }
    require_data()
    smallest: dict[str, dict[str, str]] = {}
    for row in sorted(manifest(), key=lambda row: int(row["vertices"])):
        smallest.setdefault(row["cls"], row)
    return {
        f"{kind} ({Path(smallest[kind]['path']).stem})": decimated(smallest[kind]["path"])
        for kind in sorted(smallest)[:N_REAL]
    }


def decimated(path: str) -> es.TriangleMesh:
    """Return a shape of the collection with few faces."""
    mesh = es.read_mesh(DATA / path)
    vertices, faces, *_ = igl.decimate(
        np.array(mesh.vertices), np.array(mesh.faces), N_FACES, block_intersections=True
    )
    return es.TriangleMesh(vertices, faces)


def low_pass(mesh: es.TriangleMesh, share: float) -> Points:
    """Return the vertices projected on the lowest modes of the mesh itself."""
    laplacian = es.robust_laplacian(mesh)
    root = np.sqrt(laplacian.mass.diagonal())
    matrix = laplacian.stiffness.toarray() / np.outer(root, root)
    _, modes = sl.eigh(matrix, driver="evd", overwrite_a=True)
    kept = modes[:, : int(share * len(modes))]
    return kept @ (kept.T @ (root[:, None] * mesh.vertices)) / root[:, None]


def add_noise(mesh: es.TriangleMesh, share: float, rng: np.random.Generator) -> Points:
    """Return the vertices moved by independent Gaussian noise."""
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    return mesh.vertices + share * diagonal * rng.normal(size=mesh.vertices.shape)


def quantize(mesh: es.TriangleMesh, bits: int) -> Points:
    """Return the vertices after compression and decompression, in their order."""
    packed = es.spectral.compress_mesh(mesh, bits)
    points = np.empty_like(mesh.vertices)
    points[packed.vertex_order] = es.spectral.decompress_mesh(packed.data).vertices
    return points


def move(mesh: es.TriangleMesh, rng: np.random.Generator) -> Points:
    """Return the vertices turned, scaled and moved."""
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return 25.4 * mesh.vertices @ (rotation * np.linalg.det(rotation)).T + [3, 2, 1]


def bend(mesh: es.TriangleMesh) -> Points:
    """Return the vertices twisted by 20 degrees from one end to the other."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    axis = int(np.argmax(high - low))
    x, y = (mesh.vertices[:, (axis + step) % 3] for step in (1, 2))
    angle = np.deg2rad(20) * (mesh.vertices[:, axis] - low[axis]) / (high - low)[axis]
    points = mesh.vertices.copy()
    points[:, (axis + 1) % 3] = np.cos(angle) * x - np.sin(angle) * y
    points[:, (axis + 2) % 3] = np.sin(angle) * x + np.cos(angle) * y
    return points


def attacks(
    marked: es.TriangleMesh, rng: np.random.Generator
) -> dict[str, Callable[[es.TriangleMesh], Points]]:
    """Return what is done to a marked shape, by name."""
    smooth = es.TriangleMesh(low_pass(marked, KEPT), marked.faces)
    return {
        "none": lambda mesh: mesh.vertices,
        "turned, scaled, moved": lambda mesh: move(mesh, rng),
        "low-pass to 70 % of the modes": lambda _: smooth.vertices,
        NOISY: lambda mesh: add_noise(mesh, NOISE, rng),
        "low-pass, then noise": lambda _: add_noise(smooth, NOISE, rng),
        "noise of 0.5 %": lambda mesh: add_noise(mesh, 5 * NOISE, rng),
        "compressed to 10 bits": lambda mesh: quantize(mesh, 10),
        "denoised": lambda mesh: es.operators.denoise(mesh).vertices,
        "twisted by 20 degrees": bend,
    }


def run(quick: bool, cache: str) -> tuple[dict[str, object], dict[str, list[float]], np.ndarray]:
    """Return the figures, the scores of the right key by attack, and those of wrong keys."""
    rng = np.random.default_rng(0)
    marked_shapes = shapes(quick)
    tests: dict[str, list[es.spectral.WatermarkTest]] = {}
    wrong: list[es.spectral.WatermarkTest] = []
    n_tries = (200 if quick else N_TRIES) // len(marked_shapes)
    for name, mesh in track(marked_shapes.items(), description="shapes"):
        marked = es.spectral.embed_watermark(mesh, KEY, cache=cache)
        for attack, change in attacks(marked, rng).items():
            suspect = es.TriangleMesh(change(marked), marked.faces)
            tests.setdefault(attack, []).append(
                es.spectral.detect_watermark(mesh, suspect, KEY, cache=cache)
            )
            if attack == NOISY:
                keys = [f"{name}, wrong key {number}" for number in range(n_tries)]
                wrong += es.spectral.detect_watermark(mesh, suspect, keys, cache=cache)
    chances = np.array([test.false_alarm for test in wrong])
    figures = {
        "shapes": len(marked_shapes),
        "attacks": {attack: summary(rows) for attack, rows in tests.items()},
        "wrong keys": {
            "tries": len(wrong),
            "found": int((chances < FOUND).sum()),
            "below 1e-3": int((chances < 1e-3).sum()),
            "below 0.05": float((chances < 0.05).mean()),
            "highest score": max(test.score for test in wrong),
        },
    }
    scores = {attack: [test.score for test in rows] for attack, rows in tests.items()}
    return figures, scores, np.array([test.score for test in wrong])


def summary(rows: list[es.spectral.WatermarkTest]) -> dict[str, float]:
    """Return how many shapes' marks were found, and the weakest evidence."""
    return {
        "found": sum(test.false_alarm < FOUND for test in rows),
        "lowest score": min(test.score for test in rows),
        "mean score": float(np.mean([test.score for test in rows])),
        "log10 of the largest probability": float(
            np.log10(max(1e-300, *(test.false_alarm for test in rows)))
        ),
    }


def draw(scores: dict[str, list[float]], wrong: np.ndarray) -> Figure:
    """Draw the scores of the right key by attack, and those of wrong keys below."""
    figure = Figure(figsize=(8.4, 4.8), layout="constrained", dpi=110)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    for place, values in enumerate(scores.values()):
        above.plot(values, np.full(len(values), place), "|", ms=12, color=COLORS[0])
    above.set_yticks(range(len(scores)), list(scores))
    above.invert_yaxis()
    below.hist(wrong, bins=80, color=COLORS[1])
    for axes in (above, below):
        axes.spines[["top", "right"]].set_visible(False)
    label(above, "", "", "right key, one stroke a shape", legend=False)
    caption = f"{len(wrong):,} wrong keys, after noise of 0.1 %"
    label(below, "score (correlation)", "tries", caption, legend=False)
    return figure


def main() -> None:
    """Run the experiment."""
    arguments = parse_arguments(__doc__, HERE)
    with TemporaryDirectory() as cache:
        figures, scores, wrong = run(arguments.quick, cache)
    pictures = {"scores": draw(scores, wrong)} if arguments.figures else {}
    finish(rounded(figures), pictures, arguments)


if __name__ == "__main__":
    main()
