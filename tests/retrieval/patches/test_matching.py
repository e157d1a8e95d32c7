"""Points of patches that belong together: on the same shape, on a moved or renumbered one, on its parts."""

from dataclasses import replace

import numpy as np
import pytest

import eigenshape as es
from eigenshape.retrieval.patches import matching as patch_matching
from eigenshape.retrieval.patches.matching import (
    LENGTHS,
    N_LANDMARKS,
    distances_by_landmarks,
    nearest_lengths,
    nearest_of_each_other,
    pack_points,
    patch_points,
    unpack_points,
)
from eigenshape.retrieval.patches.matching_loops import leading
from eigenshape.retrieval.patches.patches import surface_patches

HAND = es.make_creature("hand", 1, n_vertices=1500)


def moved(mesh, x):
    return es.TriangleMesh(mesh.vertices + np.array([x, 0.0, 0.0]), mesh.faces)


BALL = es.icosphere(2)
BOX = es.TriangleMesh(
    np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float),
    np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])[
        :, [[0, 1, 2], [0, 2, 3]]
    ].reshape(-1, 3),
)
SYMMETRIC = {
    "torus": lambda: es.shapes.torus(60, 40),
    "sphere": lambda: es.icosphere(3),
    "icosahedron": lambda: es.icosphere(0),
    "box": lambda: BOX,
    "two spheres": lambda: es.geometry.disjoint_union(BALL, moved(BALL, 3)),
    "twelve boxes": lambda: es.geometry.disjoint_union(
        *(moved(BOX, 2 * number) for number in range(12))
    ),
}
KINDS = ("quadruped", "hand", "octopus", "biped")


@pytest.fixture(scope="module")
def book():
    return es.retrieval.train_codebook(
        [surface_patches(es.make_creature(kind, 3, n_vertices=1200)) for kind in KINDS]
    )


@pytest.fixture(scope="module")
def hand(book):
    return patch_points(surface_patches(HAND), book)


def test_a_shape_matches_itself_point_by_point(hand):
    match = es.retrieval.match_patches(hand, hand)
    assert match.step == 0
    assert len(match.points) > 100
    assert np.array_equal(match.points[:, 0], match.points[:, 1])
    assert np.array_equal(match.vertices, hand.vertices[match.points])
    assert 0.95 < match.agreement <= 1


def test_rigid_motion_and_size_change_no_match(hand, book):
    turn = np.diag([-1.0, -1.0, 1.0])  # keeps the box, whose sides are the unit
    moved = es.TriangleMesh(1e-50 * (HAND.vertices @ turn + [3, 0, 1]), HAND.faces)
    match = es.retrieval.match_patches(hand, patch_points(surface_patches(moved), book))
    assert len(match.points) > 100
    assert np.array_equal(match.vertices[:, 0], match.vertices[:, 1])
    assert match.agreement > 0.95


def test_points_in_another_order_match_the_same(hand):
    order = np.random.default_rng(1).permutation(len(hand.vertices))
    mixed = replace(
        hand,
        numbers=hand.numbers[order],
        weights=hand.weights[order],
        vertices=hand.vertices[order],
        distances=hand.distances[np.ix_(order, order)],
    )
    match = es.retrieval.match_patches(hand, mixed)
    assert np.array_equal(match.points[:, 0], order[match.points[:, 1]])
    assert match.agreement == pytest.approx(es.retrieval.match_patches(hand, hand).agreement)


def test_other_vertex_numbers_change_little(hand, book):
    order = np.random.default_rng(1).permutation(HAND.n_vertices)
    places = np.argsort(order)
    shuffled = es.TriangleMesh(HAND.vertices[order], places[HAND.faces])
    match = es.retrieval.match_patches(hand, patch_points(surface_patches(shuffled), book))
    gaps = HAND.vertices[match.vertices[:, 0]] - shuffled.vertices[match.vertices[:, 1]]
    near = np.linalg.norm(gaps, axis=1) < 0.1 * np.sqrt(es.geometry.surface_area(HAND))
    assert len(near) > 60
    assert near.mean() > 0.9


@pytest.mark.long
def test_a_part_agrees_with_its_whole_more_than_with_another_kind(hand, book):
    part = es.partial_scan(HAND, [0.0, 0, 1])
    scan = patch_points(surface_patches(part.mesh), book)
    other = patch_points(surface_patches(es.make_creature("biped", 1, n_vertices=1500)), book)
    assert (
        es.retrieval.match_patches(scan, hand).agreement
        > 1.5 * es.retrieval.match_patches(scan, other).agreement
    )


