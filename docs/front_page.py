"""Draw the pictures of the README and of the site: a search, eigenfunctions, parts, and a bend that moves.

    python docs/front_page.py docs/pictures

Synthetic shapes stand in for scans; `read_mesh("scan.ply")` takes their place with real files.
"""

import subprocess
import sys
import tempfile
from itertools import product
from pathlib import Path

import numpy as np
from PIL import Image  # comes with matplotlib

import eigenshape as es

NAMES = ("sheet.png", "spectrum.png", "parts.png", "bend.png", "motion.webp")
N_FRAMES = 36  # of a loop of two seconds
FRAME = 440  # pixels of a side


def main(folder: Path, *, n_vertices: int = 5000) -> list[Path]:
    """Draw all pictures into a folder."""
    paths = [folder / name for name in NAMES]
    draw_search(paths[0])
    draw_spectrum(paths[1], n_vertices)
    draw_parts(paths[2], n_vertices)
    draw_bend(paths[3], n_vertices)
    draw_motion(paths[4], n_vertices)
    return paths


def draw_search(path: Path) -> None:
    """Keep the picture that `eigenshape demo` draws."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "eigenshape", "demo", "-o", folder]
        subprocess.run(command, check=True, capture_output=True)
        with Image.open(Path(folder, "sheet.png")) as sheet:
            # A palette takes 77 KB in place of 267: the front page weighs less than 1 MB.
            sheet.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)


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


def neck_of_giraffe(
    n_vertices: int,
) -> tuple[es.TriangleMesh, es.deformation.BoxRegion, np.ndarray]:
    """Return a giraffe, its neck and head, and a point about which they turn."""
    giraffe = es.make_creature("giraffe", n_vertices=n_vertices)
    low, high = giraffe.vertices.min(axis=0), giraffe.vertices.max(axis=0)
    neck = es.deformation.BoxRegion(
        [-np.inf, low[1] + 0.62 * (high - low)[1], -np.inf], [np.inf, np.inf, np.inf]
    )
    boundary = es.deformation.region_boundary(giraffe, es.deformation.region_mask(giraffe, neck))
    return giraffe, neck, giraffe.vertices[boundary].mean(axis=0)


def draw_bend(path: Path, n_vertices: int) -> None:
    """Bend the neck of a giraffe forward by 40 degrees."""
    giraffe, neck, pivot = neck_of_giraffe(n_vertices)
    bent = es.deform(
        es.rig_shape(giraffe), neck, es.Rotation(pivot, axis=[1, 0, 0], angle=np.deg2rad(40))
    )
    moved = np.linalg.norm(bent.vertices - giraffe.vertices, axis=1)
    figure = es.plot.figure_poses({"before": giraffe, "after": bent}, moved / moved.max())
    es.save_figure(figure, path)


def draw_motion(path: Path, n_vertices: int) -> None:
    """Draw a loop in which the giraffe bows and rises, colored by an eigenfunction."""
    giraffe, neck, pivot = neck_of_giraffe(n_vertices)
    binding = es.deformation.bind(es.rig_shape(giraffe), [neck])
    spectrum = es.solve_spectrum(es.cotangent_laplacian(giraffe), k=9)
    colors = es.plot.value_colors(spectrum.eigenvectors[:, 8], "RdYlBu_r") / 255
    rotation = es.plot.aim_camera(giraffe).rotation
    degrees = 35 - 50 * np.cos(2 * np.pi * np.arange(N_FRAMES // 2 + 1) / N_FRAMES)
    poses = [
        es.deformation.bend(binding, [es.Rotation(pivot, [1, 0, 0], np.deg2rad(angle))])
        for angle in degrees
    ]

    # Points at the corners of the box of all poses, which no face uses, keep the picture still.
    every = np.vstack([pose.vertices for pose in poses]) @ rotation.T
    corners = np.array(list(product(*zip(every.min(axis=0), every.max(axis=0), strict=True))))
    painted = np.vstack([colors, np.ones((len(corners), 3))])
    frames = []
    for pose in poses:
        framed = es.TriangleMesh(np.vstack([pose.vertices, corners @ rotation]), pose.faces)
        camera = es.plot.Camera(rotation, FRAME)
        image = es.plot.draw(framed, camera, vertex_colors=painted).image
        frames.append(Image.fromarray(np.round(255 * image).astype(np.uint8)))
    loop = frames + frames[-2:0:-1]
    loop[0].save(path, save_all=True, append_images=loop[1:], duration=60, loop=0, quality=70)


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    for drawn in main(target):
        print(drawn)
