"""Draw the pictures of the README: a search, eigenfunctions, parts, and a bend.

    python examples/front_page.py docs/pictures

Synthetic shapes stand in for scans; `read_mesh("scan.ply")` takes their place with real files.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import eigenshape as es

NAMES = ("sheet.png", "spectrum.png", "parts.png", "bend.png")


def main(folder: Path, *, n_vertices: int = 5000) -> list[Path]:
    """Draw all four pictures into a folder."""
    paths = [folder / name for name in NAMES]
    draw_search(paths[0])
    draw_spectrum(paths[1], n_vertices)
    draw_parts(paths[2], n_vertices)
    draw_bend(paths[3], n_vertices)
    return paths


def draw_search(path: Path) -> None:
    """Keep the picture that `eigenshape demo` draws."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "eigenshape", "demo", "-o", folder]
        subprocess.run(command, check=True, capture_output=True)
        shutil.copyfile(Path(folder, "sheet.png"), path)


def draw_spectrum(path: Path, n_vertices: int) -> None:
    """Draw the first two eigenfunctions of a hand that are not constant."""
    hand = es.make_creature("hand", n_vertices=n_vertices)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(hand), k=6)
    es.save_figure(es.plot.figure_eigenfunctions(hand, spectrum, [1, 2]), path)


def draw_parts(path: Path, n_vertices: int) -> None:
    """Draw the parts of a figure that stands."""
    biped = es.make_creature("biped", n_vertices=n_vertices)
    parts = es.find_parts(biped).parts
    es.save_figure(es.figure_segments(biped, parts.labels, parts.features.vertices), path)


def draw_bend(path: Path, n_vertices: int) -> None:
    """Bend the neck of a giraffe forward by 40 degrees."""
    giraffe = es.make_creature("giraffe", n_vertices=n_vertices)
    low, high = giraffe.vertices.min(axis=0), giraffe.vertices.max(axis=0)
    neck = es.deformation.BoxRegion(
        [-np.inf, low[1] + 0.62 * (high - low)[1], -np.inf], [np.inf, np.inf, np.inf]
    )
    rim = es.deformation.region_boundary(giraffe, es.deformation.region_mask(giraffe, neck))
    pivot = giraffe.vertices[rim].mean(axis=0)
    bent = es.deform(
        es.rig_shape(giraffe), neck, es.Rotation(pivot, axis=[1, 0, 0], angle=np.deg2rad(40))
    )
    moved = np.linalg.norm(bent.vertices - giraffe.vertices, axis=1)
    figure = es.plot.figure_poses({"before": giraffe, "after": bent}, moved / moved.max())
    es.save_figure(figure, path)


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    for drawn in main(target):
        print(drawn)
