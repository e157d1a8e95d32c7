"""Candidates: all shapes of a small index, the nearest of a large one, and those of engines."""

import sys

import numpy as np
import pytest
from search_cases import RECIPE, as_query, make_source, mixtures

import eigenshape as es
from eigenshape.retrieval.patches.distance import USUAL_ISOLATION, packed_distances
from eigenshape.retrieval.search import candidates, engines
from eigenshape.retrieval.search.candidates import choose_candidates, n_compared
from eigenshape.retrieval.search.coarse import coarse_rows
from eigenshape.retrieval.search.options import QueryOptions


@pytest.fixture
def source(tmp_path, monkeypatch):
    monkeypatch.setattr(candidates, "FEWEST_TO_SCAN", 50)
    monkeypatch.setattr(candidates, "N_COMPARED", 60)
    monkeypatch.setattr(candidates, "PER_MATCH", 6)
    return make_source(tmp_path, 400)


def ask(source, query, **options):
    allowed = options.pop("allowed", np.ones(source.n_shapes, dtype=bool))
    isolations = options.pop("isolations", np.full(source.n_shapes, USUAL_ISOLATION))
    supplier = options.pop("supplier", None)
    return choose_candidates(
        as_query(query),
        lambda: coarse_rows(source, RECIPE),
        allowed,
        isolations,
        QueryOptions(**options),
        supplier,
    )


def nearest(source, query, places, count=5):
    distances = packed_distances(query, source.rows_of(places))
    return places[np.argsort(distances, kind="stable")[:count]].tolist()


def test_a_scan_finds_what_all_comparisons_find(source):
    everything = np.arange(400)
    for query in mixtures(5, 6, 1):
        staged, exact = ask(source, query), ask(source, query, exact=True)
        assert (staged.method, len(staged.places), staged.n_shapes) == ("staged", 60, 400)
        assert (exact.method, exact.places.tolist()) == ("exact", everything.tolist())
        assert nearest(source, query, staged.places) == nearest(source, query, everything)
        assert (np.diff(staged.places) > 0).all()


def test_candidates_are_chosen_by_scaled_scores(source):
    """A shape that is near to many others is lowered, as it is among exact scores."""
    (query,) = mixtures(5, 1, 1)
    before = ask(source, query).places
    isolations = np.full(source.n_shapes, USUAL_ISOLATION)
    isolations[before[::2]] -= 5
    assert set(ask(source, query, isolations=isolations).places).isdisjoint(before[::2])


def test_few_shapes_are_all_compared(source):
    allowed = np.zeros(400, dtype=bool)
    allowed[::8] = True
    found = ask(source, mixtures(5, 1, 1)[0], allowed=allowed)
    assert (found.method, found.n_shapes) == ("exact", 50)
    assert found.places.tolist() == np.flatnonzero(allowed).tolist()


def test_only_allowed_shapes_are_candidates(source):
    allowed = np.arange(400) % 2 == 0
    found = ask(source, mixtures(5, 1, 1)[0], allowed=allowed)
    assert (found.method, len(found.places), found.n_shapes) == ("staged", 60, 200)
    assert allowed[found.places].all()


def test_more_are_compared_for_more_matches_and_more_shapes():
    assert n_compared(10_000, 5) == 500
    assert n_compared(3_000, 5) == 500
    assert n_compared(30_000, 5) == 867
    assert n_compared(1_000_000, 5) == 1000
    assert n_compared(10_000, 100) == 2000


def test_a_supplier_takes_the_place_of_the_scan(source):
    found = ask(source, mixtures(5, 1, 1)[0], supplier=lambda codes, count: np.array([9, 3, 3]))
    assert (found.method, found.places.tolist()) == ("candidates", [3, 9])
    allowed = np.arange(400) != 9
    found = ask(source, mixtures(5, 1, 1)[0], allowed=allowed, supplier=lambda *_: np.array([9, 3]))
    assert found.places.tolist() == [3]


class Exhaustive:
    """All products, as an engine that misses nothing."""

    def __init__(self, coarse):
        self.vectors = engines.coarse_vectors(coarse, 0, len(coarse.numbers))

    def nearest(self, queries, count):
        order = np.argsort(-(queries @ self.vectors.T), axis=1)[:, :count]
        return np.pad(order, ((0, 0), (0, 3)), constant_values=-1)


def check_engine(source, engine, coarse):
    supplier = engines.supply_from(engine, coarse)
    for query in mixtures(6, 4, 1):
        found = ask(source, query, supplier=supplier)
        assert len(found.places) <= 60
        assert nearest(source, query, found.places, 1) == nearest(source, query, np.arange(400), 1)


def test_vectors_of_an_engine_are_those_of_a_query_in_whole_steps(source):
    coarse = coarse_rows(source, RECIPE)
    vectors = engines.coarse_vectors(coarse, 10, 30).reshape(20, 3, -1)
    exact = [coarse.axes.project_query(codes) for codes in source.codes[10:30, 0]]
    assert (np.abs(vectors - exact) <= 0.501 * coarse.axes.steps.ravel()).all()


def test_an_engine_supplies_what_a_scan_finds(source):
    coarse = coarse_rows(source, RECIPE)
    check_engine(source, Exhaustive(coarse), coarse)


def test_faiss_supplies_candidates(source):
    pytest.importorskip("faiss")
    coarse = coarse_rows(source, RECIPE)
    check_engine(source, engines.FaissEngine(coarse), coarse)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")  # of the client, on its local mode
def test_qdrant_supplies_candidates(source):
    client = pytest.importorskip("qdrant_client").QdrantClient(":memory:")
    coarse = coarse_rows(source, RECIPE)
    engine = engines.QdrantEngine(client, "coarse")
    engine.fill(coarse)
    engine.fill(coarse)  # anew
    check_engine(source, engine, coarse)
    client.close()


def test_a_missing_engine_names_its_extra(source, monkeypatch):
    coarse = coarse_rows(source, RECIPE)
    for module in ("faiss", "qdrant_client"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(es.MissingExtraError, match=r"faiss must be installed.*eigenshape\[faiss\]"):
        engines.FaissEngine(coarse)
    with pytest.raises(
        es.MissingExtraError, match=r"qdrant_client must be installed.*eigenshape\[qdrant\]"
    ):
        engines.QdrantEngine(None, "coarse").fill(coarse)
