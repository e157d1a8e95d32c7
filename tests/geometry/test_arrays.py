import numpy as np
import pytest

from eigenshape._arrays import positive_values, vertex_values, whole_number
from eigenshape._errors import InvalidParameterError


def test_whole_numbers_of_any_type_become_ints():
    assert type(whole_number(np.int8(5), "k", 1, 5)) is int


@pytest.mark.parametrize("value", [np.array([1, 2]), np.array(1.5)])
def test_what_is_no_whole_number_is_refused(value):
    with pytest.raises(InvalidParameterError, match=r"k must be a whole number; it is array\("):
        whole_number(value, "k", 1, 5)


@pytest.mark.parametrize("value", [0, 6])
def test_whole_numbers_out_of_range_are_refused(value):
    with pytest.raises(InvalidParameterError, match=rf"k must lie in 1\.\.5; it is {value}"):
        whole_number(value, "k", 1, 5)


def test_positive_values_name_the_first_that_is_not():
    assert positive_values([1, 2], "times").tolist() == [1.0, 2.0]
    with pytest.raises(InvalidParameterError, match=r"times must be positive and finite; entry 1 is -2\.0"):
        positive_values([1, -2, -3], "times")
    with pytest.raises(InvalidParameterError, match=r"times must be a list of numbers; the shape is \(1, 2\)"):
        positive_values([[1, 2]], "times")


def test_vertex_values_are_one_finite_number_a_vertex():
    assert vertex_values([1, 2], "field", 2).dtype == np.float64
    with pytest.raises(InvalidParameterError, match=r"field must hold one number a vertex, shape \(3,\); the shape is"):
        vertex_values([1, 2], "field", 3)
    with pytest.raises(InvalidParameterError, match="field must be finite; entry 1 is nan"):
        vertex_values([1, np.nan], "field", 2)


@pytest.mark.parametrize(
    ("value", "fact"),
    [
        (["1.5"], "must be real numbers; the type is <U3"),
        ([1j], "must be real numbers; the type is complex128"),
        ([None], "must be real numbers; the type is object"),
        ([[1.0], [1.0, 2.0]], "must be a list of numbers; its entries differ in length"),
    ],
)
def test_what_is_no_number_is_refused(value, fact):
    with pytest.raises(InvalidParameterError, match=f"times {fact}"):
        positive_values(value, "times")
    with pytest.raises(InvalidParameterError, match=f"field {fact}"):
        vertex_values(value, "field", 1)