def test_larger_lengths_are_a_step(hand, monkeypatch):
    radii = np.roll(
        hand.numbers, 1, axis=1
    )  # what one shape shows at a radius, the other shows at the next
    larger = replace(
        hand, numbers=radii, distances=np.float32(patch_matching.SIZE_STEP) * hand.distances
    )
    monkeypatch.setattr(patch_matching, "SLACK", 0.1)
    match = es.retrieval.match_patches(hand, larger)
    assert match.step == 1
    assert np.array_equal(match.points[:, 0], match.points[:, 1])
    assert match.agreement > 0.95


@pytest.mark.long
def test_agreement_by_hand():
    rows, columns = nearest_of_each_other(
        np.array([[1.0, 5, 2], [0.5, 3, 4], [9, 2, 8]], dtype=np.float32)
    )
    assert rows.tolist() == [1, 2]
    assert columns.tolist() == [0, 1]
    ours = np.array([[0, 1, 2], [1, 0, 2], [2, 2, 0]], dtype=np.float32)
    theirs = np.array([[0, 2.2, 9], [2.2, 0, np.inf], [9, np.inf, 0]], dtype=np.float32)
    value, support = leading(ours, theirs, np.array([0.25, 0.25, 0.5]), 2.0, 0.2, 0.05)
    assert value == pytest.approx(0.25 * (1 - (0.2 / 2.2 / 0.2) ** 2))
    assert support == pytest.approx([np.sqrt(2), np.sqrt(2), 0])


def test_equally_near_points_are_paired_in_order():
    alike = np.array([[0.0, 7, 0, 9], [7, 7, 7, 1], [0, 7, 0, 9]], dtype=np.float32)
    rows, columns = nearest_of_each_other(alike)
    assert rows.tolist() == [0, 1, 2]
    assert columns.tolist() == [0, 3, 2]


@pytest.mark.long
@pytest.mark.parametrize("name", SYMMETRIC)
def test_a_symmetric_shape_finds_itself_near_0(name, book):
    shape = es.describe(SYMMETRIC[name](), es.retrieval.PatchRecipe(book))
    assert es.retrieval.patch_scores(shape, [shape])[0] == pytest.approx(0, abs=0.01)
    match = es.retrieval.match_patches(shape.points[0], shape.points[0])
    assert np.array_equal(match.points[:, 0], match.points[:, 1])
    assert len(match.points) == len(shape.vertices)


def test_a_point_without_weight_spoils_no_match(hand):
    """As the point of a speck, whose area is 0 in half precision."""
    weights = hand.weights.copy()
    weights[0] = 0
    points = replace(hand, weights=weights)
    match = es.retrieval.match_patches(points, points)
    assert np.array_equal(match.points[:, 0], match.points[:, 1])
    assert len(match.points) == len(es.retrieval.match_patches(hand, hand).points)
    assert match.agreement == pytest.approx(1)


@pytest.mark.parametrize("name", ["hand", "part", "icosahedron", "twelve boxes"])
def test_points_are_packed_without_loss(name, hand, book):
    points = hand
    if name != "hand":
        mesh = es.partial_scan(HAND, [0.0, 0, 1]).mesh if name == "part" else SYMMETRIC[name]()
        points = patch_points(surface_patches(mesh, n_samples=100), book)
    data = pack_points(points)
    assert len(data) < 17_500
    again = unpack_points(data)
    for field in ("numbers", "weights", "distances", "vertices"):
        assert np.array_equal(getattr(points, field), getattr(again, field)), field


def test_distances_follow_from_those_to_landmarks():
    places = np.random.default_rng(0).random((60, 3))
    true = np.linalg.norm(places[:, None] - places, axis=2).astype(np.float32)
    found = distances_by_landmarks(LENGTHS[nearest_lengths(true[:, :N_LANDMARKS])])
    assert np.array_equal(found, found.T)
    assert found[:N_LANDMARKS] == pytest.approx(true[:N_LANDMARKS], rel=0.02, abs=3e-4)
    assert np.median(abs(found - true)) < 0.1
    far = np.inf  # point 1 is alone
    apart = distances_by_landmarks(np.array([[0, far], [far, 0], [1, far]], dtype=np.float32))
    assert apart.tolist() == [[0, far, 1], [far, 0, far], [1, far, 0]]


def test_what_does_not_agree_is_no_match(hand):
    apart = replace(hand, distances=np.full_like(hand.distances, np.inf))
    match = es.retrieval.match_patches(hand, apart)
    assert match.agreement == 0
    assert match.points.shape == match.vertices.shape == (0, 2)


def test_other_codebooks_are_refused(hand):
    short = replace(hand, numbers=hand.numbers[:, :, :3])
    with pytest.raises(
        es.InvalidParameterError, match=r"Only points by one codebook match; .* the second \(9, 3\)"
    ):
        es.retrieval.match_patches(hand, short)
