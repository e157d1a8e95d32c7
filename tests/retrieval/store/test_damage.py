"""What is damaged is named and left out, and the rest is answered as before: flipped bits and torn files."""

import shutil
import sqlite3
from contextlib import closing

import numpy as np
import pytest
import store_trials
from describers import RECIPE, descriptor, keep, spoil
from store_trials import FILES, LONG, RESERVE, SHARED

import eigenshape as es
from eigenshape._sealed import PAGE
from eigenshape.retrieval import DescribedShape
from eigenshape.retrieval.store import database as store
from eigenshape.retrieval.store.state import read_state


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """Return an index of two recipes whose database has inner pages, with changes in its log."""
    return store_trials.make_sound(tmp_path_factory.mktemp("sound"))


@pytest.fixture(scope="module")
def expected(sound, tmp_path_factory):
    folder = shutil.copytree(sound, tmp_path_factory.mktemp("expected") / "index")
    found, said = store_trials.outcome(folder)
    assert said == ""
    assert len(found) == 41
    return found


@pytest.mark.parametrize("name", FILES)
def test_a_flipped_bit_is_named_and_the_rest_is_served(sound, expected, tmp_path, name):
    shares = store_trials.try_flips(sound, expected, tmp_path, name, 12)
    assert (len(shares) == 0) == (name == SHARED)


@pytest.mark.sweep
@pytest.mark.long
def test_hundreds_of_flipped_bits_are_named_and_the_rest_is_served(sound, expected, tmp_path):
    shares = store_trials.try_flips(sound, expected, tmp_path, "index.sqlite", 300, seed=1)
    assert len(shares) > 50
    assert np.mean(shares) > 0.8
    assert shares.count(0.0) <= 10  # of the text of the tables, by which SQLite reads the others


@pytest.mark.parametrize("name", ["index.sqlite", "index.sqlite-wal"])
def test_a_torn_file_is_named_and_the_rest_is_served(sound, expected, tmp_path, name):
    data = (sound / name).read_bytes()
    for length in np.linspace(0, len(data) - 1, 6).astype(int).tolist():
        where = (tmp_path / "spoilt", name, data[:length], f"end at {length}")
        share = store_trials.share_served(sound, expected, *where)
        # The last pages of the database may be in its log already, or empty
        assert share is not None or name == "index.sqlite"


@pytest.fixture
def index(sound, tmp_path):
    return es.ShapeIndex(shutil.copytree(sound, tmp_path / "index"))


def named(number):
    return f"shape {number}{LONG}"


def test_verify_names_shapes(index, tmp_path):
    assert index.verify().damages == ()
    spoil(index.folder, "UPDATE descriptor SET rows = zeroblob(24) WHERE id = 1")
    spoil(index.folder, "UPDATE descriptor SET details = x'00' WHERE id = 2")
    spoil(index.folder, "UPDATE picture SET data = x'00' WHERE id = 3")
    spoil(index.folder, "UPDATE shape SET label = 'other' WHERE id = 5")
    spoil(index.folder, "UPDATE descriptor SET view = 7 WHERE id = 6")
    damages = index.verify().damages
    assert {damage.file for damage in damages} == {"index.sqlite"}
    assert {damage.shape for damage in damages} >= {*map(named, (0, 1, 2)), None}
    texts = " ".join(map(str, damages))
    for part in ("its rows differ", "its details differ", "its picture", "row 5 of table shape"):
        assert part in texts
    assert "1 of 41 rows of table descriptor are lost" in texts
    index.compact()  # moves pages as they are
    rest = es.ShapeIndex.create(tmp_path / "rest")
    with pytest.warns(es.retrieval.StoreWarning, match="differ"):
        assert rest.merge([index]) == 36
    assert rest.verify().damages == ()


def test_rows_that_are_lost_are_counted(index):
    spoil(index.folder, "DROP TRIGGER shape_delete")
    spoil(index.folder, "DELETE FROM shape WHERE id = 12")
    with pytest.warns(es.retrieval.StoreWarning, match="row 12 of table shape is lost"):
        names = {record.name for record in index.records()}
    assert named(11) not in names
    assert len(names) == 40
    assert any("table shape has 40 rows of 41" in damage.what for damage in index.verify().damages)


def test_a_damaged_seal_is_named(index):
    spoil(index.folder, "UPDATE seal SET total = 0 WHERE name = 'shape'")
    with pytest.warns(es.retrieval.StoreWarning, match="the seal of table shape differs"):
        assert len(index.records()) == 41
    with pytest.raises(es.StoreError, match="must hold what was written; the seal of shape differ"):
        index.remove("late")


def test_a_damaged_recipe_is_named(index):
    spoil(index.folder, "UPDATE recipe SET codebook = x'00' WHERE id = 2")
    with pytest.warns(es.retrieval.StoreWarning, match="recipe 2 differs from its checksum"):
        assert index.query(descriptor(3), n_matches=1)[0].score == 0
    with pytest.raises(es.StoreError, match="An index must be whole to be changed; "):
        keep(index, "new", [descriptor(1)])


def test_integers_of_a_descriptor_are_checked_where_it_is_used(index):
    """A flipped bit may lie in the table alone, and not in the list of integers that is read first."""
    spoil(index.folder, "UPDATE descriptor SET view = 7 WHERE id = 6")
    state = read_state(index.folder)
    assert [len(each.rows) > 0 for each in state.stored([5, 7])] == [True, True]
    with pytest.raises(es.StoreError, match="its row differs from its checksum"):
        state.stored([6])


def described_again(seed):
    return DescribedShape(named(seed), [descriptor(seed)], digest=64 * "d", thumbnail=b"picture")


@pytest.mark.parametrize(
    "query",
    [
        "UPDATE descriptor SET rows = zeroblob(24) WHERE id = 1",
        "UPDATE descriptor SET details = x'00' WHERE id = 1",
        "UPDATE picture SET data = x'00' WHERE id = 1",
        "UPDATE shape SET label = 'other' WHERE id = 1",
    ],
)
def test_a_damaged_shape_that_is_added_again_is_written_anew(index, query):
    spoil(index.folder, query)
    assert len(index.verify().damages) == 1
    index.add_many([described_again(1)])
    assert len(index.verify().damages) == 1, "a whole shape of the same digest is kept as it is"
    index.add_many([described_again(0), described_again(0)])
    assert index.verify().damages == ()
    assert (len(index), index.query(descriptor(0), n_matches=1)[0].score) == (41, 0)
    assert index.thumbnail(named(1)) != b"picture"
    assert index.thumbnail(named(0)) == b"picture"


def test_a_damaged_list_of_integers_is_made_up_for_by_the_table(index):
    """The index of SQLite from which a reader takes the integers of all descriptors."""
    index.compact()  # so that nothing is in the log
    path = index.folder / store.DATABASE
    with closing(sqlite3.connect(path)) as database:
        query = "SELECT rootpage FROM sqlite_master WHERE name = 'integers'"
        start = PAGE * (database.execute(query).fetchone()[0] - 1)
    data = bytearray(path.read_bytes())
    data[start] ^= 255
    path.write_bytes(data)
    assert len(index.query(descriptor(3), n_matches=100)) == 40
    damages = index.verify().damages
    assert {damage.file for damage in damages} == {store.DATABASE}
    assert any(damage.shape is None for damage in damages)


def test_every_file_of_an_index_is_tried(sound):
    files = {path.name for path in sound.iterdir() if path.stat().st_size}
    assert files == {*FILES, RESERVE}
    assert descriptor(3).recipe == RECIPE
