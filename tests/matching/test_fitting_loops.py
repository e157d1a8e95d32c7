"""Kernels of bending beside plain NumPy."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from eigenshape.matching.fitting_loops import bend_frames, carry_vertices
from eigenshape.matching.nearest import RowTree

M, S, E, N_ROWS = 5, 30, 40, 200  # frames, samples, edges, vertices of the whole
NORMAL_LENGTH, ALONG, SOFT = 0.08, 0.5, 0.03


def unit_rows(rows):
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


@pytest.fixture
def scene():
    """A part of 30 vertices, all samples, five of which are frames, and a whole near by."""
    rng = np.random.default_rng(0)
    vertices = rng.standard_normal((S, 3))
    frames = rng.permutation(S)[:M]
    carriers = np.array([rng.permutation(M)[:4] for _ in range(S)])
    portions = rng.random((S, 4))
    portions /= portions.sum(axis=1, keepdims=True)
    part = vertices, unit_rows(rng.standard_normal((S, 3))), frames, carriers, portions
    pull = rng.random(S)
    arms = vertices[:, None] - vertices[frames][carriers]
    one = np.repeat(np.arange(M), E // M // 2)
    two = (one + rng.integers(1, M, len(one))) % M
    one, two = np.concatenate([one, two]), np.concatenate([two, one])
    weights = np.zeros((M, M))
    np.add.at(weights, (one, two), 2 / E)
    links = vertices[frames][two] - vertices[frames][one]
    edges = one, two, links, np.diag(weights.sum(axis=1)) - weights
    near = rng.integers(0, S, N_ROWS)
    ends = vertices[near] + 0.05 * rng.standard_normal((N_ROWS, 3))
    normals = unit_rows(part[1][near] + 0.2 * rng.standard_normal((N_ROWS, 3)))
    whole = ends, normals, rng.random(N_ROWS) < 0.8
    return part, (np.arange(S), pull / pull.sum(), arms), edges, whole


def bend(scene, stiffnesses, targets, turns=None):
    """Return turns and places of the frames."""
    part, samples, edges, whole = scene
    tree = RowTree(np.hstack([whole[0], NORMAL_LENGTH * whole[1]]))
    turns = np.repeat(np.eye(3)[None], M, axis=0) if turns is None else turns
    places = part[0][part[2]]
    numbers = NORMAL_LENGTH, np.array(stiffnesses), ALONG
    bend_frames(part, samples, edges, whole, tree, *numbers, targets.copy(), turns, places)
    return turns, places


def follow(places, edges, turns):
    """Return frames after small turns towards their edges (Müller and others 2016), in sizes that fit."""
    one, two, links, _ = edges
    found = np.empty((M, 3, 3))
    for frame in range(M):
        mine = one == frame
        product = (places[two[mine]] - places[frame]).T @ links[mine]
        turn = turns[frame] / np.linalg.norm(turns[frame][:, 0])
        for _ in range(30):
            inner = (turn * product).sum()
            reach = abs(inner) + 1e-9 * np.linalg.norm(product)
            step = np.cross(turn.T, product.T).sum(axis=0) / reach
            if np.linalg.norm(step) < 1e-4:
                break
            turn = Rotation.from_rotvec(step).as_matrix() @ turn
        found[frame] = np.clip(inner / (links[mine] ** 2).sum(), 0.8, 1.25) * turn
    return found


def plain_bend(scene, stiffnesses, targets):
    """Bend in NumPy."""
    part, (_, first_pull, arms), edges, (ends, end_normals, inner) = scene
    vertices, normals, frames, carriers, portions = part
    one, two, links, graph = edges
    turns, places, pull = np.repeat(np.eye(3)[None], M, axis=0), vertices[frames], first_pull
    tree = cKDTree(np.hstack([ends, NORMAL_LENGTH * end_normals]))
    shares = np.zeros((S, M))
    np.put_along_axis(shares, carriers, portions, axis=1)
    for step, stiffness in enumerate(stiffnesses):
        if step >= 2:
            carried = places[carriers] + np.einsum("scij,scj->sci", turns[carriers], arms)
            points = np.einsum("sc,sci->si", portions, carried)
            turned = unit_rows(np.einsum("sc,scij,sj->si", portions, turns[carriers], normals))
            nearest = tree.query(np.hstack([points, NORMAL_LENGTH * turned]))[1]
            planes, steps = end_normals[nearest], ends[nearest] - points
            flat = (steps * planes).sum(axis=1, keepdims=True) * planes
            targets = points + flat + ALONG * (steps - flat)
            facing = np.clip((turned * planes).sum(axis=1), 0, 1)
            softness = 1 + (steps**2).sum(axis=1) / SOFT**2
            pull = first_pull * inner[nearest] * facing / softness
        matrix = shares.T @ (pull[:, None] * shares) + stiffness * graph + 1e-9 / M * np.eye(M)
        for _ in range(12 if step == 0 else 2):
            turned = np.einsum("scij,scj->sci", turns[carriers], arms)
            rest = targets - np.einsum("sc,sci->si", portions, turned)
            forces = shares.T @ (pull[:, None] * rest)
            between = 0.5 * (turns[one] + turns[two])
            np.add.at(forces, one, -stiffness * 2 / E * np.einsum("eij,ej->ei", between, links))
            places = np.linalg.solve(matrix, forces)
            turns = follow(places, edges, turns)
    return turns, places


@pytest.mark.parametrize("n_steps", [1, 2, 4])
def test_a_bend_is_that_of_plain_numpy(scene, n_steps):
    targets = scene[0][0] + 0.1 * np.random.default_rng(1).standard_normal((S, 3))
    stiffnesses = (1.0, 0.5, 0.3, 0.2)[:n_steps]
    found, wanted = bend(scene, stiffnesses, targets), plain_bend(scene, stiffnesses, targets)
    assert np.allclose(found[0], wanted[0], atol=1e-9)
    assert np.allclose(found[1], wanted[1], atol=1e-9)


def test_frames_follow_a_rigid_turn(scene):
    turn = Rotation.from_rotvec([0.3, -0.5, 0.2]).as_matrix()
    turns = np.repeat(Rotation.from_rotvec([0.3, -0.3, 0.2]).as_matrix()[None], M, axis=0)
    for _ in range(20):
        turns, places = bend(scene, (0.1,), scene[0][0] @ turn.T + 0.3, turns)
    # A round ends with the first turn that is smaller than 1e-4, where up to fifty such ones remain.
    assert np.allclose(turns, turn, atol=5e-3)
    assert np.allclose(places, scene[0][0][scene[0][2]] @ turn.T + 0.3, atol=5e-3)


def test_sizes_stay_between_their_limits(scene):
    sizes = []
    for factor in (0.01, 100):
        turns, _ = bend(scene, (1e-3,), factor * scene[0][0])
        sizes.append(np.linalg.norm(turns, axis=(1, 2)) / np.sqrt(3))
    assert np.isclose(np.min(sizes), 0.8)
    assert np.isclose(np.max(sizes), 1.25)


def test_a_frame_without_edges_keeps_its_turn(scene):
    part, samples, (one, two, links, graph), whole = scene
    kept = (one > 0) & (two > 0)
    alone = part, samples, (one[kept], two[kept], links[kept], graph), whole
    turns = 1.1 * np.repeat(np.eye(3)[None], M, axis=0)
    found, _ = bend(alone, (1.0,), part[0] @ np.diag([1, -1, -1]), turns)
    assert np.allclose(found[0], np.eye(3))
    assert not np.allclose(found[1], np.eye(3))


def test_frames_carry_vertices_by_their_portions(scene):
    part = vertices, normals, frames, carriers, portions = scene[0]
    rng = np.random.default_rng(4)
    turns, places = rng.standard_normal((M, 3, 3)), rng.random((M, 3))
    chosen = np.array([7, 2, 29])
    points, turned = np.empty((2, 3, 3))
    carry_vertices(turns, places, part, chosen, points, turned)
    for place, v in enumerate(chosen):
        wanted, normal = np.zeros((2, 3))
        for frame, share in zip(carriers[v], portions[v], strict=True):
            arm = vertices[v] - vertices[frames[frame]]
            wanted += share * (places[frame] + turns[frame] @ arm)
            normal += share * turns[frame] @ normals[v]
        assert np.allclose(points[place], wanted)
        assert np.allclose(turned[place], normal / np.linalg.norm(normal))
