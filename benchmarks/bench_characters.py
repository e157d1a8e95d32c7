"""Ten textured characters, bent on the command line: points that tear along seams, and what becomes of the texture.

    python benchmarks/bench_characters.py             ten characters as OBJ and GLB; two minutes
    python benchmarks/bench_characters.py --quick     one of them, as OBJ and GLB; seconds

The characters are made by the library, unwrapped by a cylinder or as six charts, and written with a vertex for each
place in the image, as exporters for games write them. The upper 40 % turn by 40°. A point is torn if corners that lay
at one place no longer do. The texture is kept if the corners have the same places in the image and the image the same
bytes.
"""

import os
import tempfile
from pathlib import Path

import numpy as np
from report import Report, Row, options_of
from textured_characters import UNWRAPPINGS, write_character
from typer.testing import CliRunner

import eigenshape as es
from eigenshape.cli import app

KINDS = ("biped", "giraffe", "hand", "octopus", "quadruped")
COLUMNS = ("character", "file", "points on seams", "torn", "torn without weld_seams", "texture")
SIZE = 2000


def bend(path: Path, *options: str) -> tuple[es.TriangleMesh, es.io.MeshAttributes, str]:
    """Bend a file on the command line; return what was written, and what was printed on stderr."""
    out = path.with_name(f"bent-{path.name}")
    words = ["deform", str(path), "--region", "y>60%", "--rotate", "x by 40", "-o", str(out)]
    done = CliRunner().invoke(app, [*words, *options])
    if done.exit_code:
        raise SystemExit(done.stderr)
    return *es.read_mesh(out, attributes=True), done.stderr


def torn_points(before: es.TriangleMesh, after: es.TriangleMesh) -> tuple[int, int]:
    """Count the places of several vertices, and those of them at which corners have come apart."""
    places, numbers = np.unique(before.vertices, axis=0, return_inverse=True)
    numbers = numbers.ravel()
    on_seams = int((np.bincount(numbers) > 1).sum())
    corners = numbers[before.faces.ravel()]
    where = after.vertices[after.faces.ravel()]
    low, high = np.full((len(places), 3), np.inf), np.full((len(places), 3), -np.inf)
    np.minimum.at(low, corners, where)
    np.maximum.at(high, corners, where)
    gaps = np.linalg.norm(high - low, axis=1) / np.ptp(before.vertices, axis=0).max()
    return on_seams, int((gaps > 1e-9).sum())


def measure(path: Path, name: str) -> Row:
    """Bend a file with and without welding, and compare."""
    before, held = es.read_mesh(path, attributes=True)
    after, kept, words = bend(path)
    loose, _, _ = bend(path, "--repair", "none")
    on_seams, torn = torn_points(before, after)
    same_places = np.array_equal(held.texture_coordinates, kept.texture_coordinates)
    images = [[each.image for each in found.materials] for found in (held, kept)]
    return {
        "character": name,
        "file": path.suffix,
        "seams": on_seams,
        "torn": torn,
        "loose": torn_points(before, loose)[1],
        "kept": same_places and images[0] == images[1] and None not in images[0],
        "said": "weld_seams joined" in words,
    }


def cells(row: Row) -> list[str]:
    """Return the texts of a row."""
    texture = "kept" if row["kept"] else "lost"
    counts = [f"{row[key]:,}" for key in ("seams", "torn", "loose")]
    return [row["character"], row["file"], *counts, texture]


def main() -> None:
    """Run the benchmark."""
    options = options_of(__doc__).parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    report = Report(["eigenshape", "numpy", "scipy"], options, COLUMNS, cells)
    kinds = KINDS[:1] if options.quick else KINDS
    with tempfile.TemporaryDirectory() as folder:
        for kind in kinds:
            mesh = es.make_creature(kind, n_vertices=500 if options.quick else SIZE)
            for unwrapping in list(UNWRAPPINGS)[: 1 if options.quick else None]:
                for suffix in (".obj", ".glb"):
                    path = Path(folder, f"{kind}-{unwrapping}{suffix}")
                    write_character(path, mesh, unwrapping)
                    report.add(measure(path, f"{kind}, {unwrapping}"))


if __name__ == "__main__":
    main()
