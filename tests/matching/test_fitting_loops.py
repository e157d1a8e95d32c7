"""Kernels of bending beside plain NumPy."""

import numpy as np

from eigenshape.matching.fitting_loops import add_pulls, add_tensions, turn_frames

M, E = 5, 40


def frames():
    """Edges between frames, places after a bend, and turns before it."""
    rng = np.random.default_rng(0)
    one = np.repeat(np.arange(M), E // M)
    two = (one + rng.integers(1, M, len(one))) % M
    arms = rng.standard_normal((len(one), 3))
    return rng, one, two, arms


def nearest_rotation(product):
    left, values, right = np.linalg.svd(product)
    side = np.sign(np.linalg.det(left @ right))
    left[:, 2] *= side
    return left @ right, values[0] + values[1] + side * values[2]


def test_frames_turn_to_the_nearest_rotation_and_take_the_size_that_fits():
    rng, one, two, arms = frames()
    places = rng.standard_normal((M, 3))
    turns = np.repeat(np.eye(3)[None], M, axis=0)
    for _ in range(10):  # a round ends when a turn is small, and the next one starts there
        turn_frames(places, one, two, arms, 0.01, 100.0, turns)
    for frame in range(M):
        mine = one == frame
        moved = places[two[mine]] - places[frame]
        turn, inner = nearest_rotation(moved.T @ arms[mine])
        size = max(inner / (arms[mine] ** 2).sum(), 0.01)
        assert np.allclose(turns[frame], size * turn, atol=1e-3 * size)


def test_sizes_stay_between_their_limits():
    rng, one, two, arms = frames()
    turns = np.repeat(np.eye(3)[None], M, axis=0)
    turn_frames(100 * rng.standard_normal((M, 3)), one, two, arms, 0.8, 1.25, turns)
    assert np.allclose(np.linalg.norm(turns, axis=(1, 2)), 1.25 * np.sqrt(3))


def test_a_frame_without_edges_keeps_its_turn():
    turns = 1.1 * np.eye(3)[None]
    none = np.empty(0, dtype=np.int64)
    turn_frames(np.zeros((1, 3)), none, none, np.empty((0, 3)), 0.8, 1.25, turns)
    assert np.allclose(turns, np.eye(3))


def test_pulls_and_tensions_are_those_of_sums():
    rng, one, two, arms = frames()
    turns = rng.standard_normal((M, 3, 3))
    carriers, portions = rng.integers(0, M, (30, 4)), rng.random((30, 4))
    offsets, targets = rng.standard_normal((30, 4, 3)), rng.standard_normal((30, 3))
    pull = rng.random(30)
    found = np.zeros((M, 3))
    add_pulls(turns, carriers, portions, offsets, pull, targets, found)
    add_tensions(turns, one, two, arms, 0.7, found)
    turned = np.einsum("scij,scj->sci", turns[carriers], offsets)
    rest = targets - np.einsum("sc,sci->si", portions, turned)
    wanted = np.zeros((M, 3))
    np.add.at(wanted, carriers, (pull[:, None] * portions)[:, :, None] * rest[:, None])
    between = 0.5 * (turns[one] + turns[two])
    np.add.at(wanted, one, -0.7 * np.einsum("eij,ej->ei", between, arms))
    assert np.allclose(found, wanted)
