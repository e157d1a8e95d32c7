from dataclasses import replace

import numpy as np
import pytest

from eigenshape.shapes.creature_plans import PLANS, Limb, Z
from eigenshape.shapes.limbs import (
    BLEND,
    distance_to_body,
    distance_to_limb,
    nearest_limbs,
    place_limbs,
)

PLAN = [
    Limb("trunk", "", ((0, 0, 0, 0.2), (1, 0, 0, 0.2), (2, 0, 0, 0.2))),
    Limb("arm*", "trunk 1", ((1, 0.2, 0, 0.1), (1, 1.2, 0, 0.1)), ((0, Z, -10, 20),)),
    Limb("hand*", "arm* 1", ((1, 1.3, 0, 0.1), (1, 1.6, 0, 0.1))),
]


def test_pairs_are_mirrored_and_hang_on_their_own_side():
    body = place_limbs(PLAN)
    assert [limb.parent for limb in body.limbs] == [-1, 0, 0, 1, 2]
    np.testing.assert_array_equal(body.limbs[2].nodes, body.limbs[1].nodes * [1, -1, 1, 1])
    assert (body.limbs[1].swings[0][1], body.limbs[2].swings[0][1]) == ((0, 0, 1), (0, 0, -1))


def test_what_hangs_on_a_limb_hangs_on_its_parents_too():
    body = place_limbs(PLAN)
    np.testing.assert_array_equal(body.attachment_nodes(0), [np.nan, 1, 1, 1, 1])
    np.testing.assert_array_equal(body.attachment_nodes(1), [np.nan, np.nan, np.nan, 1, np.nan])


def test_the_distance_is_that_to_a_tube_and_less_where_limbs_melt():
    body = place_limbs(PLAN)
    points = np.array([[0.3, 0, 0.5], [0.3, 0, 0.2], [0.3, 0, 0.0], [-0.5, 0, 0]])
    np.testing.assert_allclose(distance_to_body(points, body), [0.3, 0, -0.2, 0.3], atol=1e-12)
    corner = np.array([[0.85, 0.25, 0.0]])  # 0.05 from the trunk and from the arm
    assert distance_to_body(corner, body)[0] == pytest.approx(0.05 - BLEND / 6)


def test_a_piece_without_length_changes_no_distance():
    points = np.array([[0.5, 0, 0.3], [-0.1, 0, 0.2], [0, 0, 0], [1, 0.2, 0.1], [0.1, 0.1, 0.1]])
    ends = [[0, 0, 0, 0.1], [0.5, 0, 0, 0.2], [1, 0, 0, 0.1]]
    limb, twice = (
        replace(place_limbs([Limb("tube", "", ((0, 0, 0, 1), (1, 0, 0, 1)))]).limbs[0], pieces=rows)
        for rows in (np.array(ends), np.array([ends[i] for i in (0, 0, 1, 1, 2, 2)]))
    )
    np.testing.assert_array_equal(
        distance_to_limb(points, twice)[0], distance_to_limb(points, limb)[0]
    )
    ball = replace(limb, pieces=np.array(ends)[[0, 0]])
    near = points[[1, 2, 4]]
    np.testing.assert_allclose(
        distance_to_limb(near, ball)[0], np.linalg.norm(near, axis=1) - 0.1, atol=1e-15
    )


def test_squashed_limbs_are_thin_along_an_axis():
    board = place_limbs([Limb("board", "", ((0, 0, 0, 0.5), (1, 0, 0, 0.5)), squash=(1, 1, 0.2))])
    points = np.array([[0.5, 0, 0.1], [0.5, 0.5, 0], [0.5, 0, 0.15]])
    np.testing.assert_allclose(distance_to_body(points, board), [0, 0, 0.05], atol=1e-12)
    assert board.thinnest == pytest.approx(0.1)


def test_a_point_belongs_to_the_limb_and_the_place_that_are_nearest():
    owner, place = nearest_limbs(
        np.array([[1.5, 0, 0.3], [1.0, 0.7, 0.2], [1.0, -1.6, 0]]), place_limbs(PLAN)
    )
    np.testing.assert_array_equal(owner, [0, 1, 4])
    np.testing.assert_allclose(place, [1.5, 0.5, 1.0], atol=1e-12)


def test_individuals_keep_their_pairs_alike():
    body = place_limbs(PLAN, individual=3)
    np.testing.assert_allclose(body.limbs[2].nodes, body.limbs[1].nodes * [1, -1, 1, 1])
    assert not np.allclose(body.limbs[1].nodes, place_limbs(PLAN).limbs[1].nodes)


@pytest.mark.parametrize("kind", PLANS)
def test_plans_bend_at_nodes_that_are_there_about_unit_axes(kind):
    for limb in PLANS[kind]:
        for node, axis, low, high in limb.swings:
            assert 0 <= node < len(limb.nodes)
            assert np.linalg.norm(axis) == pytest.approx(1)
            assert low <= 0 <= high
