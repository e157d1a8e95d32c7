"""What pairs of points cost, by hand."""

from dataclasses import replace

import numpy as np
import pytest

import eigenshape as es
from eigenshape.matching.pairs import FOREIGN, patch_differences
from eigenshape.matching.surface import View, describe_surface


@pytest.fixture(scope="module")
def part():
    """A sheet, and the same weight for each of its discs: products of equal weights change no mean."""
    found = describe_surface(es.shapes.grid(6, 6), 1.0, 12)
    assert found.weights.min() < 1
    return replace(found, weights=np.full_like(found.weights, 0.5))


@pytest.fixture(scope="module")
def whole():
    found = describe_surface(es.icosphere(1), 1.0, 12)
    assert found.weights.min() == 1
    return found


def differences(part, numbers):
    """Mean squared distances of numbers over the radii."""
    gaps = part.numbers[:, None].astype(float) - numbers
    return (gaps**2).sum(axis=3).mean(axis=2)


def test_discs_of_a_whole_differ_by_the_mean_of_squares(part, whole):
    found = patch_differences(part, whole)
    np.testing.assert_allclose(found, differences(part, whole.numbers), rtol=1e-3)


def test_a_view_counts_more_than_the_whole_and_where_it_is_nearer_all_the_same(part, whole):
    points = np.array([2, 5])
    same = View(points, whole.numbers[points], whole.weights[points])
    plain = patch_differences(part, whole)
    # What a view shows as the whole does is no nearer there.
    seen = patch_differences(part, replace(whole, views=(same,)))
    np.testing.assert_array_equal(seen, plain)
    near = (part.numbers[:2] + whole.numbers[points]) / 2
    seen = patch_differences(part, replace(whole, views=(View(points, near, same.weights),)))
    expected = np.minimum(plain[:, points], FOREIGN * differences(part, near))
    np.testing.assert_allclose(seen[:, points], expected, rtol=1e-3)
    others = np.setdiff1d(np.arange(plain.shape[1]), points)
    np.testing.assert_array_equal(seen[:, others], plain[:, others])


def test_a_part_without_a_rim_is_not_compared_with_views(whole):
    zero = View(np.arange(12), whole.numbers, whole.weights)
    ball = describe_surface(es.icosphere(1), 1.0, 12)
    np.testing.assert_array_equal(
        patch_differences(ball, replace(whole, views=(zero,))), patch_differences(ball, whole)
    )
