"""Pairs with known maps of six kinds, and strangers, in two halves that share no individual."""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import product
from pathlib import Path

import numpy as np

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1] / "ch7_matching"))
from pairs import Pair, pair_of, read_shape, stretched
from rows import read

N_VERTICES = 1000
HALVES = ("choosing", "reporting")
KINDS = ("animals", "long bones", "irregular", "flat", "machine parts", "coarse", "strangers")
COARSE = 300, 800  # vertices of coarse meshes, least and most
PLATE = 0.06  # half the thickness of a plate, beside a radius of about 1


@dataclass(frozen=True)
class Drawn:
    """A pair by its kind and half, made when it is needed; strangers belong nowhere: all places are wrong."""

    kind: str
    half: str
    name: str
    make: Callable[[], Pair]
    belongs: bool = True

    @cached_property
    def pair(self) -> Pair:
        """The part and the whole."""
        return self.make()


def rock(seed: int) -> es.TriangleMesh:
    """Return an irregular solid: a ball with random bumps of three sizes, flattened."""
    rng = np.random.default_rng([seed, 1])
    ball = es.icosphere(4)
    height = np.ones(ball.n_vertices)
    for n_waves, size in ((3, 0.25), (6, 0.12), (12, 0.05)):
        for _ in range(4):
            direction = rng.standard_normal(3)
            phase = rng.uniform(0, 2 * np.pi)
            waves = n_waves * ball.vertices @ (direction / np.linalg.norm(direction))
            height += size / 4 * np.sin(waves + phase)
    axes = rng.uniform(0.5, 1.2, 3)
    return es.TriangleMesh(ball.vertices * height[:, None] * axes, ball.faces)


def plate(seed: int) -> es.TriangleMesh:
    """Return a plate with an irregular outline and holes: two sheets, joined along all edges."""
    from scipy.spatial import Delaunay  # noqa: PLC0415

    rng = np.random.default_rng([seed, 2])
    step = 0.05
    rows, columns = np.mgrid[-40:41, -40:41]
    points = step * np.column_stack([(columns + rows / 2).ravel(), (rows * np.sqrt(0.75)).ravel()])
    angle, radius = np.arctan2(points[:, 1], points[:, 0]), np.linalg.norm(points, axis=1)
    outline = 1 + sum(
        rng.uniform(0.05, 0.25) / k * np.cos(k * angle + rng.uniform(0, 2 * np.pi))
        for k in (1, 2, 3, 5)
    )
    inside = radius < outline
    for _ in range(int(rng.integers(2, 6))):
        middle = rng.uniform(-0.6, 0.6, 2)
        inside &= np.linalg.norm(points - middle, axis=1) > rng.uniform(0.12, 0.25)
    points = points[inside]
    faces = Delaunay(points).simplices
    corners = points[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    faces = faces[longest < 1.3 * step]
    turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) < 0
    turned = turned[longest < 1.3 * step]
    faces[turned] = faces[turned, ::-1]
    # walls between the sheets along edges of one face only
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    keys = np.sort(edges, axis=1)
    _, number, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    rims = edges[count[number.ravel()] == 1]
    n = len(points)
    a, b = rims.T
    walls = np.concatenate([np.column_stack([b, a, a + n]), np.column_stack([b, a + n, b + n])])
    heights = np.repeat([PLATE, -PLATE], n)
    vertices = np.column_stack([np.concatenate([points, points]), heights])
    mesh = es.TriangleMesh(vertices, np.concatenate([faces, faces[:, ::-1] + n, walls]))
    return es.repair(mesh, ["auto", "largest_component"]).mesh


