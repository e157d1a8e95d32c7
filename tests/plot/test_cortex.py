"""Both hemispheres in the four usual views."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape import InvalidParameterError
from eigenshape.features import Parcellation
from eigenshape.plot import figure_cortex

BALL = es.icosphere(2)
# The front is the sharp end: y is to the front.
EGG = BALL.vertices * [0.8, 1.4, 1.0]
HALVES = {
    "left": es.TriangleMesh(EGG - np.array([2, 0, 0]), BALL.faces),
    "right": es.TriangleMesh(EGG + np.array([2, 0, 0]), BALL.faces),
}
MAPS = {"left": EGG[:, 1], "right": 2 * EGG[:, 1]}


def middle(axes, column):
    """Return the color in a column of the middle row of a drawing, as a share of its width."""
    image = axes.images[0].get_array()
    return np.asarray(image[len(image) // 2, int(column * image.shape[1])])


@pytest.mark.long
def test_four_views_with_one_scale():
    figure = figure_cortex(HALVES, MAPS, "front, mm", color_map="gray")
    *views, bar = figure.axes
    assert [axes.get_title() for axes in views] == [
        "left, lateral", "right, lateral", "left, medial", "right, medial",
    ]  # fmt: skip
    assert bar.get_ylabel() == "front, mm"
    low, high = bar.get_ylim()
    assert (low, high) == (pytest.approx(2 * EGG[:, 1].min()), pytest.approx(2 * EGG[:, 1].max()))
    # The front is on the left of the left side seen from outside, and of the right one from inside.
    for axes, front in zip(views, (0.25, 0.75, 0.75, 0.25), strict=True):
        assert middle(axes, front)[0] > middle(axes, 1 - front)[0] + 0.05
        assert middle(axes, front)[3] == 1
    # z is the height of the box, and half of the drawing is cut off.
    bottom, top = views[0].get_ylim()
    assert 0.6 < (bottom - top) / 600 < 0.8


def test_one_hemisphere_and_what_has_no_value():
    values = np.where(EGG[:, 2] > 0.3, np.nan, EGG[:, 1])
    figure = figure_cortex({"left": HALVES["left"]}, {"left": values}, "f", limits=(0, 1))
    assert len(figure.axes) == 3
    assert figure.axes[-1].get_ylabel() == "f (gray: no value)"
    assert figure.axes[-1].get_ylim() == (0, 1)


@pytest.mark.long
def test_parcels_have_their_own_colors():
    parcels = Parcellation(np.where(EGG[:, 1] > 0.2, 0, -1), ("front",), [[1, 0, 0, 1]])
    figure = figure_cortex(HALVES, {"left": parcels, "right": parcels})
    assert len(figure.axes) == 4
    red, gray = middle(figure.axes[0], 0.25), middle(figure.axes[0], 0.75)
    assert red[0] > 0.3
    assert red[1] < 0.05
    assert gray[0] == gray[1] == gray[2]


@pytest.mark.parametrize(
    ("surfaces", "values", "message"),
    [
        (
            {"left": HALVES["right"]},
            {"left": MAPS["left"]},
            "left surface must lie on the left; it lies on the right, x > 0",
        ),
        (
            HALVES,
            {"left": MAPS["left"]},
            "surfaces and values must be of 'left', 'right' or both; they are of",
        ),
        ({"lh": BALL}, {"lh": MAPS["left"]}, "must be of 'left', 'right' or both"),
        ({}, {}, "must be of 'left', 'right' or both"),
        (HALVES, MAPS | {"left": Parcellation([0] * 162)}, "only the left one has parcels"),
        (HALVES, MAPS | {"left": np.ones(9)}, "one number per vertex"),
        (HALVES, dict.fromkeys(HALVES, np.full(162, np.nan)), "all are NaN"),
        (HALVES, dict.fromkeys(HALVES, Parcellation([0])), "belongs to another surface"),
    ],
)
def test_errors(surfaces, values, message):
    with pytest.raises(InvalidParameterError, match=message):
        figure_cortex(surfaces, values)
