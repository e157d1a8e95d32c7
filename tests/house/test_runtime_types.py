"""The types of arguments and results are checked while the tests run; otherwise annotations could say anything."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from beartype.roar import BeartypeCallHintViolation
from jaxtyping import Float, TypeCheckError
from runtime_types import checked

import eigenshape as es


@checked
def product(matrix: Float[np.ndarray, "n m"], vector: Float[np.ndarray, " m"]) -> object:
    return matrix @ vector


@checked
def halved(values: Float[np.ndarray, " n"], wrong: bool = False) -> Float[np.ndarray, " n"]:
    # its own call has other lengths of the same names
    half = product(np.eye(2, len(values)), values)
    return half if wrong else values / 2


@checked
def each_row(values: Float[np.ndarray, "n d"]) -> Iterator[Float[np.ndarray, " d"]]:
    yield from values


@checked
@dataclass
class Weighted:
    values: Float[np.ndarray, " n"]
    weights: Float[np.ndarray, " n"]
    factor: float = 1.0

    @staticmethod
    @checked
    def length(values: Float[np.ndarray, " n"]) -> int:
        return len(values)


def test_what_is_right_passes():
    np.testing.assert_array_equal(halved(np.ones(3)), [0.5] * 3)
    assert len(list(each_row(np.ones((2, 3))))) == 2
    assert Weighted(np.ones(2), np.ones(2), 3).length(np.ones(5)) == 5  # an int serves as a float


@pytest.mark.parametrize(
    "call",
    [
        lambda: product(np.eye(2), np.ones(3)),
        lambda: product(np.eye(2), [1.0, 2.0]),
        lambda: product(np.eye(2), np.ones(2, dtype=int)),
        lambda: halved(np.ones(3), wrong=True),
        lambda: each_row(np.ones(3)),
        lambda: Weighted(np.ones(2), np.ones(3)),
        lambda: Weighted(np.ones(2), np.ones(2), "3"),
        lambda: Weighted.length([1.0]),
        lambda: es.geometry.edge_lengths("mesh"),
        lambda: es.Laplacian("stiffness", "mass"),
    ],
)
def test_what_is_wrong_is_refused(call):
    with pytest.raises((BeartypeCallHintViolation, TypeCheckError)):
        call()
