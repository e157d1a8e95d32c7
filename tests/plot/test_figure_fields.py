import numpy as np
import pytest

import eigenshape as es

BALL = es.icosphere(2)
X, Y, _ = BALL.vertices.T


def test_fields_side_by_side_share_their_colors():
    figure = es.plot.figure_fields({"x": (BALL, X), "3 x": (BALL, 3 * X)}, "length", view="left")
    *drawings, bar = figure.axes
    assert [axes.get_title() for axes in drawings] == ["x", "3 x"]
    assert bar.get_ylabel() == "length"
    assert bar.get_ylim() == pytest.approx((-3, 3))
    one, three = (np.asarray(axes.get_images()[0].get_array()) for axes in drawings)
    alone = es.plot.figure_fields({"x": (BALL, X)}, view="left", limits=(-3, 3))
    np.testing.assert_array_equal(one, alone.axes[0].get_images()[0].get_array())
    assert np.abs(one - three).max() > 0.1


def test_what_no_field_is_is_named():
    with pytest.raises(es.InvalidParameterError, match="at least one field; it is empty"):
        es.plot.figure_fields({})
    unchecked = es.plot.figure_fields.__wrapped__  # past the check of types
    with pytest.raises(es.InvalidParameterError, match="'x' has a TriangleMesh"):
        unchecked({"x": BALL})
