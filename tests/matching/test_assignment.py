"""Far points of a part assigned to a whole, on creatures whose poses share their vertices."""

import numpy as np
import pytest
from matched_poses import N_POINTS, describe_poses

import eigenshape as es
from eigenshape.matching.assignment import (
    APART,
    DIFFERENT,
    N_ALIKE,
    N_ASSIGNMENTS,
    N_FAR,
    _best_of_kinds,
    assign_far_points,
)
from eigenshape.matching.pairs import descriptor_costs, patch_differences
from eigenshape.matching.surface import describe_surface


@pytest.fixture(scope="module")
def surfaces():
    """Two poses of a creature in one unit, with the same vertices."""
    return describe_poses()


@pytest.fixture(scope="module")
def assigned(surfaces):
    """The assignments of one pose to the other."""
    part, whole = surfaces
    return assign_far_points(part, whole, descriptor_costs(patch_differences(part, whole)))


def test_one_of_the_first_assignments_is_about_right(surfaces, assigned):
    part, whole = surfaces
    means = [
        whole.distances[pairs.partners, part.points[pairs.points]].mean() for pairs in assigned
    ]
    assert min(means[:5]) < 0.1  # the poses share their vertices
    assert np.median(means) > 2 * min(means)


def test_assignments_differ(surfaces, assigned):
    whole = surfaces[1]
    assert 1 < len(assigned) <= N_ASSIGNMENTS
    for number, one in enumerate(assigned):
        assert len(np.unique(one.points)) == N_FAR
        for other in assigned[:number]:
            apart = whole.between[one.partners, other.partners] > APART
            assert apart.mean() > DIFFERENT


def test_patches_break_ties(surfaces):
    """What is most similar by patches alone is chosen if distances say nothing."""
    part, whole = surfaces
    costs = np.full((N_POINTS, N_POINTS), 1e6)
    costs[np.arange(N_POINTS), np.arange(N_POINTS)[::-1]] = 1.0
    first = assign_far_points(part, whole, costs)[0]
    assert (first.partners == N_POINTS - 1 - first.points).mean() > 0.3


def test_a_part_of_few_points_is_not_assigned(surfaces):
    grid = describe_surface(es.shapes.grid(1, 1), 1.2, 300)
    assert assign_far_points(grid, surfaces[1], np.ones((4, N_POINTS))) == []


def test_of_each_kind_the_best_few_stay():
    rng = np.random.default_rng(0)
    worth, kinds = rng.random(60), rng.integers(0, 7, 60)
    wanted = [
        number
        for kind in range(7)
        for number in sorted(np.flatnonzero(kinds == kind), key=lambda each: -worth[each])[:N_ALIKE]
    ]
    found = _best_of_kinds(worth, kinds)
    assert found.tolist() == sorted(wanted, key=lambda each: -worth[each])
