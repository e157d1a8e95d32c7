"""Parts and wholes with known maps: two poses of an animal, each with triangles of its own."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from real_shapes import DATA
from surgery import bridge

# Chosen before any result was looked at: constants were tuned on horses, cats and wolves, and lions
# and the rigid pairs report.
TUNING = {
    "horse": [f"sumner_horse-{number:02d}" for number in range(1, 11)],
    "cat": [f"sumner_cat-{number:02d}" for number in range(1, 10)],
    "wolf": [f"tosca_wolf{number}" for number in range(3)],
}
REPORTING = {"lion": [f"sumner_lion-{number:02d}" for number in range(1, 10)]}
# Shapes whose other poses have other vertices: part and whole are the same pose, with different
# triangles.
RIGID = {
    "dog": [f"tosca_dog{number}" for number in (0, 5, 7)],
    "centaur": [f"tosca_centaur{number}" for number in (0, 2, 4)],
    "human": ["tosca_david0", "tosca_michael3", "tosca_victoria10"],
}
SETS = ("cuts", "holes", "scans", "noise", "wholes")
FURTHER_SETS = ("pieces", "bridges")
# The share of the vertices that a plane removes, at least and at most
REMOVED = {"cuts": (0.3, 0.7), "small cuts": (0.4, 0.8)}
N_VERTICES = 5000  # of the whole, and of the other shape before it is cut
N_TRUE = 400  # vertices of a part at which errors are measured
JITTER = 0.15  # of the mean edge: vertices are moved along the surface before they are thinned out
# A pose of an animal that is its own mirror image in the plane x = 0. No other animal of the sets
# has one.
SYMMETRIC = {"lion": "sumner_lion-reference"}
NOISE = 0.25  # of the mean edge, in each coordinate
MOST_HOLES = 20
OFF_SURFACE = 0.03  # roots of the area: vertices of a part that lie farther off have no true place
SLAB = 0.42, 0.58  # the share of the vertices below each of two parallel planes
# Ends of a bridge: at most so far through space, at least so far along the surface, and the radius of
# the tube, in roots of the area
BRIDGE_ACROSS, BRIDGE_ALONG, BRIDGE_RADIUS = 0.25, 0.6, 0.03
# Bumps that stretch a shape: how many, how wide (a share of its longest side), the standard deviation
# of the logarithm by which they stretch along each axis, and the least and the most that they add
N_BUMPS, BUMP_WIDTHS = 6, (0.12, 0.25)
BUMP_STRETCH, MOST_STRETCH = 0.375, (-0.5, 0.8)
# Radii of holes, in roots of the area of the whole
HOLE_RADII = 0.02, 0.07


@dataclass(frozen=True)
class Pair:
    """A part, a whole, and where some vertices of the part belong.

    `vertices` are vertices of the part, `points` their true places on the whole, and `distances`
    the geodesic distances of the nearest vertices of the whole to all others, all in the unit of
    the whole. `mirrored` and `mirrored_distances` are the same for the mirror images of these places
    on the whole, if the animal has a symmetric pose.
    """

    name: str
    part: es.TriangleMesh
    whole: es.TriangleMesh
    vertices: np.ndarray
    points: np.ndarray
    distances: np.ndarray
    mirrored: np.ndarray | None = None
    mirrored_distances: np.ndarray | None = None


def read_shape(name: str) -> es.TriangleMesh:
    """Read a shape of the retrieval data by its name."""
    path = next((DATA / "retrieval").glob(f"*/{name}.ply"))
    return es.read_mesh(path)


def remesh(mesh: es.TriangleMesh, n_vertices: int, rng: np.random.Generator) -> es.TriangleMesh:
    """Return a mesh of the same surface with other vertices and triangles."""
    import igl  # noqa: PLC0415 - of the extra "test"

    fine = es.geometry.subdivide(mesh)
    edge = es.geometry.edge_lengths(fine).mean()
    moved = fine.vertices + JITTER * edge * rng.standard_normal(fine.vertices.shape)
    points = es.geometry.closest_points(mesh, moved).points
    n_faces = 2 * n_vertices
    found = igl.decimate(np.array(points), np.array(fine.faces), n_faces)
    less, faces = found[:2] if isinstance(found[0], np.ndarray) else found[1:3]
    if len(faces):
        coarse = es.repair(es.TriangleMesh(less, faces), ["drop_unreferenced"]).mesh
    else:  # libigl refuses edges of three faces, which some bones and plates have
        coarse = es.geometry.decimate(es.TriangleMesh(points, fine.faces), n_faces).mesh
    on_surface = es.geometry.closest_points(mesh, coarse.vertices).points
    coarse = es.TriangleMesh(on_surface, coarse.faces)
    return es.repair(coarse, ["drop_degenerate", "largest_component"]).mesh


def cut(mesh: es.TriangleMesh, kind: str, rng: np.random.Generator) -> es.TriangleMesh:
    """Return the part of a set: its largest piece, or all of them if they are the matter."""
    if kind == "pieces":
        return without_slab(mesh, rng)
    if kind in REMOVED:
        planes = es.scans.random_planes(mesh, rng, share=rng.uniform(*REMOVED[kind]))
        part = es.scans.cut_by_planes(mesh, planes).mesh
    elif kind == "scans":
        part = es.partial_scan(mesh, rng).mesh
    elif kind == "holes":
        part = with_holes(mesh, rng)
    elif kind == "bridges":
        part = with_bridge(mesh, rng)
    elif kind == "noise" or kind.startswith("noisy "):
        clean = rng.choice(["cuts", "holes", "scans"]) if kind == "noise" else kind[len("noisy ") :]
        part = cut(mesh, str(clean), rng)
        edge = es.geometry.edge_lengths(part).mean()
        noise = NOISE * edge * rng.standard_normal(part.vertices.shape)
        part = es.TriangleMesh(part.vertices + noise, part.faces)
    else:
        part = mesh
    return es.repair(part, ["largest_component"]).mesh


def with_holes(mesh: es.TriangleMesh, rng: np.random.Generator) -> es.TriangleMesh:
    """Remove up to twenty geodesic discs."""
    wave = es.geometry.geodesic_waves(mesh)
    unit = np.sqrt(es.geometry.surface_area(mesh))
    gone = np.zeros(mesh.n_vertices, dtype=bool)
    for _ in range(rng.integers(5, MOST_HOLES + 1)):
        radius = unit * rng.uniform(*HOLE_RADII)
        gone |= wave(rng.integers(mesh.n_vertices), radius) <= radius
    rest = es.TriangleMesh(mesh.vertices, mesh.faces[~gone[mesh.faces].any(axis=1)])
    return es.repair(rest, ["drop_unreferenced"]).mesh


def without_slab(mesh: es.TriangleMesh, rng: np.random.Generator) -> es.TriangleMesh:
    """Remove what lies between two parallel planes, so that pieces are left on both sides."""
    direction = rng.standard_normal(3)
    heights = mesh.vertices @ direction
    low, high = np.quantile(heights, SLAB)
    gone = (heights > low) & (heights < high)
    rest = es.TriangleMesh(mesh.vertices, mesh.faces[~gone[mesh.faces].any(axis=1)])
    return es.repair(rest, ["drop_unreferenced"]).mesh


def with_bridge(mesh: es.TriangleMesh, rng: np.random.Generator) -> es.TriangleMesh:
    """Join two places that are near in space and far along the surface by a tube."""
    unit = np.sqrt(es.geometry.surface_area(mesh))
    for vertex in rng.permutation(mesh.n_vertices):
        along = es.geometry.geodesic_distances(mesh, [vertex])[0]
        across = np.linalg.norm(mesh.vertices - mesh.vertices[vertex], axis=1)
        far = np.flatnonzero((across < BRIDGE_ACROSS * unit) & (along > BRIDGE_ALONG * unit))
        if len(far):
            try:
                return bridge(mesh, int(vertex), int(rng.choice(far)), BRIDGE_RADIUS * unit).two
            except es.InvalidParameterError:
                continue  # no disc around one of the two; another vertex may have one
    raise ValueError("no two places of the shape are near in space and far along it")


def stretched(mesh: es.TriangleMesh, rng: np.random.Generator) -> es.TriangleMesh:
    """Return a shape of which smooth bumps stretch or shrink the surroundings of some vertices."""
    size = np.ptp(mesh.vertices, axis=0).max()
    vertices = np.array(mesh.vertices)
    for _ in range(N_BUMPS):
        away = mesh.vertices - mesh.vertices[rng.integers(mesh.n_vertices)]
        width = size * rng.uniform(*BUMP_WIDTHS)
        weights = np.exp(-(away**2).sum(axis=1) / (2 * width**2))
        stretch = np.expm1(rng.normal(0, BUMP_STRETCH, 3)).clip(*MOST_STRETCH)
        vertices += weights[:, None] * away * stretch
    return es.TriangleMesh(vertices, mesh.faces)


def make_pair(
    animal: str, poses: tuple[str, str], kind: str, seed: int, *, stretch: bool = False
) -> Pair:
    """Return a part of the first pose, which may be stretched, and the second pose as a whole."""
    first, second = (read_shape(pose) for pose in poses)
    if stretch:
        # drawn apart, so that what is cut does not depend on it
        first = stretched(first, np.random.default_rng(seed + 7))
    name = f"{kind} {seed}: {poses[0]} on {poses[1]}"
    rest = read_shape(SYMMETRIC[animal]) if animal in SYMMETRIC else None
    return pair_of(name, (first, second), kind, np.random.default_rng(seed), rest=rest)


def pair_of(
    name: str,
    poses: tuple[es.TriangleMesh, es.TriangleMesh],
    kind: str,
    rng: np.random.Generator,
    *,
    sizes: tuple[int, int] = (N_VERTICES, N_VERTICES),
    rest: es.TriangleMesh | None = None,
) -> Pair:
    """Return a part of the first of two shapes with the same faces, and the second one as a whole.

    `sizes` are the vertices of the first shape before it is cut and of the whole; `rest` is a pose
    that is its own mirror image.
    """
    first, second = poses
    whole = remesh(second, sizes[1], np.random.default_rng(1))
    part = cut(remesh(first, sizes[0], np.random.default_rng(2)), kind, rng)
    foot = es.geometry.closest_points(first, part.vertices)
    # Tubes of bridges lie on no place of the animal.
    unit = np.sqrt(es.geometry.surface_area(first))
    off = np.linalg.norm(foot.points - part.vertices, axis=1)
    known = np.flatnonzero(off < OFF_SURFACE * unit)
    chosen = np.sort(rng.choice(known, min(N_TRUE, len(known)), replace=False))
    corners, weights = first.faces[foot.simplices[chosen]], foot.weights[chosen]
    points = np.einsum("pc,pcd->pd", weights, second.vertices[corners])
    mirrored = mirrored_distances = None
    if rest is not None:
        images = np.einsum("pc,pcd->pd", weights, rest.vertices[corners]) * [-1, 1, 1]
        image = es.geometry.closest_points(rest, images)
        mirrored = np.einsum(
            "pc,pcd->pd", image.weights, second.vertices[rest.faces[image.simplices]]
        )
        mirrored_distances = distances_from(whole, mirrored)
    distances = distances_from(whole, points)
    # The part is turned, so that nothing is learned from how it lies in space.
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    part = es.TriangleMesh(part.vertices @ turn.T, part.faces)
    return Pair(name, part, whole, chosen, points, distances, mirrored, mirrored_distances)


def distances_from(whole: es.TriangleMesh, points: np.ndarray) -> np.ndarray:
    """Return geodesic distances of all vertices from those nearest to some points."""
    foot = es.geometry.closest_points(whole, points)
    nearest = whole.faces[foot.simplices, foot.weights.argmax(axis=1)]
    return es.geometry.geodesic_distances(whole, nearest).astype(np.float32)


def draw_pairs(half: dict[str, list[str]], kind: str, count: int, *, first_seed: int) -> list:
    """Draw names of poses for pairs: (animal, (pose, pose), kind, seed)."""
    found = []
    for number in range(count):
        seed = first_seed + number
        rng = np.random.default_rng([seed, [*SETS, *FURTHER_SETS].index(kind)])
        animal = sorted(half)[number % len(half)]
        poses = half[animal]
        one, two = (
            rng.choice(len(poses), 2, replace=False) if half is not RIGID else [number // 3 % 3] * 2
        )
        found.append((animal, (poses[one], poses[two]), kind, seed))
    return found


def errors(pair: Pair, image: np.ndarray, *, mirrored: bool = False) -> np.ndarray:
    """Return geodesic errors of the images of `pair.vertices`, in hundredths of √area.

    Near the truth the distance in space is measured, because vertices of the whole are apart. If
    `mirrored`, the mirror images of the true places are the truth.
    """
    points, distances = (
        (pair.mirrored, pair.mirrored_distances) if mirrored else (pair.points, pair.distances)
    )
    unit = np.sqrt(es.geometry.surface_area(pair.whole))
    foot = es.geometry.closest_points(pair.whole, image[pair.vertices])
    nearest = pair.whole.faces[foot.simplices, foot.weights.argmax(axis=1)]
    along = distances[np.arange(len(nearest)), nearest] / unit
    across = np.linalg.norm(image[pair.vertices] - points, axis=1) / unit
    return 100 * np.where(along < 0.05, across, np.maximum(along, across))
