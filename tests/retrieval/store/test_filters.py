"""Filters as text, and what an index understands by them."""

import pytest

from eigenshape.retrieval.store.filters import parse_filters


@pytest.mark.parametrize(
    ("text", "conditions"),
    [
        ("label=cat, dog", {"label": ["cat", "dog"]}),
        ("label=1..2", {"label": ["1..2"]}),
        ("tag!=7", {"tag!=": ["7"]}),
        ('kind="cup, small",7', {"kind": ["cup, small", 7.0]}),
        ("height=2", {"height": [2.0]}),
        ("height=1.5..3", {"height": (1.5, 3.0)}),
        ("height=..3", {"height": (None, 3.0)}),
        ("height!=1.5 ..", {"height!=": (1.5, None)}),
    ],
)
def test_a_condition_is_values_or_a_range(text, conditions):
    assert parse_filters([text]) == conditions


def test_no_filter_is_no_condition():
    assert parse_filters(None) is None
    assert parse_filters([]) is None
