"""A query beside its matches: from which side, in which colors, and what cannot be drawn."""

import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import StoreError


@pytest.fixture(scope="module")
def horse():
    return es.make_creature("quadruped", n_vertices=800)


@pytest.fixture(scope="module")
def turned(horse):
    """The same, by a third of a turn."""
    return es.TriangleMesh(horse.vertices[:, [2, 0, 1]], horse.faces)


@pytest.fixture(scope="module")
def matches(horse, turned):
    index = es.ShapeIndex.create(None)
    index.add("turned", turned, n_views=0)
    return index.query(horse)


@pytest.mark.parametrize("alone", [False, True])
def test_a_match_is_drawn_from_the_side_of_the_query(horse, turned, matches, alone):
    asked = matches[0] if alone else matches
    figure = es.plot.figure_matches(
        horse, asked, meshes={"turned": turned}, view="left", caption="two horses"
    )
    assert figure.axes[1].get_title().endswith(", turned")
    pictures = [axes.images[0].get_array() for axes in figure.axes if axes.images]
    one, two = ((picture != picture[0, 0]).any(axis=2) for picture in pictures)
    assert 0.1 < one.mean() < 0.9
    assert np.mean(one != two) < 0.02  # one outline
    said = "surest" if alone else "equal colors"
    first, *rest = figure.get_suptitle().splitlines()
    assert first == "two horses"
    assert said in rest[0]


def test_a_match_without_a_mesh_is_named_and_its_place_is_empty(horse, matches):
    with pytest.warns(UserWarning, match=r"not drawn: turned: .* Pass meshes=\{name: mesh\}"):
        figure = es.plot.figure_matches(horse, matches)
    assert len([axes for axes in figure.axes if axes.images]) == 1
    with pytest.raises(StoreError, match="without one"):
        es.plot.figure_matches(horse, matches[0])


def test_another_mesh_than_the_one_of_the_search_or_the_index_is_refused(horse, turned, matches):
    small = es.icosphere(1)
    with pytest.raises(InvalidParameterError, match="query must be the mesh that was searched for"):
        es.plot.figure_matches(small, matches, meshes={"turned": turned})
    with pytest.raises(StoreError, match="drawn from the mesh that was indexed"):
        es.plot.figure_matches(horse, matches[0], meshes={"turned": small})
    with pytest.raises(InvalidParameterError, match="it is empty"):
        es.plot.figure_matches(horse, [])
