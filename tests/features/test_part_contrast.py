"""What tells two parts from one: how the surface turns between them, and how thick they are."""

import numpy as np
import pytest

from eigenshape.features.part_contrast import (
    THICKNESS_WEIGHT,
    TURN_WEIGHT,
    _merge_by_contrast,
    _Parts,
)
from eigenshape.features.segmentation import FeaturePoints, Segmentation


def odds(turned=0.0, length=0.5, log_radii=(0.0, 0.0)):
    """Return the odds of two equal parts with a boundary across which the surface turns."""
    areas = np.array([0.5, 0.5])
    nothing = np.zeros((2, 2))
    parts = _Parts(
        areas=areas,
        means=np.array([[0.0], [2.0]]),
        sampled=areas.copy(),
        logs=areas * log_radii,
        borders=[{1: np.array([length, turned])}, {0: np.array([length, turned])}],
        adjacent=np.array([[0, 1]]),
        rows=np.array([0, 1]),
        lines=nothing,
        clear=nothing.copy(),
    )
    features = FeaturePoints(np.array([0, 1]), np.array([2.0, 1.0]), np.array([1.0, 0.5]))
    [(ends, remains, share)] = _merge_by_contrast(parts, Segmentation(np.array([0, 1]), features))
    assert (ends, remains) == (1, 0)
    return share / (1 - share)


@pytest.mark.parametrize("turned", [-0.2, 0.3])
def test_a_crease_makes_two_parts_and_a_ridge_one(turned):
    assert odds(turned) / odds() == pytest.approx(np.exp(TURN_WEIGHT * turned / 0.5))


def test_parts_without_a_boundary_have_no_crease():
    assert odds(0.3, length=0.0) == pytest.approx(odds())


def test_parts_of_other_thickness_are_two():
    ratio = odds(log_radii=(0.1, -0.4)) / odds()
    assert ratio == pytest.approx(np.exp(THICKNESS_WEIGHT * 0.5))
