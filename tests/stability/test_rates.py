"""Powers of closeness and heat time: those that are printed, and how they hang together."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import eigenshape as es


@pytest.mark.parametrize("dim", [1, 2, 3, 7])
def test_the_rate_of_manifolds_balances_those_it_is_made_of(dim):
    """Theorem 3.1.5 takes t = δ^(4(m+6)/(m²+14m+56)), where the rates of 3.1.1 and 3.1.4 are equal."""
    delta = 1e-3
    t = delta ** (4 * (dim + 6) / (dim**2 + 14 * dim + 56))
    both = [
        es.stability.theorem_rate(name, dim).at(delta, t) for name in ("3.1.1", "3.1.4", "3.1.5")
    ]
    np.testing.assert_allclose(both, both[0])


@pytest.mark.parametrize("dim", [1, 2, 3, 7])
def test_graph_laplacians_reach_the_cube_root_where_the_theorem_says(dim):
    delta = 1e-4
    t = delta ** (14 / (15 * dim + 42))
    np.testing.assert_allclose(
        es.stability.theorem_rate("4.1.1", dim).at(delta, t), delta ** (1 / 3)
    )


@given(st.integers(1, 5), st.floats(1e-6, 1e-1), st.floats(1.5, 1e4))
def test_ours_is_below_the_theorem_where_the_theorem_holds(dim, delta, factor):
    t = factor * delta**2
    ours, theorem = (es.stability.theorem_rate(name, dim) for name in ("lipschitz", "4.3.1"))
    np.testing.assert_allclose(
        ours.at(delta, t) / ours.constant, theorem.at(delta, t) * (delta**2 / t) ** 0.1, rtol=1e-9
    )


def test_bad_input_is_named():
    with pytest.raises(
        es.InvalidParameterError, match=r"theorem must be one of 3\.1\.1, .*; it is '9\.9'"
    ):
        es.stability.theorem_rate("9.9", 2)
    with pytest.raises(es.InvalidParameterError, match=r"dim must lie in 1\.\.100; it is 0"):
        es.stability.theorem_rate("3.1.1", 0)
