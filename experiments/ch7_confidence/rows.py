"""Single pairs with a known answer, on which maps or confidences were once wrong."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of
from real_shapes import DATA, require_data

N_STEPS = 30  # of point to point, from where two bones of one frame lie
FOOT_SHARE = 0.07  # of the area of a creature


def read(name: str) -> es.TriangleMesh:
    """Read a shape by its place in the data, repaired."""
    mesh = es.repair(es.read_mesh(DATA / name), ["auto"]).mesh
    return es.repair(mesh, ["largest_component"]).mesh


def gaps(match: es.matching.ShapeMatch, whole: es.TriangleMesh, truth: np.ndarray) -> np.ndarray:
    """Return how far points lie from the truth in space, in hundredths of √area of the whole."""
    away = np.linalg.norm(match.pull(whole.vertices) - truth, axis=1)
    return 100 * away / np.sqrt(es.geometry.surface_area(whole))


def kabsch(starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the turn R that brings rows of starts nearest to ends."""
    products = (ends - ends.mean(axis=0)).T @ (starts - starts.mean(axis=0))
    u, _, v = np.linalg.svd(products)
    return u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v


def best_turn(part: es.TriangleMesh, whole: es.TriangleMesh) -> np.ndarray:
    """Return the turn of a part onto a whole, by nearest points from where both lie."""
    size = np.sqrt(es.geometry.surface_area(whole) / es.geometry.surface_area(part))
    ours, middle = size * (part.vertices - part.vertices.mean(axis=0)), whole.vertices.mean(axis=0)
    turn, shift = np.eye(3), middle
    for _ in range(N_STEPS):
        moved = ours @ turn.T + shift
        ends = es.geometry.closest_points(whole, moved).points
        turn = kabsch(ours, ends)
        shift = ends.mean(axis=0) - turn @ ours.mean(axis=0)
    return turn


def rolls(part: es.TriangleMesh, image: np.ndarray, turn: np.ndarray) -> list[float]:
    """Return by how many degrees the thirds of a long part are rolled about its axis, beside a turn."""
    axis = np.linalg.svd(part.vertices - part.vertices.mean(axis=0), full_matrices=False)[2][0]
    heights = part.vertices @ axis
    thirds = np.digitize(heights, np.linspace(heights.min(), heights.max(), 4)[1:3])
    found = []
    for third in range(3):
        inside = thirds == third
        rest = turn.T @ kabsch(part.vertices[inside], image[inside])
        found.append(float(np.degrees(Rotation.from_matrix(rest).as_rotvec() @ axis)))
    return found


def said(match: es.matching.ShapeMatch) -> dict[str, object]:
    """Return what a match says of itself."""
    return {
        "said": float(match.confidence.mean()),
        "places": match.n_equally_good,
        "scale": match.scale,
        "mirrored": match.mirrored,
        "report": list(match.report),
    }


def right(match: es.matching.ShapeMatch, whole: es.TriangleMesh, truth: np.ndarray) -> dict:
    """Return the share of points within 5 hundredths of the truth, and what the match says."""
    found = gaps(match, whole, truth)
    return {"mean error": float(found.mean()), "right": float((found < 5).mean()), **said(match)}


def bones(part: str, whole: str) -> dict[str, object]:
    """Map a bone of the right hand on another, both in one frame: how far its thirds are rolled."""
    one, other = (read(f"bones/arm_r_{name}.vtp") for name in (part, whole))
    match = es.match_shapes(one, other)
    turns = rolls(one, match.pull(other.vertices), best_turn(one, other))
    return {"rolls": turns, **said(match)}


def fragment(suffix: str) -> dict[str, object]:
    """Map a fragment of a stone flake on the whole, by whose known turn it is right or not."""
    part, whole = (
        es.read_mesh(DATA / f"flakes/{name}{suffix}.ply") for name in ("fragment", "flake")
    )
    turn = np.loadtxt(DATA / f"flakes/turn{suffix}.txt")
    truth = part.vertices @ (turn if suffix else turn.T)
    return right(es.match_shapes(part, whole), whole, truth)


def coarser(name: str, n_faces: int) -> dict[str, object]:
    """Map a shape with fewer faces on itself."""
    whole = read(name)
    part = es.geometry.decimate(whole, n_faces).mesh
    turn = Rotation.from_rotvec([0.4, 1.0, 2.0]).as_matrix()
    moved = es.TriangleMesh(part.vertices @ turn.T, part.faces)
    return right(es.match_shapes(moved, whole), whole, part.vertices)


