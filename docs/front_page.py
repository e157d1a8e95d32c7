"""Draw the pictures of the README and of the site: a search, eigenfunctions, parts, labels, a bend that moves.

    python docs/front_page.py docs/pictures

`tests/house/test_front_page.py` draws them again, and compares.

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

NAMES = (
    "sheet.png",
    "spectrum.png",
    "parts.png",
    "labels.png",
    "transfer.png",
    "bend.png",
    "motion.webp",
)
N_FRAMES = 36  # of a loop of two seconds
FRAME = 440  # pixels of a side


def main(folder: Path, *, n_vertices: int = 5000) -> list[Path]:
    """Draw all pictures into a folder."""
    paths = [folder / name for name in NAMES]
    draw_search(paths[0])
    draw_spectrum(paths[1], n_vertices)
    draw_parts(paths[2], n_vertices)
    draw_labels(paths[3], n_vertices)
    draw_transfer(paths[4], n_vertices)
    draw_bend(paths[5], n_vertices)
    draw_motion(paths[6], n_vertices)
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


def draw_labels(path: Path, n_vertices: int) -> None:
    """Draw the parts of a giraffe, and their labels on another pose."""
    giraffe, other = (es.make_creature("giraffe", pose, n_vertices=n_vertices) for pose in (0, 3))
    labeled = es.retrieval.LabeledShape(giraffe, es.find_parts(giraffe).parts.labels)
    found = es.transfer_labels(labeled, other)
    es.save_figure(es.plot.figure_label_transfer(labeled, other, found), path)


def draw_transfer(path: Path, n_vertices: int) -> None:
    """Draw two characters, each beside another individual in another pose that wears its texture."""
    pictures = []
    for kind, pose in (("biped", 2), ("quadruped", 3)):
        worn = wear_texture(es.make_creature(kind, n_vertices=n_vertices))
        scan = es.make_creature(kind, pose, n_vertices=n_vertices, individual=1)
        for attributes in (worn, es.matching.transfer(worn, scan).attributes):
            camera = es.plot.aim_camera(attributes.mesh, size=FRAME)
            colors = texture_colors(attributes)
            pictures.append(es.plot.draw(attributes.mesh, camera, vertex_colors=colors).image)
    image = np.round(255 * np.hstack(pictures)).astype(np.uint8)
    Image.fromarray(image).quantize(256).save(path, optimize=True)


def wear_texture(mesh: es.TriangleMesh) -> es.io.MeshAttributes:
    """Return what a mesh wears: texture coordinates, the angle about the upright axis and the height."""
    x, y, z = mesh.vertices.T
    u = (np.arctan2(x, z) / (2 * np.pi))[mesh.faces]
    u += (u[:, :1] - u).round()  # a face across the seam lies on one side of it
    corners = np.stack([u, y[mesh.faces]], axis=2).reshape(-1, 2)
    numbers = enumerate(mesh.faces.ravel() + 1, start=1)
    words = [f"{vertex}/{corner}" for corner, vertex in numbers]
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices]
    lines += [f"vt {u} {v}" for u, v in corners]
    lines += [f"f {one} {two} {three}" for one, two, three in np.reshape(words, (-1, 3))]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "hero.obj")
        path.write_text("\n".join(lines), encoding="utf-8")
        return es.read_mesh(path, attributes=True)[1]


def texture_colors(attributes: es.io.MeshAttributes) -> np.ndarray:
    """Return the color at each vertex: stripes around the shape, checks along it."""
    mesh = attributes.mesh
    colors = np.empty((mesh.n_vertices, 3))
    u, v = attributes.texture_coordinates.reshape(-1, 2).T
    waves = 2 * np.pi * np.stack([2 * u + v, u + 3 * v, 3 * u], axis=1)
    colors[mesh.faces.ravel()] = 0.5 + 0.4 * np.sin(waves)
    return colors


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
