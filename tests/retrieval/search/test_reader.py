"""One state for many queries and threads; filters."""

import pickle
import sqlite3
import threading
import warnings
from contextlib import closing, suppress
from dataclasses import replace

import numpy as np
import pytest
from describers import RECIPE, descriptor, keep

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import StoreError
from eigenshape._sealed import PAGE
from eigenshape.retrieval import DescribedShape
from eigenshape.retrieval.search.reader import require_maker
from eigenshape.retrieval.store import database as store


@pytest.fixture
def index(tmp_path):
    index = es.ShapeIndex.create(tmp_path / "index")
    index.add_many(
        DescribedShape(
            f"s{seed}",
            [descriptor(seed), descriptor(1000 + seed)],
            label=None if seed == 9 else f"class {seed % 3}",
            tags=["even", "small"] if seed % 2 == 0 else ["small"],
            attributes={"seed": seed, "word": "abc"[seed % 3]},
        )
        for seed in range(10)
    )
    return index


def names(matches):
    return {match.name for match in matches}


@pytest.mark.parametrize(
    ("where", "wanted"),
    [
        ({"label": "class 1"}, {1, 4, 7}),
        ({"label": None}, {9}),
        ({"label": ["class 1", None]}, {1, 4, 7, 9}),
        ({"tag": "even"}, {0, 2, 4, 6, 8}),
        ({"tag": ["even", "none"], "seed": (3, None)}, {4, 6, 8}),
        ({"seed": (None, 1.5)}, {0, 1}),
        ({"seed": (2, 4)}, {2, 3, 4}),
        ({"seed": [2, 4.0]}, {2, 4}),
        ({"seed": 3}, {3}),
        ({"word": "b", "label": "class 1"}, {1, 4, 7}),
        ({"word": (0, 1)}, set()),
        ({"tag!=": "even"}, {1, 3, 5, 7, 9}),
        ({"label!=": ["class 0", "class 1"]}, {2, 5, 8, 9}),
        ({"seed!=": (1, 8), "seed": (0, 8)}, {0}),
        ({}, set(range(10))),
    ],
)
def test_filters(index, where, wanted):
    found = index.query(descriptor(3), n_matches=100, where=where)
    assert names(found) == {f"s{seed}" for seed in wanted}
    scores = {match.name: match.score for match in index.query(descriptor(3), n_matches=100)}
    assert all(match.score == scores[match.name] for match in found)


def test_an_attribute_that_no_shape_has_is_refused_with_those_there_are(index):
    for where in ({"sead": 1}, {"seed": 1, "sead!=": 1}):
        message = "no shape has 'sead'. The attributes are: seed, word"
        with pytest.raises(es.InvalidParameterError, match=message):
            index.query(descriptor(3), where=where)
        with pytest.raises(es.InvalidParameterError, match=message):
            index.records(where=where)
    part = es.ShapeIndex.create(None)
    keep(part, "other", [descriptor(2)])
    folders = [index.folder, part.folder]  # of several indexes, one may lack it
    found = es.retrieval.query_indexes(descriptor(3), folders, where={"seed!=": (1, 9)})
    assert names(found) == {"s0", "other"}


def test_conditions_that_are_none(index):
    for where in ({"seed": {1}}, {"seed": None}, {"tag": [None]}, {"seed": True}):
        with pytest.raises(es.InvalidParameterError, match="A filter gives for each key a text"):
            index.query(descriptor(3), where=where)


def test_facts_that_cannot_be_stored(index):
    def add(**facts):
        index.add_many([DescribedShape("new", [descriptor(1)], **facts)])

    with pytest.raises(es.InvalidParameterError, match="An attribute must be a text or a finite"):
        add(attributes={"a": float("nan")})
    with pytest.raises(es.InvalidParameterError, match="An attribute must be a text or a finite"):
        add(attributes={"a": True})
    with pytest.raises(es.InvalidParameterError, match="An attribute may have any name but label"):
        add(attributes={"tag": 1})
    with pytest.raises(es.InvalidParameterError, match="tags must be a list of texts; it is 'a'"):
        add(tags="a")
    with pytest.raises(es.InvalidParameterError, match="A thumbnail must have at most 8192 bytes"):
        add(thumbnail=bytes(8193))
    assert len(index) == 10
    add(attributes={"a": np.float64(0.5), "b": np.int64(2)}, tags=["z", "a", "a"])
    record = next(record for record in index.records() if record.name == "new")
    assert (record.tags, record.attributes) == (("a", "z"), {"a": 0.5, "b": 2})