def shapes() -> Iterator[tuple[str, str, str, tuple[es.TriangleMesh, es.TriangleMesh]]]:
    """Yield kind, half, name, and two shapes with the same faces: two poses, or twice the same."""
    creatures = {
        "choosing": ("quadruped", "biped", "lizard"),
        "reporting": ("giraffe", "hand", "bird"),
    }
    poses = {
        "choosing": (("sumner_cat-02", "sumner_cat-06"), ("sumner_horse-03", "sumner_horse-08")),
        "reporting": (("sumner_lion-03", "sumner_lion-07"), ("sumner_lion-02", "sumner_lion-08")),
    }
    bones = {
        "choosing": ("arm_r_2mc", "arm_r_2proxph", "humerus", "arm_r_2midph"),
        "reporting": ("arm_r_3mc", "arm_r_3proxph", "arm_r_humerus", "arm_r_3midph"),
    }
    machines = {
        "choosing": ("retrieval/bearing/psb344.ply", "retrieval/mech/psb324.ply"),
        "reporting": ("retrieval/bearing/psb346.ply", "retrieval/mech/psb326.ply"),
    }
    coarse = {
        "choosing": (
            "teddy/psb162",
            "hand/psb182",
            "bird/psb242",
            "armadillo/psb282",
            "vase/psb362",
        ),
        "reporting": (
            "teddy/psb164",
            "hand/psb184",
            "plier/psb204",
            "armadillo/psb284",
            "cup/psb24",
        ),
    }
    more_machines = {
        ("choosing", "bearing"): 348,
        ("choosing", "mech"): 328,
        ("reporting", "bearing"): 350,
        ("reporting", "mech"): 330,
    }
    for number, half in enumerate(HALVES):
        for kind in creatures[half]:
            both = tuple(
                es.make_creature(kind, pose, individual=1 + number, n_vertices=N_VERTICES)
                for pose in (1, 2)
            )
            yield "animals", half, kind, both
        for one, other in poses[half]:
            yield "animals", half, one, (read_shape(one), read_shape(other))
        for name in bones[half]:
            yield "long bones", half, name, (read(f"bones/{name}.vtp"),) * 2
        yield "irregular", half, "flake", (read(f"flakes/flake{'_b' * number}.ply"),) * 2
        for seed in (0, 1, 2):
            yield "irregular", half, f"rock {seed}", (rock(10 * number + seed),) * 2
        for seed in (0, 1, 2, 3):
            yield "flat", half, f"plate {seed}", (plate(10 * number + seed),) * 2
        for name in machines[half]:
            yield "machine parts", half, name, (read(name),) * 2
        for name in coarse[half]:
            yield "coarse", half, name, (read(f"retrieval/{name}.ply"),) * 2
    # Many machine parts can be turned into themselves, so that what few pairs say is chance.
    for half, name in product(HALVES, ("bearing", "mech")):
        number = more_machines[half, name]
        yield (
            "machine parts",
            half,
            f"{name} {number}",
            (read(f"retrieval/{name}/psb{number}.ply"),) * 2,
        )


def draw(*, quick: bool) -> Iterator[Drawn]:
    """Yield pairs: of each shape a whole, a cut, and a stretched whole or scan; and strangers."""
    strangers: dict[str, list[Drawn]] = {half: [] for half in HALVES}
    for number, (kind, half, name, shapes_of_name) in enumerate(shapes()):
        ways = [("wholes", False), ("cuts", False), ("wholes", True), ("scans", False)]
        # Poses stretch animals already; of the others, a third is bent and stretched.
        chosen = (
            [ways[0], ways[1 + number % 3]]
            if kind != "animals"
            else [ways[1], ways[(0, 3)[number % 2]]]
        )
        if kind == "long bones":
            chosen = [ways[0], ways[1], ways[2]]
        if quick:
            chosen = chosen[:1] if number % 13 == 0 else []
        for way, stretch in chosen:
            title = f"{name} {way}{' stretched' * stretch}"
            make = partial(make_known, title, kind, shapes_of_name, way, number, stretch=stretch)
            drawn = Drawn(kind, half, title, make)
            yield drawn
            if way == "cuts" or kind == "coarse":
                strangers[half].append(drawn)
    for half, pairs in strangers.items():
        for number in range(0, len(pairs), 2):
            ours, theirs = pairs[number], pairs[(number + len(pairs) // 2) % len(pairs)]
            title = f"{ours.name} on {theirs.name}"
            make = partial(make_strangers, title, ours, theirs)
            yield Drawn("strangers", half, title, make, belongs=False)


def make_known(
    title: str,
    kind: str,
    shapes_of_name: tuple[es.TriangleMesh, es.TriangleMesh],
    way: str,
    number: int,
    *,
    stretch: bool,
) -> Pair:
    """Return a part of the first of two shapes, and the second one, of a number of vertices that the kind has."""
    one, other = shapes_of_name
    rng = np.random.default_rng([number, len(way), stretch])
    sizes = (N_VERTICES, N_VERTICES)
    if kind == "coarse":
        sizes = tuple(int(n) for n in rng.integers(*COARSE, 2))
    first = stretched(one, rng) if stretch else one
    return pair_of(title, (first, other), way, rng, sizes=sizes)


def make_strangers(title: str, one: Drawn, other: Drawn) -> Pair:
    """Return the part of one pair in the size of another one, and the whole of that."""
    ours, theirs = one.pair, other.pair
    areas = [es.geometry.surface_area(pair.whole) for pair in (ours, theirs)]
    size = np.sqrt(areas[1] / areas[0])
    part = es.TriangleMesh(size * ours.part.vertices, ours.part.faces)
    return Pair(title, part, theirs.whole, ours.vertices, ours.points, ours.distances)
