import numpy as np
import pytest
from matplotlib.patches import Polygon

import eigenshape as es


def test_points_hulls_names_and_shares_of_groups(tmp_path):
    scores = np.array([[0, 0], [2, 0], [2, 2], [1, 0.5], [5, 5], [6, 6], [7, 7.0]])
    names = ["$a", "b", "c", "d", "e", "f", "g"]
    figure = es.plot.figure_ordination(
        scores, list("xxxxyyy"), names=names, shares=[0.5, 0.254, 0.2]
    )
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("component 1 (50 %)", "component 2 (25 %)")
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["x (4)", "y (3)"]
    assert [text.get_text() for text in axes.texts] == [r"\$a", *names[1:]]
    np.testing.assert_array_equal(axes.collections[1].get_offsets(), scores[4:])
    # The second group lies on a line and has no hull; the fourth point lies inside the first hull.
    (hull,) = [patch for patch in axes.patches if isinstance(patch, Polygon)]
    assert {tuple(corner) for corner in hull.get_xy().tolist()} == {(0, 0), (2, 0), (2, 2)}
    es.save_figure(figure, tmp_path / "ordination.png")


def test_scores_without_groups_have_no_legend():
    figure = es.plot.figure_ordination(np.eye(4))
    assert figure.axes[0].get_legend() is None
    assert figure.axes[0].get_xlabel() == "component 1"


def test_wrong_numbers_of_groups_and_names_are_refused():
    for scores, groups, names in (
        (np.eye(3), [1, 2], ()),
        (np.eye(3), None, ["a"]),
        (np.ones((3, 1)), None, ()),
    ):
        with pytest.raises(es.InvalidParameterError, match="scores must have two columns or more"):
            es.plot.figure_ordination(scores, groups, names=names)


def test_landmarks_of_all_specimens_lie_around_those_of_the_mean():
    shapes = np.random.default_rng(0).standard_normal((6, 4, 3)) + np.diag([9, 4, 2, 0])[:, :3]
    figure = es.plot.figure_landmarks(shapes, names=["a", "b", "$c", "d"])
    for axes, height in zip(figure.axes, (1, 2), strict=True):
        cloud, mean = (np.asarray(each.get_offsets()) for each in axes.collections)
        np.testing.assert_allclose(cloud.reshape(6, 4, 2).mean(axis=0), mean)
        assert [text.get_text() for text in axes.texts] == ["a", "b", r"\$c", "d"]
        assert axes.get_ylabel() == f"axis {height + 1}"
    # Both panels have the longest axis across, and the second has the shortest up.
    wide, flat = (np.asarray(axes.collections[1].get_offsets()) for axes in figure.axes)
    np.testing.assert_array_equal(wide[:, 0], flat[:, 0])
    assert np.linalg.norm(wide[:, 0]) > np.linalg.norm(wide[:, 1]) > np.linalg.norm(flat[:, 1])


def test_wrong_landmarks_are_refused():
    with pytest.raises(es.InvalidParameterError, match="shapes must be finite, in shape"):
        es.plot.figure_landmarks(np.eye(3))
    with pytest.raises(
        es.InvalidParameterError, match="one entry for each of 3 landmarks; there are 1"
    ):
        es.plot.figure_landmarks(np.ones((2, 3, 3)), names=["a"])
