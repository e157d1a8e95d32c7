"""Chances: the share of unrelated shapes that score as well, and whether anything stands out."""

import numpy as np
import pytest

from eigenshape.retrieval.search.chances import SCORES, SHARES, chances, nothing_alike


def test_chances_grow_with_scores():
    assert chances(np.array(SCORES)) == pytest.approx(SHARES)
    assert (np.diff(chances(np.linspace(0, 1, 50))) > 0).all()
    assert chances(np.array([1.5])) == pytest.approx(1)


def test_one_good_score_among_many_stands_out():
    far = np.full(20, 0.85)
    assert nothing_alike(far, 100)
    assert not nothing_alike(np.append(far, 0.2), 100)
    assert nothing_alike(np.append(far, 0.32), 100)


def test_several_fair_scores_stand_out_together():
    # of 1,000 unrelated shapes, 2 score below 0.286
    assert nothing_alike(np.array([0.286, 0.9]), 1000)
    assert not nothing_alike(np.full(12, 0.286), 1000)


def test_an_empty_answer_has_nothing_alike():
    assert nothing_alike(np.empty(0), 0)
