"""Queries of an index: all shapes of a small one, in stages for a large one, and with an engine."""

import threading

import numpy as np
import pytest
from describers import keep
from search_cases import RECIPE, mixtures

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.search import candidates

pytestmark = pytest.mark.long

N_SHAPES = 300


@pytest.fixture
def staged(monkeypatch):
    """Scan indexes of more than fifty shapes."""
    monkeypatch.setattr(candidates, "FEWEST_TO_SCAN", 50)
    monkeypatch.setattr(candidates, "N_COMPARED", 60)
    monkeypatch.setattr(candidates, "PER_MATCH", 6)
    monkeypatch.setattr("eigenshape.retrieval.search.reader.FEWEST_TO_SCAN", 50)


@pytest.fixture(scope="module")
def points():
    fish = es.make_creature("fish", n_vertices=500)
    return es.describe(fish, es.retrieval.PatchRecipe()).points[0]


def described(points, seed, count):
    return [PatchDescriptor(codes, (points,), RECIPE) for codes in mixtures(seed, count, 1)]


@pytest.fixture
def index(points, tmp_path, staged):
    made = es.ShapeIndex.create(tmp_path / "index")
    made.add_many(
        es.retrieval.DescribedShape(f"shape{number}", [each], label=f"class{number % 3}")
        for number, each in enumerate(described(points, 1, N_SHAPES))
    )
    return made


def names(matches):
    return [match.name for match in matches]


def test_stages_find_what_an_exact_search_finds(index, points):
    for query in described(points, 5, 4):
        some, every = index.query(query), index.query(query, exact=True)
        assert (some.method, some.n_compared, some.n_shapes) == ("staged", 60, N_SHAPES)
        assert (every.method, every.n_compared) == ("exact", N_SHAPES)
        assert names(some) == names(every)


def test_a_filter_leaves_few_which_are_all_compared(index, points):
    (query,) = described(points, 5, 1)
    found = index.query(query, where={"label": "class1"}, n_matches=3)
    assert {match.label for match in found} == {"class1"}
    assert found.n_shapes == N_SHAPES // 3


def test_the_file_of_the_scan_serves_the_next_reader_and_may_be_lost(index, points):
    (query,) = described(points, 5, 1)
    before = names(index.query(query))
    (kept,) = index.folder.glob("coarse-*")
    made = kept.stat().st_mtime_ns
    assert names(index.query(query)) == before
    assert kept.stat().st_mtime_ns == made
    kept.write_bytes(kept.read_bytes()[:-7])
    assert names(index.query(query)) == before
    kept.unlink()
    assert names(index.query(query)) == before


def test_a_shape_that_is_added_is_found_after_refresh(index, points):
    (query,) = described(points, 99, 1)
    with index.reader() as reader:
        assert "new" not in names(reader.query(query))
        index.add_many([es.retrieval.DescribedShape("new", [query])])
        assert reader.refresh()
        found = reader.query(query, n_matches=1)
        assert (names(found), found.method) == (["new"], "staged")
        index.remove("new")
        assert reader.refresh()
        assert "new" not in names(reader.query(query))


def test_an_engine_chooses_what_is_compared(index, points):
    pytest.importorskip("faiss")
    (query,) = described(points, 5, 1)
    with index.reader(es.retrieval.FaissEngine) as reader:
        found = reader.query(query, n_matches=1)
        assert found.method == "candidates"
        assert names(found) == names(index.query(query, n_matches=1, exact=True))


def test_what_a_maker_returns_must_be_an_engine(index, points):
    (query,) = described(points, 5, 1)
    reader = index.reader(lambda coarse: len(coarse.rows))
    with reader, pytest.raises(InvalidParameterError, match="the engine that was made must be"):
        reader.query(query)


def test_an_engine_serves_as_long_as_few_shapes_change(index, points):
    pytest.importorskip("faiss")
    made = []

    def make(coarse):
        made.append(coarse)
        return es.retrieval.FaissEngine(coarse)

    new, *others = described(points, 98, 30)
    with index.reader(make) as reader:
        reader.query(new)
        index.add_many([es.retrieval.DescribedShape("new", [new])])
        index.remove("shape7")
        assert reader.refresh()
        found = reader.query(new)
        assert (found[0].name, found.method, found.n_shapes) == ("new", "candidates", N_SHAPES)
        (old,) = described(points, 1, 8)[7:]
        assert "shape7" not in names(reader.query(old))
        assert len(made) == 1
        index.add_many(
            es.retrieval.DescribedShape(f"new{number}", [each])
            for number, each in enumerate(others)
        )
        assert reader.refresh()
        assert reader.query(others[3], n_matches=1)[0].name == "new3"
        assert len(made) == 2


def test_threads_share_the_scan_of_a_reader(index, points):
    queries = described(points, 5, 6)
    expected = [names(index.query(query)) for query in queries]
    found = {}
    with index.reader() as reader:

        def ask(number):
            found[number] = names(reader.query(queries[number]))

        threads = [threading.Thread(target=ask, args=[number]) for number in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert [found[number] for number in range(6)] == expected


def test_chance_is_small_for_the_same_shape_and_large_for_others(index, points):
    (same,) = described(points, 1, 1)  # the first shape of the index
    match = index.query(same, n_matches=1)[0]
    assert match.name == "shape0"
    assert match.chance < 1e-4
    assert not index.query(same).nothing_alike
    heat = es.describe(es.make_creature("fish", n_vertices=500), es.retrieval.SCALE_FREE)
    keep(index, "heat", [heat])
    assert index.query(heat)[0].chance is None


def test_an_exact_search_reads_no_scan(index, points):
    (query,) = described(points, 5, 1)
    index.query(query, exact=True)
    assert not list(index.folder.glob("coarse-*"))


def test_matches_are_a_sequence(index, points):
    (query,) = described(points, 5, 1)
    found = index.query(query, n_matches=3)
    assert len(found) == 3
    assert list(found)[1:] == list(found[1:])
    assert found[0] in found
    assert np.all(np.diff([match.score for match in found]) >= 0)