def humeri() -> dict[str, object]:
    """Map a human humerus of 309 vertices on another one of 339."""
    one, other = read("bones/arm_r_humerus.vtp"), read("bones/humerus.vtp")
    match = es.match_shapes(one, other)
    image = match.pull(other.vertices)
    turn = kabsch(one.vertices, image)
    return {"rolls": rolls(one, image, turn), **said(match)}


def broken(scale: str) -> dict[str, object]:
    """Map the upper 70 % of a humerus, whose cut is a small hole, on the whole bone."""
    whole = read("bones/humerus.vtp")
    axis = np.linalg.svd(whole.vertices - whole.vertices.mean(axis=0))[2][0]
    fine = es.geometry.subdivide(whole)
    height = fine.vertices @ axis
    low = height.min() + 0.3 * np.ptp(height)
    part = es.scans.cut_by_planes(fine, [[*axis, low]]).mesh
    match = es.match_shapes(part, whole, scale=scale)
    return right(match, whole, part.vertices)


def foot(pose: int, other: int, limb: int, individual: int) -> dict[str, object]:
    """Map a foot of one creature on another one: on which foot its points lie."""
    one = es.make_creature("quadruped", pose, n_vertices=3000)
    whole = es.make_creature("quadruped", other, n_vertices=3000, individual=individual)
    rest = es.make_creature("quadruped", 0, n_vertices=3000)
    low = rest.vertices[:, 1] < rest.vertices[:, 1].min() + 0.05
    middle = np.median(rest.vertices[low, 2])

    def beside(points: np.ndarray) -> np.ndarray:
        return ((points[:, 0] > 0) == (limb % 2 == 0)) & ((points[:, 2] > middle) == (limb < 2))

    inside = low & beside(rest.vertices)
    tip = int(np.flatnonzero(inside)[np.argmin(rest.vertices[inside, 1])])
    away = es.geometry.geodesic_distances(one, [tip])[0]
    areas = es.geometry.dual_volumes(one)
    order = np.argsort(away)
    within = order[np.cumsum(areas[order]) < FOOT_SHARE * areas.sum()]
    kept = np.isin(one.faces, within).all(axis=1)
    vertices, numbers = np.unique(one.faces[kept], return_inverse=True)
    part = es.TriangleMesh(one.vertices[vertices], numbers.reshape(-1, 3))
    match = es.match_shapes(part, whole, scale="known")
    if individual:  # another individual has other faces, so that only the leg is known
        return {"right": float(beside(match.pull(whole.vertices)).mean()), **said(match)}
    return right(match, whole, whole.vertices[vertices])


def hands(**options: object) -> dict[str, object]:
    """Map a left hand on a right one, vertex by vertex its mirror image."""
    left, other = (es.read_mesh(DATA / f"everyday/J_{side}_hand.ply") for side in ("left", "right"))
    return right(es.match_shapes(left, other, **options), other, other.vertices)


def rows() -> Iterator[tuple[str, Callable[[], dict[str, object]]]]:
    """Yield the name of each row and what measures it."""
    yield "metacarpal 3 on 2", lambda: bones("3mc", "2mc")
    yield "proximal phalanx 3 on 2", lambda: bones("3proxph", "2proxph")
    yield "middle phalanx 3 on 2", lambda: bones("3midph", "2midph")
    yield "flake", lambda: fragment("")
    yield "flake b", lambda: fragment("_b")
    yield "two humeri", humeri
    yield "coarser feature part", lambda: coarser("machine/featuretype.STL", 600)
    yield "coarser idler riser", lambda: coarser("machine/idler_riser.STL", 400)
    yield "coarser angle block", lambda: coarser("machine/angle_block.STL", 200)
    yield "broken humerus", lambda: broken("auto")
    yield "broken humerus, known", lambda: broken("known")
    for limb in range(4):
        yield f"foot {limb}", lambda limb=limb: foot(0, 1, limb, 0)
        yield f"foot {limb} of another", lambda limb=limb: foot(0, 0, limb, 1)
    yield "hands", hands


def main() -> None:
    """Measure all pairs, or with --quick the fragment of a flake."""
    arguments = options_of(__doc__, quick="one fragment", out="ch7-rows.json").parse_args()
    require_data()
    wanted = {name: measure for name, measure in rows() if name == "flake b" or not arguments.quick}
    give_out(rounded({name: measure() for name, measure in wanted.items()}), arguments.out)


if __name__ == "__main__":
    main()