def test_a_reader_keeps_its_state_until_it_is_refreshed(index):
    with index.reader() as reader:
        assert not reader.refresh()
        before = reader.state
        keep(index, "new", [descriptor(77)])
        assert "new" not in names(reader.query(descriptor(77), n_matches=20))
        assert reader.refresh()
        assert reader.query(descriptor(77))[0].name == "new"
        assert reader.state is not before
        index.remove("s3", "new")
        index.compact()
        assert reader.query(descriptor(77))[0].name == "new"
        assert reader.refresh()
        assert names(reader.query(descriptor(77), n_matches=20)) == {
            f"s{seed}" for seed in range(10) if seed != 3
        }
        assert repr(reader) == f"IndexReader({str(index.folder)!r}, 9 shapes)"
        assert reader.default_recipe() == RECIPE
    assert repr(reader) == "IndexReader(closed)"
    with pytest.raises(es.StoreError, match="A reader must be open to be queried; it was closed"):
        reader.query(descriptor(1))


def check_refreshed(index, old):
    with index.reader() as new:
        assert np.array_equal(old.state.descriptors, new.state.descriptors)
        assert list(old.state.every()) == list(new.state.every())
        for reader in (old, new):
            assert reader.query(descriptor(5), n_matches=1)[0].name == "s5"


def test_a_refreshed_reader_is_as_a_new_one(index):
    with index.reader() as old:
        for seed in range(20, 30):
            keep(index, f"t{seed}", [descriptor(seed)], label=f"label {seed % 4}")
            if seed % 4 == 0:
                index.remove(f"t{seed}")
            old.refresh()
            check_refreshed(index, old)


def test_a_refresh_after_all_kinds_of_changes(index):
    def change(number):
        if number == 0:
            index.remove("s0", "s3", "s9")
        if number == 1:  # one is changed that was there, one is new, one comes and goes
            index.update([replace(index.records()[0], label="other", tags=("new",))])
            keep(index, "t1", [descriptor(51)], digest="1")
            keep(index, "t2", [descriptor(52)])
            index.remove("t2")
        if number == 2:  # one gains a recipe, another is replaced
            other = replace(RECIPE, name="other")
            keep(index, "t1", [descriptor(51, other)], digest="1")
            new = DescribedShape("s1", [descriptor(61), descriptor(62)], digest="2", label="new")
            index.add_many([new], replace=True)
        if number == 3:
            index.remove(*(record.name for record in index.records() if record.name != "s5"))

    for number in range(4):
        with index.reader() as reader:
            change(number)
            assert reader.refresh()
            check_refreshed(index, reader)
            assert not reader.refresh()


def test_a_refresh_reads_what_was_added_alone(index, monkeypatch):
    asked, whole_integers = [], store._whole_integers

    def watch(database, source, last):
        asked.append((source, last))
        return whole_integers(database, source, last)

    monkeypatch.setattr(store, "_whole_integers", watch)
    with index.reader() as reader:
        keep(index, "new", [descriptor(71)])
        reader.refresh()
        index.remove("new")
        reader.refresh()
    by = "INDEXED BY integers"
    assert asked == [(by, 0), (by, 20), (by, 21), (by, 0)]


def test_many_threads_see_whole_states_alone(index):
    """A writer replaces two shapes at once: a query never sees one of them old and one new."""
    failures, stop = [], threading.Event()

    def replace(number):
        index.add_many(
            [
                DescribedShape(name, [descriptor(number)], digest=str(number), label=str(number))
                for name in ("left", "right")
            ],
            replace=True,
        )

    replace(100)
    with index.reader() as reader:

        def ask():
            while not stop.is_set():
                reader.refresh()
                found = reader.query(descriptor(1), n_matches=100)
                labels = {match.label for match in found if match.name in ("left", "right")}
                if len(labels) != 1 or len(found) != 12:
                    failures.append(found)

        threads = [threading.Thread(target=ask) for _ in range(4)]
        for thread in threads:
            thread.start()
        for number in range(101, 116):
            replace(number)
            if number % 5 == 0:
                index.compact()
        stop.set()
        for thread in threads:
            thread.join()
    assert not failures


