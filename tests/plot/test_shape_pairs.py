import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.matching.match import match_shapes
from eigenshape.plot.shape_pairs import figure_match, place_colors

pytestmark = pytest.mark.long


def test_colors_are_places_from_the_lowest_to_the_highest():
    colors = place_colors(np.array([[0.0, 2, 5], [1, 4, 5]]))
    assert np.allclose(colors, [[0.15, 0.15, 0.15], [1, 1, 0.15]])


def test_a_map_is_drawn_with_its_confidence():
    fish, other = (es.make_creature("fish", pose, n_vertices=500) for pose in (0, 1))
    match = match_shapes(fish, other)
    figure = figure_match(fish, other, match)
    titles = [axes.get_title() for axes in figure.axes]
    assert titles == [f"part: {match.confidence.mean():.0%} sure on average", "whole"]
    with pytest.raises(InvalidParameterError, match="The match must be of the part"):
        figure_match(es.icosphere(2), other, match)
