"""A sphere of area 1, and the same with a handle in each of twelve small regions, stretched a little besides."""

from itertools import pairwise

import numpy as np

import eigenshape as es

RADIUS = 0.5 / np.pi**0.5  # of the sphere of area 1
MU = (
    2 * np.pi**0.5
)  # its isoperimetric constant: no region has less boundary for its area than half of it
SPREAD = 0.5  # rad: how far around a region the mesh is drawn together
WAIST = 0.4  # of a handle
RINGS = 12  # along a handle


def make_pair(
    level: int, *, region: float, handle: float, stretch: float
) -> es.stability.Perturbation:
    """Return a sphere and its perturbation.

    `region` is the radius of the twelve regions, in length; `handle` the mesh's edge there over that elsewhere;
    `stretch` by how much the map outside stretches along x, and shrinks along z.
    """
    unit = es.icosphere(level)
    centers = es.icosphere(0).vertices
    sphere = es.TriangleMesh(RADIUS * draw_together(unit.vertices, centers, handle), unit.faces)
    corners = sphere.vertices[sphere.faces]
    labels = np.full(sphere.n_faces, -1)
    for number, center in enumerate(RADIUS * centers):
        labels[np.linalg.norm(corners - center, axis=2).max(axis=1) <= region] = number
    points, faces, others = [sphere.vertices], sphere.faces, labels
    for number, center in enumerate(RADIUS * centers):
        around = sorted(np.argsort(np.linalg.norm(sphere.vertices - center, axis=1))[:40].tolist())
        added, faces, others = add_handle(
            sphere, faces, others, number, feet(sphere, around), sum(map(len, points))
        )
        points.append(added)
    other = es.TriangleMesh(np.concatenate(points) * [1 + stretch, 1, 1 / (1 + stretch)], faces)
    return es.stability.measure_perturbation(sphere, other, regions_one=labels, regions_two=others)


def draw_together(points: np.ndarray, centers: np.ndarray, share: float) -> np.ndarray:
    """Move points of the unit sphere towards the centers near them: on the sphere, edges at a center shrink so much."""
    moved = points.copy()
    for center in centers:
        angle = np.arccos(np.clip(points @ center, -1, 1))
        near = (angle < SPREAD) & (angle > 0)
        s = angle[near] / SPREAD
        smaller = angle[near] * (share + (1 - share) * s**2 * (3 - 2 * s))
        along = points[near] - np.cos(angle[near])[:, None] * center
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        moved[near] = np.cos(smaller)[:, None] * center + np.sin(smaller)[:, None] * along
    return moved


def feet(mesh: es.TriangleMesh, around: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return two rims of six vertices each, ordered around their middle vertex, that touch nowhere: the nearest."""
    near = mesh.faces[np.isin(mesh.faces, around).any(axis=1)]
    rims = {vertex: rim(near, vertex) for vertex in around}
    stars = {vertex: {vertex, *found.tolist()} for vertex, found in rims.items() if len(found) == 6}
    apart = {
        (one, two): np.linalg.norm(mesh.vertices[one] - mesh.vertices[two])
        for one in stars
        for two in stars
        if one < two and not stars[one] & stars[two]
    }
    one, two = min(apart, key=lambda pair: (apart[pair].round(12), pair))
    return np.append(rims[one], one), np.append(rims[two], two)


def rim(faces: np.ndarray, vertex: int) -> np.ndarray:
    """Return the vertices around one, in order."""
    following = {}
    for face in faces[(faces == vertex).any(axis=1)].tolist():
        place = face.index(vertex)
        following[face[(place + 1) % 3]] = face[(place + 2) % 3]
    found = [min(following)]
    while len(found) < len(following):
        found.append(following[found[-1]])
    return np.array(found)


def add_handle(
    mesh: es.TriangleMesh,
    faces: np.ndarray,
    labels: np.ndarray,
    number: int,
    ends: tuple[np.ndarray, np.ndarray],
    first: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut out the faces at two vertices, and lead a tube from one hole to the other."""
    (*one, middle_one), (*two, middle_two) = ends[0].tolist(), ends[1].tolist()
    kept = ~np.isin(faces, [middle_one, middle_two]).any(axis=1)
    between, above = frame(mesh.vertices[middle_one], mesh.vertices[middle_two])
    across = np.cross(above, between)
    here = (mesh.vertices[one] - mesh.vertices[middle_one]) @ np.array([between, across, above]).T
    # Going over the arch turns what points forward back: seen from above, the second rim is met in a mirror.
    mirrored = (mesh.vertices[two] - mesh.vertices[middle_two]) @ np.array(
        [-between, across, -above]
    ).T
    turns = [np.roll(np.arange(6)[::-1], turn) for turn in range(6)]
    turn = min(turns, key=lambda order: np.linalg.norm(here - mirrored[order]))
    there, two = mirrored[turn], np.array(two)[turn]
    base = (mesh.vertices[middle_one] + mesh.vertices[middle_two]) / 2
    half = np.linalg.norm(mesh.vertices[middle_two] - mesh.vertices[middle_one]) / 2
    rings = []
    for s in np.arange(1, RINGS) / RINGS:
        forward, up = -np.cos(np.pi * s) * between, np.sin(np.pi * s) * above
        axes = np.array([np.cos(np.pi * s) * between - np.sin(np.pi * s) * above, across,
                         np.sin(np.pi * s) * between + np.cos(np.pi * s) * above])  # fmt: skip
        width = WAIST + (1 - WAIST) * (1 - 2 * s) ** 4
        rings.append(base + half * (forward + up) + width * ((1 - s) * here + s * there) @ axes)
    numbers = [np.array(one), *(first + 6 * k + np.arange(6) for k in range(RINGS - 1)), two]
    tube = [strip(a, b) for a, b in pairwise(numbers)]
    added = np.concatenate(tube)
    return (
        np.concatenate(rings),
        np.concatenate([faces[kept], added]),
        np.append(labels[kept], [number] * len(added)),
    )


def frame(one: np.ndarray, two: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the direction between two points of a sphere around the origin, and the one up from their middle."""
    between = (two - one) / np.linalg.norm(two - one)
    return between, (one + two) / np.linalg.norm(one + two)


def strip(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Return the triangles between two rings, which look outward as the faces around the first do."""
    following, beside = np.roll(one, -1), np.roll(two, -1)
    return np.concatenate(
        [np.column_stack([one, following, two]), np.column_stack([following, beside, two])]
    )
