"""One state for many queries and threads; filters."""

import threading

import numpy as np
import pytest
from describers import RECIPE, descriptor

import eigenshape as es
from eigenshape.retrieval import DescribedShape


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
        ({"nothing": 1}, set()),
        ({}, set(range(10))),
    ],
)
def test_filters(index, where, wanted):
    found = index.query(descriptor(3), n_matches=100, where=where)
    assert names(found) == {f"s{seed}" for seed in wanted}
    scores = {match.name: match.score for match in index.query(descriptor(3), n_matches=100)}
    assert all(match.score == scores[match.name] for match in found)


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
        index.add_descriptors("new", [descriptor(77)])
        assert "new" not in names(reader.query(descriptor(77), n_matches=20))
        assert reader.refresh()
        assert reader.query(descriptor(77))[0].name == "new"
        assert reader.state.shapes.row(0) == before.shapes.row(0)
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
    with pytest.raises(es.StoreError, match="A reader must be open to be asked; it was closed"):
        reader.query(descriptor(1))


def test_a_refreshed_reader_is_as_a_new_one(index):
    with index.reader() as old:
        for seed in range(20, 30):
            index.add_descriptors(f"t{seed}", [descriptor(seed)], label=f"label {seed % 4}")
            if seed % 4 == 0:
                index.remove(f"t{seed}")
            old.refresh()
            with index.reader() as new:
                assert old.state.shapes.texts == new.state.shapes.texts
                assert np.array_equal(old.state.shapes.ends, new.state.shapes.ends)
                assert np.array_equal(old.state.descriptors, new.state.descriptors)
                for reader in (old, new):
                    assert reader.query(descriptor(5), n_matches=1)[0].name == "s5"


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
        snapshot = reader.snapshot(RECIPE)
        assert snapshot.n_shapes == 20  # two views of each
        place = 7
        assert np.array_equal(snapshot.rows(place), descriptor(1003).vectors.astype("<f4"))
        snapshot.verify(place)
        assert snapshot.details(place) == np.arange(2, dtype="<i8").tobytes()
        assert snapshot.names([0, 7]) == ["s0", "s3"]
        assert snapshot.labels([18]) == [None]
        assert snapshot.sources([0]) == [None]
        labels = [reader.state.shapes.labels[code] for code in snapshot.label_codes]
        assert labels == [snapshot.shape(place).label for place in range(20)]
        chosen = np.arange(10) == 3
        assert np.flatnonzero(snapshot.mask(chosen)).tolist() == [6, 7]
        assert snapshot.beside("coarse.bin").parent == index.folder


def test_a_temporary_index_is_deleted_with_its_last_reference():
    index = es.ShapeIndex.create(None)
    folder = index.folder
    index.add_descriptors("one", [descriptor(1)])
    assert folder.is_dir()
    assert index.query(descriptor(1))[0].name == "one"
    del index
    assert not folder.exists()
