import numpy as np
import pytest

import eigenshape as es
from eigenshape.morphometrics.landmarks import as_configurations

Landmarks = es.morphometrics.Landmarks


def test_wrong_landmarks_are_refused():
    with pytest.raises(es.InvalidParameterError, match="there are 1 names, and the shape is"):
        Landmarks(["a"], np.zeros((2, 3)))
    with pytest.raises(
        es.InvalidParameterError, match=r"names\[1\] must be a text without line breaks"
    ):
        Landmarks(["a", "b\nc"], np.zeros((2, 3)))
    with pytest.raises(es.InvalidParameterError, match="'a' is that of rows 0 and 2"):
        Landmarks(["a", "b", "a"], np.zeros((3, 3)))
    with pytest.raises(es.InvalidParameterError, match=r"'b', row 1, is \[0.0, nan, 0.0\]"):
        Landmarks(["a", "b"], [[0, 0, 0], [0, np.nan, 0]])
    with pytest.raises(es.InvalidParameterError, match="spread must be 1 numbers"):
        Landmarks(["a"], np.zeros((1, 3)), [1.0, 2.0])
    with pytest.raises(es.InvalidParameterError, match=r"curves\[1\] must lie in 0..1; it is 2"):
        Landmarks(["a", "b"], np.zeros((2, 3)), curves=[[0, 1], [1, 2]])


def test_a_list_of_landmarks_is_as_good_as_an_array():
    points = np.random.default_rng(0).standard_normal((2, 4, 3))
    several = [Landmarks("abcd", each) for each in points]
    for specimens in (points, several, {"x": several[0], "y": several[1]}, list(points)):
        np.testing.assert_array_equal(as_configurations(specimens), points)


def test_what_is_no_list_of_specimens_is_refused():
    one, other = Landmarks("ab", np.zeros((2, 3))), Landmarks("ba", np.zeros((2, 3)))
    with pytest.raises(es.InvalidParameterError, match=r"1 has 'b'\. Give missing ones as NaN"):
        as_configurations([one, other])
    with pytest.raises(es.InvalidParameterError, match="at least one specimen with a landmark"):
        as_configurations({})
    with pytest.raises(es.InvalidParameterError, match=r"specimens\[1\] must be a Landmarks"):
        as_configurations([one, np.zeros((2, 3))])
    with pytest.raises(es.InvalidParameterError, match=r"n specimens; the shape is \(2, 3\)"):
        as_configurations(np.zeros((2, 3)))
