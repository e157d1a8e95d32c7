"""Fingers join, touch each other, and touch the nose: what do eigenvalues hear? (thesis 4.4, Figure 4.5).

Samples of each variant of the armadillo, coupled and independent, are compared by the first 300 eigenvalues of the
Gaussian-weighted graph Laplacian. Only fingers are moved, so that the changes stay local. A bar
between the legs, which the thesis does not have, is the larger change.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

FOLDER = Path(__file__).resolve().parent
sys.path.append(str(FOLDER.parent))
from frame import finish, parse_arguments, rounded  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from real_shapes import DATA, require_data  # noqa: E402
from surgery import Surgery, bridge, moved  # noqa: E402
from topological import mesh_changes, mesh_spectra, sample_all, soundness  # noqa: E402
from topological_pictures import figure_bars, figure_meshes  # noqa: E402

import eigenshape as es  # noqa: E402

# Places near the tips of three fingers of the left hand and the nose; lengths are over the diameter.
MIDDLE, LITTLE, INDEX = (0.275, 0.193, 0.319), (0.304, 0.147, 0.304), (0.263, 0.235, 0.302)
FINGER = 0.05  # length of a finger
NOSE = 0.03  # how wide it is, about
CLEARANCE = 0.002  # between the nose and the finger that touches it
BRIDGE, BAR = 0.009, 0.04  # radii
LEG = -0.27  # height of the bar
# heat time, form, points, seeds
RUNS = ((1e-4, "coupled", 8000, 5), (1e-3, "coupled", 2000, 5), (1e-3, "independent", 2000, 5))
QUICK = ((1e-3, "coupled", 800, 2),)


def nearest(mesh: es.TriangleMesh, place: tuple[float, ...]) -> int:
    """Return the vertex nearest to a place."""
    return int(np.linalg.norm(mesh.vertices - place, axis=1).argmin())


def shares(mesh: es.TriangleMesh, tip: int, reach: float) -> np.ndarray:
    """Return by how much vertices follow a fingertip: smoothly from 1 there to 0 a reach away along the surface."""
    rest = np.clip(1 - es.geometry.geodesic_distances(mesh, [tip])[0] / reach, 0, 1)
    return rest**2 * (3 - 2 * rest)


def touching(mesh: es.TriangleMesh, tips: tuple[int, int]) -> np.ndarray:
    """Move two fingers towards each other until they would cross; return the vertices just before."""
    one, two = (mesh.vertices[tip] for tip in tips)
    way = sum(share[:, None] * (end - start) for share, start, end in
              ((shares(mesh, tips[0], FINGER), one, two), (shares(mesh, tips[1], FINGER), two, one)))  # fmt: skip
    near = np.linalg.norm(mesh.vertices - (one + two) / 2, axis=1) < 2 * FINGER
    hand = mesh.faces[near[mesh.faces].all(axis=1)]
    least, most = 0.0, 1.0
    for _ in range(12):
        middle = (least + most) / 2
        crosses = len(
            es.geometry.self_intersections(es.TriangleMesh(mesh.vertices + middle * way, hand))
        )
        least, most = (least, middle) if crosses else (middle, most)
    return mesh.vertices + least * way


def facing(mesh: es.TriangleMesh, tips: tuple[int, int]) -> tuple[int, int]:
    """Return the vertices by which two fingers are nearest to each other, close to their tips."""
    one, two = (
        np.flatnonzero(es.geometry.geodesic_distances(mesh, [tip])[0] < 0.4 * FINGER)
        for tip in tips
    )
    away, place = cKDTree(mesh.vertices[two]).query(mesh.vertices[one])
    return int(one[away.argmin()]), int(two[place[away.argmin()]])


def variants(mesh: es.TriangleMesh) -> dict[str, Surgery]:
    """Return the armadillo's changes, the smallest first."""
    tips = nearest(mesh, MIDDLE), nearest(mesh, LITTLE)
    touch = touching(mesh, tips)
    index = nearest(mesh, INDEX)
    nose = nose_tip(mesh, index)
    way = mesh.vertices[nose] - mesh.vertices[index]
    stretch = 1 - CLEARANCE / np.linalg.norm(way)
    to_nose = touch + stretch * shares(mesh, index, FINGER)[:, None] * way
    x, y = mesh.vertices[:, 0], mesh.vertices[:, 1]
    level = np.abs(y - LEG) < 0.01
    legs = (
        np.where(level & (x < 0), x, -np.inf).argmax(),
        np.where(level & (x > 0), x, np.inf).argmin(),
    )
    return {
        "two touch": moved(mesh, touch),
        "two joined": bridge(mesh, *facing(mesh, tips), BRIDGE),
        "two touch, one on nose": moved(mesh, to_nose),
        "legs joined": bridge(mesh, int(legs[0]), int(legs[1]), BAR),
    }


