"""Pairs of parts that overlap or share nothing: two poses of a shape, each with triangles of its own."""

import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1] / "ch7_matching"))
from pairs import REPORTING, TUNING, distances_from, read_shape, remesh

OVERLAPS = (0.2, 0.4, 0.6, 0.8)  # of the area of each part
N_VERTICES = 4000  # of each shape before it is cut
# Cuts that break off more than this share of a part are drawn again.
MOST_LOST = 0.05
CREATURES = es.shapes.CREATURES
# Constants were tuned on every second kind of creature and on horses, cats and wolves; others report.
# An octopus is left out: its arms are alike, so that several maps are right.
KINDS = {
    "tuning": ("ant", "bird", "fish", "hand", "snake", *TUNING),
    "reporting": (*CREATURES[1::2], *REPORTING),
}


@dataclass(frozen=True)
class Shape:
    """A creature or an animal in two poses with the same faces, and a mesh of each with its own faces."""

    poses: tuple[es.TriangleMesh, es.TriangleMesh]
    meshes: tuple[es.TriangleMesh, es.TriangleMesh]

    @property
    def feet(self) -> list:
        """Nearest points of the poses to the vertices of the meshes."""
        return [
            es.geometry.closest_points(pose, mesh.vertices)
            for pose, mesh in zip(self.poses, self.meshes, strict=True)
        ]


@dataclass(frozen=True)
class Pair:
    """Two parts, the vertices of each that both have, and where vertices of the first belong.

    Rows of `distances` are geodesic distances on the second part, in roots of the area of the whole
    shape, from the true places of the shared vertices of the first.
    """

    one: es.TriangleMesh
    two: es.TriangleMesh
    shared: tuple[np.ndarray, np.ndarray]
    distances: np.ndarray


@lru_cache(maxsize=2)
def make_shape(kind: str, seed: int) -> Shape:
    """Return two poses of a creature or an animal."""
    rng = np.random.default_rng(seed)
    if kind in CREATURES:
        poses = [
            es.make_creature(kind, int(pose), n_vertices=N_VERTICES)
            for pose in rng.choice(20, 2, replace=False)
        ]
    else:
        names = (TUNING | REPORTING)[kind]
        poses = [read_shape(name) for name in rng.choice(names, 2, replace=False)]
    meshes = [remesh(pose, N_VERTICES, np.random.default_rng(k)) for k, pose in enumerate(poses)]
    return Shape(tuple(poses), tuple(meshes))


def make_pair(kind: str, overlap: float, seed: int) -> Pair:
    """Return what of a shape lies below one plane, and what lies above another, in another pose.

    Both parts have the same area, and together they are the whole shape. The first part is turned, so
    that nothing is learned from how it lies in space.
    """
    shape = make_shape(kind, seed)
    first, second = shape.poses
    feet = shape.feet
    rng = np.random.default_rng([seed, int(100 * overlap)])
    areas = es.geometry.dual_volumes(first)
    share = 1 / (2 - overlap)
    kept = (0.0, 0.0)
    while min(kept) < 1 - MOST_LOST:
        heights = first.vertices @ rng.standard_normal(3)
        order = np.argsort(heights)
        below = np.cumsum(areas[order]) / areas.sum()
        low, high = (heights[order[np.searchsorted(below, at)]] for at in (1 - share, share))
        levels = [
            (heights[first.faces[foot.simplices]] * foot.weights).sum(axis=1) for foot in feet
        ]
        inside = levels[0] < high, levels[1] > low
        sides = [cut_out(mesh, keep) for mesh, keep in zip(shape.meshes, inside, strict=True)]
        kept = [side[1] for side in sides]
    (one, _), (two, _) = sides
    ours, theirs = (
        es.geometry.closest_points(pose, part.vertices)
        for pose, part in zip(shape.poses, (one, two), strict=True)
    )
    corners = first.faces[ours.simplices]
    if overlap:
        in_one = (heights[corners] * ours.weights).sum(axis=1) > low
        in_two = (heights[first.faces[theirs.simplices]] * theirs.weights).sum(axis=1) < high
    else:
        in_one, in_two = np.zeros(one.n_vertices, bool), np.zeros(two.n_vertices, bool)
    points = np.einsum("pc,pcd->pd", ours.weights[in_one], second.vertices[corners[in_one]])
    unit = np.sqrt(es.geometry.surface_area(second))
    distances = distances_from(two, points) / unit if overlap else np.zeros((0, two.n_vertices))
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    return Pair(es.TriangleMesh(one.vertices @ turn.T, one.faces), two, (in_one, in_two), distances)


def make_strangers(kind: str, other: str, seed: int) -> Pair:
    """Return a part of one shape and a part of another one, of the same area."""
    one, two = make_pair(kind, OVERLAPS[1], seed).one, make_pair(other, OVERLAPS[1], seed).two
    factor = np.sqrt(es.geometry.surface_area(one) / es.geometry.surface_area(two))
    two = es.TriangleMesh(factor * two.vertices, two.faces)
    shared = np.zeros(one.n_vertices, bool), np.zeros(two.n_vertices, bool)
    return Pair(one, two, shared, np.zeros((0, two.n_vertices)))


def cut_out(mesh: es.TriangleMesh, kept: np.ndarray) -> tuple[es.TriangleMesh, float]:
    """Return the largest piece of what is kept, and its share of the area of that."""
    rest = es.TriangleMesh(mesh.vertices, mesh.faces[kept[mesh.faces].all(axis=1)])
    part = es.repair(rest, ["drop_unreferenced"]).mesh
    piece = es.repair(part, ["largest_component"]).mesh
    return piece, es.geometry.surface_area(piece) / es.geometry.surface_area(part)
