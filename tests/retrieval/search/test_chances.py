"""Chances: the share of unrelated shapes that score as well, whether anything is alike, and which class is meant."""

import numpy as np
import pytest
from describers import keep

import eigenshape as es
from eigenshape.retrieval.search.chances import (
    EVEN_SCORE,
    SCORES,
    SHARES,
    chances,
    class_chances,
    nothing_alike,
)


def test_chances_grow_with_scores():
    assert chances(np.array(SCORES)) == pytest.approx(SHARES)
    assert (np.diff(chances(np.linspace(0, 1, 50))) > 0).all()
    assert chances(np.array([1.5])) == pytest.approx(1)


def test_the_best_score_tells_whether_anything_is_alike():
    scores = np.array([0.9, 0.4, 0.8])
    assert nothing_alike(scores, 100)
    assert not nothing_alike(scores, 10)  # the best of few shapes scores worse
    assert not nothing_alike(np.append(scores, 0.2), 100)


def test_an_empty_answer_has_nothing_alike():
    assert nothing_alike(np.empty(0), 0)


def test_classes_share_one_with_those_that_were_not_found():
    even = class_chances([EVEN_SCORE], ["cat"])
    assert even == {"cat": 0.5}
    several = class_chances(
        [0.3, 0.35, 0.35, 0.4, 0.4, 0.1], ["dog", "cat", "cat", None, "ox", "fish"]
    )
    assert list(several) == ["dog", "cat", "ox"]  # the sixth match does not count
    assert 0.98 < sum(several.values()) < 1
    twice = class_chances([0.3, 0.3], ["dog", "dog"])["dog"]
    assert twice > class_chances([0.3], ["dog"])["dog"]
    assert class_chances([0.0], ["cat"])["cat"] == pytest.approx(1)
    assert class_chances([0.1], [None]) == {}


def test_classes_are_not_known_for_heat():
    index = es.ShapeIndex.create(None)
    heat = es.describe(es.make_creature("fish", n_vertices=500), es.retrieval.SCALE_FREE)
    keep(index, "fish", [heat], label="fish")
    with pytest.raises(
        es.InvalidParameterError, match="known for patches; 'fish' was found by heat"
    ):
        index.query(heat).classify()


def test_matches_by_patches_carry_the_chance_of_their_score():
    index, recipe = es.ShapeIndex.create(None), es.retrieval.PatchRecipe()
    for name, mesh in {"ball": es.icosphere(2), "ring": es.shapes.torus(24, 12)}.items():
        patches = es.retrieval.extract_patches(mesh, n_samples=40, n_views=0)
        query = es.retrieval.patch_descriptor(patches, recipe)
        index.add_many([es.retrieval.DescribedShape(name, [query])])
    found = index.query(query)
    assert [match.name for match in found] == ["ring", "ball"]
    scores = np.array([match.score for match in found])
    assert [match.chance for match in found] == pytest.approx(chances(scores))
    assert found[0].chance < found[1].chance
