"""Pairs that are nearly the same are found, and no others."""

import pytest

import eigenshape as es
from eigenshape.retrieval import duplicates
from eigenshape.retrieval.duplicates import find_duplicates


def test_copies_are_found_and_kinds_are_apart():
    index = es.ShapeIndex.create(None)
    assert find_duplicates(index) == []
    for kind in ("fish", "bird"):
        mesh = es.make_creature(kind, n_vertices=500)
        index.add(kind, mesh, n_views=0)
        moved = es.TriangleMesh(3 * mesh.vertices[:, [1, 2, 0]] + 7, mesh.faces)
        index.add(f"a {kind}", moved, n_views=0)
    pairs = find_duplicates(index)
    assert {(one, two) for one, two, _, _ in pairs} == {("a bird", "bird"), ("a fish", "fish")}
    assert all(score < 0.05 for _, _, score, _ in pairs)
    assert len(find_duplicates(index, most_score=9)) == 6


def test_two_shapes_are_as_alike_whatever_else_is_there():
    index = es.ShapeIndex.create(None)
    fish = es.make_creature("fish", n_vertices=500)
    index.add("fish", fish, n_views=0)
    index.add("turned", es.TriangleMesh(fish.vertices[:, [1, 2, 0]], fish.faces), n_views=0)
    alone = find_duplicates(index)
    for seed in (1, 2):
        index.add(f"pose {seed}", es.make_creature("fish", seed, n_vertices=500), n_views=0)
    assert alone[0] in find_duplicates(index)


def test_more_copies_than_are_looked_at_first(monkeypatch):
    monkeypatch.setattr(duplicates, "AT_FIRST", 4)
    index = es.ShapeIndex.create(None)
    described = [es.describe(es.make_creature("fish", n_vertices=500))]
    n_copies = 6
    index.add_many(
        es.retrieval.DescribedShape(f"copy {number}", described) for number in range(n_copies)
    )
    assert len(find_duplicates(index)) == n_copies * (n_copies - 1) / 2


@pytest.mark.parametrize("score", [-1, float("nan")])
def test_a_score_that_is_none_is_refused(score):
    with pytest.raises(es.InvalidParameterError, match="most_score must be finite and at least 0"):
        find_duplicates(es.ShapeIndex.create(None), most_score=score)
