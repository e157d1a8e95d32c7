"""The copy of the tables: it changes no answer, whatever happens to it."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest
from describers import descriptor

import eigenshape as es
from eigenshape.retrieval import DescribedShape
from eigenshape.retrieval.store import kept_tables, snapshot
from eigenshape.retrieval.store.catalog import FORMAT
from eigenshape.retrieval.store.kept_tables import TABLES_FILE, open_state
from eigenshape.retrieval.store.snapshot import read_state

N_SHAPES = 100


@pytest.fixture
def index(tmp_path, monkeypatch):
    monkeypatch.setattr(kept_tables, "FEWEST_TO_KEEP", 50)
    return make_index(tmp_path / "index")


def make_index(folder):
    index = es.ShapeIndex.create(folder)
    index.add_many(
        DescribedShape(f"s{seed}", [descriptor(seed)], label=f"class {seed % 3}")
        for seed in range(N_SHAPES)
    )
    return index


def check_opened(index, n_read):
    now, truth = open_state(index.folder), read_state(index.folder)
    assert now.n_read == n_read
    assert now.damages == truth.damages == ()
    assert now.shapes.texts == truth.shapes.texts
    for name in ("ids", "ends", "pictures"):
        assert np.array_equal(getattr(now.shapes, name), getattr(truth.shapes, name))
    assert np.array_equal(now.descriptors, truth.descriptors)
    labels = [
        [each.labels[code] for code in each.label_codes] for each in (now.shapes, truth.shapes)
    ]
    assert labels[0] == labels[1]
    name = now.shapes.row(50).name
    assert index.query(descriptor(int(name[1:])), n_matches=1)[0].name == name


def test_an_index_is_opened_by_the_copy(index, monkeypatch):
    check_opened(index, N_SHAPES)
    monkeypatch.setattr(snapshot, "read_table", only_short_tables(snapshot.read_table))
    assert len(index.records()) == N_SHAPES
    with index.reader() as reader:
        assert len(reader) == N_SHAPES
        assert not reader.refresh()


def only_short_tables(read_table):
    def read(database, seal, damages):
        assert seal.id in ("recipe", "file")
        return read_table(database, seal, damages)

    return read


def test_it_is_written_again_when_many_shapes_have_changed(index):
    open_state(index.folder)
    written = (index.folder / TABLES_FILE).read_bytes()
    index.remove("s3")
    index.add_descriptors("s200", [descriptor(200)])
    for _ in range(2):
        check_opened(index, 2)
    assert (index.folder / TABLES_FILE).read_bytes() == written
    index.remove(*(f"s{number}" for number in range(10, 20)))
    check_opened(index, 12)
    assert (index.folder / TABLES_FILE).read_bytes() != written
    check_opened(index, 0)
    index.compact()
    check_opened(index, 90)
    check_opened(index, 0)


def test_that_of_another_index_is_not_used(index, tmp_path):
    open_state(index.folder)
    other = make_index(tmp_path / "other")
    other.remove("s7")
    other.add_descriptors("s300", [descriptor(300)])
    (other.folder / TABLES_FILE).write_bytes((index.folder / TABLES_FILE).read_bytes())
    index.remove("s8")
    index.add_descriptors("s400", [descriptor(400)])
    check_opened(other, 2)
    open_state(index.folder)
    index.remove(*(f"s{number}" for number in range(20, 40)))
    open_state(index.folder)
    (other.folder / TABLES_FILE).write_bytes((index.folder / TABLES_FILE).read_bytes())
    check_opened(other, N_SHAPES)
    check_opened(other, 0)


@pytest.mark.parametrize("damage", ["cut", "empty", "other", "older"])
def test_a_damaged_copy_is_made_again(index, damage):
    open_state(index.folder)
    path = index.folder / TABLES_FILE
    data = path.read_bytes()
    older = data.replace(b"[%d, [[" % FORMAT, b"[5, [[")
    path.write_bytes({"cut": data[:-9], "empty": b"", "other": b"no", "older": older}[damage])
    check_opened(index, N_SHAPES)
    check_opened(index, 0)


def test_a_damaged_bit_of_the_copy_changes_no_answer(index):
    truth = open_state(index.folder)
    path = index.folder / TABLES_FILE
    data, n_used = path.read_bytes(), 0
    rng = np.random.default_rng(0)
    for place in rng.choice(len(data), 100, replace=False).tolist():
        spoilt = bytearray(data)
        spoilt[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(spoilt)
        now = open_state(index.folder)
        n_used += now.n_read == 0
        assert now.shapes.texts == truth.shapes.texts
        assert np.array_equal(now.descriptors, truth.descriptors)
    assert n_used < 30  # of bits that no one reads


def test_damage_of_the_database_is_found_by_verify(index):
    open_state(index.folder)
    with closing(sqlite3.connect(index.folder / "index.sqlite")) as database:
        database.execute("UPDATE shape SET label = 'wrong' WHERE name = 's5'")
        database.commit()
    assert index.query(descriptor(5), n_matches=1)[0].label == "class 2"
    (damage, *_) = index.verify().damages
    assert damage.shape == "s5"


def test_a_small_index_has_none(tmp_path):
    index = make_index(tmp_path / "index")
    assert open_state(index.folder).n_read == N_SHAPES
    assert not (index.folder / TABLES_FILE).exists()


def test_a_folder_that_cannot_be_written_to_is_read(index, monkeypatch):
    def refuse(*_):
        raise OSError("read-only")

    monkeypatch.setattr(kept_tables, "_write", refuse)
    check_opened(index, N_SHAPES)
