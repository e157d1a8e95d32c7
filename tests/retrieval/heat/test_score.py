from dataclasses import replace

import numpy as np
import pytest
from describers import RECIPE, descriptor
from hypothesis import given, settings
from hypothesis import strategies as st

from certeig.kit.errors import InvalidParameterError
from eigenshape.retrieval.heat import score
from eigenshape.retrieval.heat.recipe import SCALE_FREE, THESIS, HeatRecipe
from eigenshape.retrieval.heat.score import (
    HeatDescriptor,
    match_features,
    matching_score,
    matching_scores,
)


def of(vectors, recipe=RECIPE):
    vectors = np.asarray(vectors, dtype=float)
    return HeatDescriptor(vectors, np.arange(len(vectors)), recipe)


def literal(first, second):
    """The double sum of the thesis, term by term."""
    total = 0.0
    for ones, twos in ((first, second), (second, first)):
        for one in ones.vectors:
            total += min(
                sum(abs(a - b) for a, b in zip(one, two, strict=True)) for two in twos.vectors
            )
    return total


def test_score_by_hand():
    first, second = of([[0, 0, 0], [5, 0, 0]]), of([[1, 0, 0], [0, 0, 9]])
    assert matching_score(first, second) == (1 + 4) + (1 + 9)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10_000), st.integers(1, 5), st.integers(1, 5))
def test_score_is_the_double_sum_symmetric_and_zero_at_home(seed, m, n):
    first, second = descriptor(seed, m=m), descriptor(seed + 1, m=n)
    assert matching_score(first, second) == pytest.approx(literal(first, second), rel=1e-12)
    assert matching_score(first, second) == pytest.approx(matching_score(second, first), rel=1e-12)
    assert matching_score(first, first) == 0


def test_many_at_once_equal_one_by_one_whatever_the_chunk(monkeypatch):
    query = descriptor(0, m=3)
    others = [descriptor(seed, m=1 + seed % 4) for seed in range(1, 30)]
    starts = np.cumsum([0, *(len(other.vectors) for other in others)])[:-1]
    rows = np.concatenate([other.vectors for other in others])
    one_by_one = [matching_score(query, other) for other in others]
    for budget in (1, 40, 10**6):
        monkeypatch.setattr(score, "NUMBERS_AT_ONCE", budget)
        assert matching_scores(query.vectors, rows, starts, RECIPE)[0] == pytest.approx(
            one_by_one, rel=1e-14
        )


def test_shifts_undo_a_change_of_area():
    recipe = replace(SCALE_FREE, n_features=4)
    step = np.log(recipe.scales[1] / recipe.scales[0])
    rng = np.random.default_rng(3)
    longer = np.cumsum(rng.random((4, 18)), axis=1)
    whole = of(longer[:, 3:], recipe)
    part = of(
        longer[:, :15] - 3 * step, recipe
    )  # time s of the part is time s - 3 of the whole, its heat lower
    _, shifts = matching_scores(part.vectors, whole.vectors, np.array([0]), recipe)
    assert shifts[0] == 3
    assert matching_score(part, whole) == pytest.approx(score.SHIFT_PRICE * 3 * 15 * 4)
    assert matching_score(part, whole) == pytest.approx(matching_score(whole, part))
    assert {tuple(pair) for pair in match_features(part, whole).tolist()} == {
        (i, i) for i in range(4)
    }


def test_correspondences_are_mutual_and_closest_first():
    first, second = of([[0, 0, 0], [5, 0, 0], [9, 9, 9]]), of([[5.5, 0, 0], [0, 0, 0.1]])
    assert match_features(first, second).tolist() == [[0, 1], [1, 0]]


def test_recipes_must_agree():
    with pytest.raises(InvalidParameterError, match="Only descriptors by the same recipe compare"):
        matching_score(descriptor(1), descriptor(1, replace(RECIPE, name="other")))
    with pytest.raises(
        InvalidParameterError,
        match="Shifts need logarithmic vectors at scales in geometric sequence",
    ):
        HeatRecipe(scales=(1.0, 2.0, 3.0))
    with pytest.raises(InvalidParameterError, match="Shifts need logarithmic vectors"):
        HeatRecipe(scales=(0.0, 1.0, 2.0))
    with pytest.raises(InvalidParameterError, match="Shifts need logarithmic vectors"):
        HeatRecipe(logarithmic=False)


def test_the_recipe_of_the_thesis_is_what_the_thesis_says():
    assert THESIS.scales == (5, 20, 40, 60, 100, 150, 200, 300, 400, 500, 600, 700, 800, 900, 1000)
    assert (THESIS.time_unit, THESIS.feature_scale, THESIS.n_features, THESIS.unit) == (
        2e-4,
        5,
        15,
        "box",
    )
    assert len(SCALE_FREE.scales) == SCALE_FREE.n_features == 15
