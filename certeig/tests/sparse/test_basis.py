import numpy as np
import pytest

from certeig.sparse.basis import combine_columns, pack_columns, products, subtract


def unpacked(slots):
    return np.concatenate(list(slots), axis=1)


@pytest.mark.parametrize(
    ("n", "k", "groups"), [(1, 1, 1), (37, 13, 1), (2051, 24, 2), (1027, 5, 3)]
)
def test_slots_are_columns(n, k, groups):
    rng = np.random.default_rng(n)
    columns, block = rng.normal(size=(n, k)), rng.normal(size=(groups, n, 8))
    space, flat = pack_columns(columns), unpacked(block)
    padded = unpacked(space)
    np.testing.assert_array_equal(padded[:, :k], columns)
    assert not padded[:, k:].any()
    parts = products(space, block)
    np.testing.assert_allclose(parts, padded.T @ flat, atol=1e-11)
    left = block.copy()
    subtract(space, parts, left)
    np.testing.assert_allclose(unpacked(left), flat - padded @ parts, atol=1e-10)
    weights = rng.normal(size=(padded.shape[1], 7))
    np.testing.assert_allclose(combine_columns(space, weights), padded @ weights, atol=1e-11)


def test_no_columns_at_all():
    space, block = pack_columns(np.empty((5, 0))), np.ones((1, 5, 8))
    assert products(space, block).shape == (0, 8)
    subtract(space, np.empty((0, 8)), block)
    assert (block == 1).all()
