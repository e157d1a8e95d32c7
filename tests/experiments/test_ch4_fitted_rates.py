"""Powers of closeness and heat time that are fitted to measurements."""

import sys
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "experiments" / "ch4_bound")]
from fitted_rates import bounding_rate, fit_rate  # noqa: E402


def test_a_law_is_found_again_from_its_values():
    law = es.stability.Rate(0.7, -1.9, 3.0)
    deltas, times = (grid.ravel() for grid in np.meshgrid([0.1, 0.2, 0.4], [1e-3, 1e-2]))
    found = fit_rate(deltas, times, law.at(deltas, times))
    assert (found.delta, found.t, found.constant) == pytest.approx((0.7, -1.9, 3.0))


def test_what_does_not_vary_has_no_exponent():
    found = fit_rate([0.1, 0.2, 0.4], [0.01] * 3, [1.0, 2.0, 4.0])
    assert (found.delta, found.t, found.constant) == pytest.approx((1.0, 0.0, 10.0))


def test_the_least_constant_covers_all_and_touches_one():
    deltas, times, measured = [0.1, 0.2, 0.4], [0.01, 0.02, 0.01], [1.0, 5.0, 2.0]
    law = bounding_rate(es.stability.theorem_rate("3.1.4", 2), deltas, times, measured)
    ratios = np.array(measured) / law.at(deltas, times)
    assert ratios.max() == pytest.approx(1.0)
    assert (ratios <= 1 + 1e-12).all()


def test_what_varies_together_has_no_powers():
    with pytest.raises(ValueError, match="must not vary together"):
        fit_rate([1, 2, 3], [1, 2, 3], [1, 2, 3])
