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
