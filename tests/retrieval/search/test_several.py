"""Several indexes answer nearly as one index of all their shapes would."""

import shutil
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from describers import keep
from search_cases import RECIPE, mixtures

import eigenshape as es
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.patches.distance import USUAL_ISOLATION
from eigenshape.retrieval.search import reader

pytestmark = pytest.mark.long

N_PARTS, N_SHAPES = 4, 120


@pytest.fixture(autouse=True)
def as_isolated_as_usual(monkeypatch):
    """Let all shapes be as isolated, which each index else measures among its own."""

    def isolations(source, recipe, checksums):
        return np.full(len(checksums), USUAL_ISOLATION)

    monkeypatch.setattr(reader, "stored_isolations", isolations)


@pytest.fixture(scope="module")
def points():
    """Return the points of some creatures, so that verification changes the order."""
    recipe = es.retrieval.PatchRecipe()
    return [
        es.describe(es.make_creature(kind, pose, n_vertices=500), recipe).points
        for kind in ("fish", "bird", "biped")
        for pose in (0, 1)
    ]


@pytest.fixture(scope="module")
def shapes(points):
    codes = mixtures(1, N_SHAPES, 1)
    return [
        es.retrieval.DescribedShape(
            f"shape{number}",
            [PatchDescriptor(each, points[number % len(points)], RECIPE)],
            label=f"class{number % 3}",
        )
        for number, each in enumerate(codes)
    ]


@pytest.fixture(scope="module")
def queries(points):
    return [PatchDescriptor(codes, points[0], RECIPE) for codes in mixtures(5, 3, 1)]


@pytest.fixture(scope="module")
def whole(shapes, tmp_path_factory):
    index = es.ShapeIndex.create(tmp_path_factory.mktemp("whole"))
    index.add_many(shapes)
    return index


@pytest.fixture(scope="module")
def parts(shapes, tmp_path_factory):
    folders = [tmp_path_factory.mktemp(f"part{number}") for number in range(N_PARTS)]
    for number, folder in enumerate(folders):
        es.ShapeIndex.create(folder).add_many(shapes[number::N_PARTS])
    return folders


def facts(matches):
    return [
        (match.name, match.label, match.score, match.chance, match.distance, match.view)
        for match in matches
    ]


@pytest.mark.parametrize("n_matches", [1, 5, 50])
def test_parts_answer_bit_for_bit_as_one_index(whole, parts, queries, n_matches):
    for query in queries:
        found = es.retrieval.query_indexes(query, parts, n_matches=n_matches)
        expected = whole.query(query, n_matches=n_matches)
        assert facts(found) == facts(expected)
        assert (found.method, found.n_compared, found.n_shapes, found.nothing_alike) == (
            expected.method,
            expected.n_compared,
            expected.n_shapes,
            expected.nothing_alike,
        )
        for ours, theirs in zip(found, expected, strict=True):
            assert np.array_equal(ours.correspondences, theirs.correspondences)


def test_answers_of_parts_alone_would_be_sorted_otherwise(whole, parts, queries):
    """The score of a shape that is not among the thirty nearest of all must not count."""
    (query, *_) = queries
    every = [
        match for part in parts for match in es.ShapeIndex.open(part).query(query, n_matches=50)
    ]
    sorted_only = sorted((match.score, match.name) for match in every)[:50]
    expected = [(match.score, match.name) for match in whole.query(query, n_matches=50)]
    assert sorted_only != expected


def test_workers_and_filters(whole, parts, queries):
    (query, *_) = queries
    with ThreadPoolExecutor(2) as executor:
        found = es.retrieval.query_indexes(
            query, parts, where={"label": "class1"}, executor=executor
        )
    assert facts(found) == facts(whole.query(query, where={"label": "class1"}))


def test_an_index_stands_for_its_folder(queries, parts):
    (query, *_) = queries
    indexes = [es.ShapeIndex.open(folder) for folder in parts]
    expected = es.retrieval.query_indexes(query, parts)
    assert facts(es.retrieval.query_indexes(query, indexes)) == facts(expected)


def test_what_is_no_list_of_different_indexes_is_named(queries, parts):
    (query, *_) = queries
    index = es.ShapeIndex.open(parts[0])
    with pytest.raises(es.InvalidParameterError, match=r"takes a list.*Put it into a list"):
        es.retrieval.query_indexes(query, index)
    for again in (parts[0], str(parts[0]), parts[0] / ".." / parts[0].name, index):
        with pytest.raises(
            es.InvalidParameterError,
            match=r"folders must differ, .*; folders\[2\] is .*, as folders\[0\]",
        ):
            es.retrieval.query_indexes(query, [*parts[:2], again])


def test_what_is_added_or_made_anew_is_seen(shapes, queries, tmp_path):
    (query, *_) = queries
    folders = [tmp_path / "one", tmp_path / "two"]
    for number, folder in enumerate(folders):
        es.ShapeIndex.create(folder).add_many(shapes[number : number + 1])
    assert len(es.retrieval.query_indexes(query, folders)) == 2
    es.ShapeIndex.open(folders[0]).add_many(shapes[2:3])
    assert len(es.retrieval.query_indexes(query, folders)) == 3
    shutil.rmtree(folders[0])
    es.ShapeIndex.create(folders[0]).add_many(shapes[5:6])
    names = {match.name for match in es.retrieval.query_indexes(query, folders)}
    assert names == {"shape1", "shape5"}


def test_heat_is_merged_by_scores(tmp_path):
    heat = es.retrieval.SCALE_FREE
    folders = [tmp_path / "one", tmp_path / "two"]
    for kind, folder in zip(("fish", "bird"), folders, strict=True):
        described = es.describe(es.make_creature(kind, n_vertices=500), heat)
        keep(es.ShapeIndex.create(folder), kind, [described])
    query = es.describe(es.make_creature("fish", 1, n_vertices=500), heat)
    found = es.retrieval.query_indexes(query, folders)
    assert [match.name for match in found] == ["fish", "bird"]
    assert found[0].distance is None


def test_no_index_is_refused(queries, tmp_path):
    with pytest.raises(es.InvalidParameterError, match="at least one"):
        es.retrieval.query_indexes(queries[0], [])
    with pytest.raises(es.InvalidParameterError, match="takes a list"):
        es.retrieval.query_indexes(queries[0], str(tmp_path))
    with pytest.raises(es.StoreError, match="nowhere"):
        es.retrieval.query_indexes(queries[0], [tmp_path / "nowhere"])
