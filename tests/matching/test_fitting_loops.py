"""Kernels of bending beside plain NumPy."""

import numpy as np

from eigenshape.matching.fitting_loops import (
    add_forces,
    carry_vertices,
    fill_stiffness,
    turn_frames,
)

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
    add_forces(turns, carriers, portions, offsets, pull, targets, one, two, arms, 0.7, found)
    turned = np.einsum("scij,scj->sci", turns[carriers], offsets)
    rest = targets - np.einsum("sc,sci->si", portions, turned)
    wanted = np.zeros((M, 3))
    np.add.at(wanted, carriers, (pull[:, None] * portions)[:, :, None] * rest[:, None])
    between = 0.5 * (turns[one] + turns[two])
    np.add.at(wanted, one, -0.7 * np.einsum("eij,ej->ei", between, arms))
    assert np.allclose(found, wanted)


def test_the_matrix_of_a_bend_is_a_sum_over_samples_and_edges():
    rng = np.random.default_rng(3)
    carriers = np.array([rng.permutation(M)[:4] for _ in range(30)])
    portions, pull, graph = rng.random((30, 4)), rng.random(30), rng.random((M, M))
    graph += graph.T
    found = np.full((M, M), np.nan)
    fill_stiffness(carriers, portions, pull, graph, 0.3, 1e-3, found)
    shares = np.zeros((30, M))
    np.put_along_axis(shares, carriers, portions, axis=1)
    wanted = shares.T @ (pull[:, None] * shares) + 0.3 * graph + 1e-3 * np.eye(M)
    lower = np.tril_indices(M)
    assert np.allclose(found[lower], wanted[lower])
    assert np.isnan(found[np.triu_indices(M, 1)]).all()


def test_frames_carry_vertices_by_their_portions():
    rng = np.random.default_rng(4)
    vertices, normals = rng.standard_normal((2, 30, 3))
    frames, turns, places = (
        rng.permutation(30)[:M],
        rng.standard_normal((M, 3, 3)),
        rng.random((M, 3)),
    )
    carriers, portions = rng.integers(0, M, (30, 4)), rng.random((30, 4))
    chosen = np.array([7, 2, 29])
    points, turned = np.empty((2, 3, 3))
    part = vertices, normals, frames, carriers, portions
    carry_vertices(turns, places, part, chosen, points, turned)
    for place, v in enumerate(chosen):
        wanted, normal = np.zeros((2, 3))
        for frame, share in zip(carriers[v], portions[v], strict=True):
            arm = vertices[v] - vertices[frames[frame]]
            wanted += share * (places[frame] + turns[frame] @ arm)
            normal += share * turns[frame] @ normals[v]
        assert np.allclose(points[place], wanted)
        assert np.allclose(turned[place], normal / np.linalg.norm(normal))