def nose_tip(mesh: es.TriangleMesh, finger: int) -> int:
    """Return the vertex nearest to a finger around the one that is farthest in front, near the plane of symmetry."""
    front = np.where(np.abs(mesh.vertices[:, 0]) < 0.04, mesh.vertices[:, 2], -np.inf).argmax()
    away = np.linalg.norm(mesh.vertices - mesh.vertices[finger], axis=1)
    nose = np.linalg.norm(mesh.vertices - mesh.vertices[front], axis=1) < NOSE
    return int(np.where(nose, away, np.inf).argmin())


def draw_variants(surgeries: dict[str, Surgery]) -> Figure:
    """Draw the armadillo, its hand before and after, its head and hand, and its legs."""
    first = next(iter(surgeries.values())).one
    hand, head = (
        (lambda p: (p[:, 0] > 0.2) & (p[:, 1] > 0.08) & (p[:, 2] > 0.1)),
        (lambda p: (p[:, 1] > 0.02) & (p[:, 0] > -0.13)),
    )
    crops = {
        "two touch": hand,
        "two joined": hand,
        "two touch, one on nose": head,
        "legs joined": lambda p: p[:, 1] < 0,
    }
    before = Surgery(first, first, *(np.full(first.n_faces, -1),) * 2)
    panels = [_crop(before, hand, "M: the left hand")]
    panels += [_crop(surgery, crops[name], name) for name, surgery in surgeries.items()]
    sheet = es.plot.figure_contact_sheet(
        _crop(before, lambda p: p[:, 1] > -1, "M"), panels, caption="Changes in green"
    )
    sheet.set_size_inches(10.8, 5.4)
    return sheet


def _crop(surgery: Surgery, keep: object, name: str) -> es.plot.Panel:
    mesh = surgery.two
    inside = keep(mesh.vertices)[mesh.faces].all(axis=1)
    colors = np.where(surgery.regions_two[inside] < 0, -1, 2)
    used, corners = np.unique(mesh.faces[inside], return_inverse=True)
    part = es.TriangleMesh(mesh.vertices[used], corners.reshape(-1, 3))
    return es.plot.Panel(part, name, colors, np.array([], dtype=np.int64))


def main() -> None:
    """Measure, draw and print."""
    arguments = parse_arguments(__doc__, FOLDER)
    require_data()
    surgeries = variants(
        es.geometry.normalize_mesh(es.read_mesh(DATA / "classics" / "armadillo.obj"), "diameter")
    )
    runs = sample_all(
        surgeries, QUICK if arguments.quick else RUNS, 100 if arguments.quick else 300
    )
    meshes = {} if arguments.quick else mesh_spectra(surgeries, kernel=False)
    results = {
        "surfaces": {
            name: soundness(surgery, close=not arguments.quick, widen=False)
            for name, surgery in surgeries.items()
        },
        "samples": {name: run["changes"] for name, run in runs.items()},
        "meshes": mesh_changes(meshes),
    }
    pictures = {}
    if arguments.figures:
        pictures = {
            "variants": draw_variants(surgeries),
            "changes": figure_bars(runs, shown=next(iter(runs))),
        }
    if meshes:
        pictures["meshes"] = figure_meshes(meshes, ("cotangent",))
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