def test_a_snapshot_gives_what_search_needs(index):
    with index.reader() as reader:
        found = reader.snapshot(RECIPE)
        assert found.n_shapes == 20  # two views of each
        place = 7
        for checked in (False, True):
            every = found.rows_of(np.arange(20), checked=checked)
            assert np.array_equal(every[place], descriptor(1003).vectors.astype("<f4"))
        assert reader.snapshot(RECIPE) is found
        assert found.descriptor(place).vertices.tolist() == [0, 1]
        facts = found.facts(np.array([0, 7, 18]))
        assert [each.name for each in facts] == ["s0", "s3", "s9"]
        assert [each.label for each in facts] == ["class 0", "class 0", None]
        labels, codes = reader.state.labels
        assert [labels[code] for code in codes[[0, 3, 9]]] == ["class 0", "class 0", None]
        assert np.flatnonzero(found.shape_of == facts[1].id).tolist() == [6, 7]
        assert found.beside("coarse.bin").parent == index.folder


def test_one_shape_is_read_without_the_others(index, monkeypatch):
    picture = es.retrieval.draw_thumbnail(es.make_creature("fish", n_vertices=500))
    views = [descriptor(71), descriptor(72)]
    index.add_many([DescribedShape("new", views, thumbnail=picture)])
    monkeypatch.setattr(store, "_whole_integers", lambda *_: pytest.fail("all was read"))
    found = index.descriptors("new", RECIPE)
    assert [each.vectors.tolist() for each in found] == [
        each.vectors.astype("<f4").tolist() for each in views
    ]
    assert index.thumbnail("new") == picture
    assert index.thumbnail("s1") is None


@pytest.mark.parametrize("table", ["shape", "descriptor"])
def test_a_damaged_bit_never_hides_a_descriptor_of_one_shape(index, table):
    """Flip bits of the indexes of SQLite by which one shape is found."""
    path = index.folder / "index.sqlite"
    with closing(sqlite3.connect(path)) as database:
        query = "SELECT rootpage FROM sqlite_master WHERE name = ?"
        (page,) = database.execute(query, (f"sqlite_autoindex_{table}_1",)).fetchone()
    data = path.read_bytes()
    truth = [each.vectors.tolist() for each in index.descriptors("s4", RECIPE)]
    start = (page - 1) * PAGE
    used = start + np.flatnonzero(np.frombuffer(data, np.uint8, PAGE, start))
    rng, n_right = np.random.default_rng(0), 0
    for place in rng.choice(used, min(len(used), 60), replace=False).tolist():
        spoilt = bytearray(data)
        spoilt[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(spoilt)
        with warnings.catch_warnings(), suppress(es.StoreError):
            warnings.simplefilter("ignore")
            assert [each.vectors.tolist() for each in index.descriptors("s4", RECIPE)] == truth
            n_right += 1
    assert n_right > 30


def test_a_temporary_index_is_deleted_with_its_last_reference():
    index = es.ShapeIndex.create(None)
    folder = index.folder
    keep(index, "one", [descriptor(1)])
    assert folder.is_dir()
    assert index.query(descriptor(1))[0].name == "one"
    del index
    assert not folder.exists()


@pytest.mark.parametrize("engine", ["faiss", 3, int, np.eye(3)], ids=str)
def test_what_makes_no_engine_is_refused_before_any_query(engine):
    with pytest.raises(InvalidParameterError, match="engine must be a function that takes Coarse"):
        require_maker(engine)


def test_a_reader_refuses_what_makes_no_engine_when_it_is_opened(index):
    with pytest.raises(InvalidParameterError, match=r"it is a type\. Pass es\.retrieval"):
        index.reader(int)


def test_a_reader_that_is_pickled_opens_the_index_again(index):
    with index.reader() as reader:
        index.remove("s0")
        with pickle.loads(pickle.dumps(reader)) as another:
            assert (len(reader), len(another)) == (10, 9)
            assert another.query(descriptor(1), n_matches=1)[0].name == "s1"
    with pytest.raises(StoreError, match="it was closed"):
        pickle.dumps(reader)
