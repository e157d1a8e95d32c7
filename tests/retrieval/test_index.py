import json
import os
import shutil
import signal
import sqlite3
import tempfile
import threading
import time
import warnings
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import writer
from describers import RECIPE, descriptor, keep, spoil
from hypothesis import given, settings
from hypothesis import strategies as st

from certeig.kit.errors import InvalidParameterError
from eigenshape import _sealed
from eigenshape._errors import StoreError
from eigenshape._sealed import PAGE, checksum
from eigenshape.retrieval.heat.recipe import HeatRecipe
from eigenshape.retrieval.heat.score import HeatDescriptor, matching_score
from eigenshape.retrieval.index import ShapeIndex
from eigenshape.retrieval.store import database as store
from eigenshape.retrieval.store.damage import StoreWarning
from eigenshape.retrieval.store.writing import DescribedShape, Writer, described
from eigenshape.shapes import icosphere, make_creature

OTHER = replace(RECIPE, name="other", scales=tuple(float(2**step) for step in range(40)))


@pytest.fixture
def index(tmp_path):
    return ShapeIndex.create(tmp_path / "index")


def rounded(shape):
    return HeatDescriptor(shape.vectors.astype("<f4").astype(float), shape.vertices, shape.recipe)


def test_a_shape_finds_itself_first_with_score_zero(index):
    for seed in range(12):
        keep(
            index,
            f"s{seed:02}",
            [descriptor(seed)],
            label=f"class {seed % 3}",
            source=f"/{seed}.ply",
        )
    for seed in range(12):
        best, *others = index.query(descriptor(seed), n_matches=4)
        assert (best.name, best.score, best.label) == (f"s{seed:02}", 0.0, f"class {seed % 3}")
        assert "correspondences" not in vars(best)  # until they are asked for
        assert best.correspondences.tolist() == [[0, 0], [1, 1]]
        assert not best.correspondences.flags.writeable
        assert len(others) == 3
        assert [m.score for m in others] == sorted(m.score for m in others)


def test_scores_equal_brute_force(index):
    shapes = {f"s{seed}": descriptor(seed, m=1 + seed % 3) for seed in range(20)}
    for name, shape in shapes.items():
        keep(index, name, [shape])
    query = descriptor(99, m=3)
    found = {match.name: match.score for match in index.query(query, n_matches=50)}
    assert found == pytest.approx(
        {n: matching_score(rounded(query), rounded(s)) for n, s in shapes.items()}
    )


def test_a_shape_in_the_index_can_ask_for_its_like(index):
    keep(index, "one", [descriptor(1), descriptor(2)])
    first, second = index.descriptors("one", RECIPE)
    assert np.array_equal(first.vectors, rounded(descriptor(1)).vectors)
    assert np.array_equal(first.vertices, descriptor(1).vertices)
    assert np.array_equal(second.vectors, rounded(descriptor(2)).vectors)
    with pytest.raises(
        StoreError,
        match="A shape must be described by the requested recipe; 'two' is not described",
    ):
        index.descriptors("two", RECIPE)


def test_a_shape_is_left_out_where_it_asks_itself(index):
    for seed, name in enumerate(("one", "two")):
        keep(index, name, [descriptor(seed)])
    assert [match.name for match in index.query(descriptor(0), without="one")] == ["two"]
    assert len(index.query(descriptor(0), without="one", where={"label": "cat"})) == 0
    with pytest.raises(InvalidParameterError, match=r"without must be the name .*; 'six' is no"):
        index.query(descriptor(0), without="six")


def test_nothing_is_like_a_shape_but_itself():
    index = ShapeIndex.create(None)
    for name, mesh in {"fish": make_creature("fish", n_vertices=500), "ball": icosphere(3)}.items():
        index.add(name, mesh, label=name, n_views=0)
    (fish,) = index.descriptors("fish", index.default_recipe())
    assert not index.query(fish).nothing_alike
    others = index.query(fish, without="fish")
    assert (others.nothing_alike, list(others.classify())) == (True, ["ball"])


def test_equal_scores_are_sorted_by_name(index):
    for name in ("b", "c", "a"):
        keep(index, name, [descriptor(1)])
    assert [match.name for match in index.query(descriptor(2))] == ["a", "b", "c"]


def test_a_record_holds_several_recipes_some_of_them_long(index):
    keep(index, "one", [descriptor(1), descriptor(1, OTHER, m=500)], digest="d")
    keep(index, "two", [descriptor(2)])
    assert [record.recipes for record in index.records()] == [(RECIPE, OTHER), (RECIPE,)]
    assert [match.name for match in index.query(descriptor(1, OTHER))] == ["one"]
    assert index.query(descriptor(1, OTHER, m=500))[0].score == 0


def test_the_best_view_of_a_shape_counts(index):
    keep(index, "one", [descriptor(1), descriptor(2), descriptor(3)])
    keep(index, "two", [descriptor(4), descriptor(5)])
    for name, view, seed in (("one", 0, 1), ("one", 2, 3), ("two", 1, 5)):
        best, other = index.query(descriptor(seed))
        assert (best.name, best.view, best.score) == (name, view, 0)
        assert other.name != name


def test_the_same_digest_gains_recipes_and_keeps_the_rest(index):
    keep(index, "one", [descriptor(1)], digest="d")
    keep(index, "one", [descriptor(1), descriptor(3, OTHER)], digest="d")
    assert index.records()[0].recipes == (RECIPE, OTHER)
    with pytest.raises(
        StoreError, match="A name stands for one shape; 'one' is in the index with digest d, not e"
    ):
        keep(index, "one", [descriptor(2)], digest="e")


def test_another_digest_gives_way_where_asked(index):
    keep(index, "one", [descriptor(1), descriptor(1, OTHER)], label="old")
    keep(index, "one", [descriptor(2)], digest="d", replace=True)
    keep(index, "one", [descriptor(3)], digest="e", label="new", replace=True)
    assert [(record.label, record.digest, record.recipes) for record in index.records()] == [
        ("new", "e", (RECIPE,))
    ]
    assert index.query(descriptor(3))[0].score == 0
    keep(index, "one", [descriptor(4)], digest="e", replace=True)
    assert index.query(descriptor(3))[0].score == 0


def test_remove(index):
    for seed in range(3):
        keep(index, f"s{seed}", [descriptor(seed)])
    index.remove("s1")
    assert [record.name for record in index.records()] == ["s0", "s2"]
    assert {match.name for match in index.query(descriptor(1))} == {"s0", "s2"}
    keep(index, "s1", [descriptor(7)])
    assert index.query(descriptor(7))[0].name == "s1"
    with pytest.raises(
        StoreError, match="A shape must be in the index to be removed; 'nobody' is not"
    ):
        index.remove("nobody")


def test_shapes_whose_files_are_gone_are_pruned(index, tmp_path):
    there, gone, elsewhere = (tmp_path / name for name in ("a/there", "a/gone", "b/gone"))
    there.parent.mkdir()
    there.touch()
    for number, source in enumerate((there, gone, elsewhere)):
        keep(index, f"shape {number}", [descriptor(number)], source=str(source))
    assert index.prune(tmp_path / "a") == ["shape 1"]
    assert index.prune(tmp_path / "a") == []
    assert [record.name for record in index.records()] == ["shape 0", "shape 2"]


@settings(deadline=None, max_examples=10)
@given(st.lists(st.tuples(st.sampled_from("abcd"), st.booleans()), max_size=12))
def test_index_behaves_like_a_dict(tmp_path_factory, steps):
    index, model = ShapeIndex.create(tmp_path_factory.mktemp("model") / "index"), {}
    for number, (name, adds) in enumerate(steps):
        if adds and name not in model:
            keep(index, name, [descriptor(number)])
            model[name] = number
        elif not adds and name in model:
            index.remove(name)
            del model[name]
        assert [record.name for record in index.records()] == sorted(model)
        assert len(index) == len(model)
        assert all(index.query(descriptor(seed))[0].score == 0 for seed in model.values())


def with_vertices(shape, vertices):
    """Bypass what the constructor's types would catch in tests alone."""
    object.__setattr__(shape, "vertices", vertices)
    return shape


def test_what_cannot_be_stored(index):
    bad = descriptor(1).vectors.copy()
    bad[1, 2] = np.nan
    with pytest.raises(
        InvalidParameterError,
        match=r"finite single-precision numbers; of 'x' entry \[1, 2\] is nan",
    ):
        keep(index, "x", [HeatDescriptor(bad, np.arange(2), RECIPE)])
    with pytest.raises(InvalidParameterError, match=r"of 'x' entry \[0, 0\] is 1e\+300"):
        keep(index, "x", [HeatDescriptor(np.full((2, 3), 1e300), np.arange(2), RECIPE)])
    with pytest.raises(
        InvalidParameterError, match="A shape must have a descriptor to be found; 'x' has none"
    ):
        keep(index, "x", [])
    with pytest.raises(
        InvalidParameterError,
        match="must name one vertex a feature; of 'x' 2 features have vertices",
    ):
        keep(index, "x", [with_vertices(descriptor(1), np.arange(2)[:, None])])
    with pytest.raises(InvalidParameterError, match=r"must be Unicode text; 'b\\udcff' is not"):
        keep(index, "x", [descriptor(1)], source="b\udcff")
    for name in ("", " ", "nul\0"):
        with pytest.raises(InvalidParameterError, match="a character that shows, and no NUL"):
            keep(index, name, [descriptor(1)])
    with pytest.raises(
        InvalidParameterError,
        match="must have as many numbers; the features of recipe 'test' have 3, and these have 5",
    ):
        keep(index, "x", [descriptor(1), HeatDescriptor(np.ones((2, 5)), np.arange(2), RECIPE)])
    assert len(index) == 0


def test_rows_of_another_length_do_not_spoil_an_index(index):
    longer = HeatDescriptor(np.ones((2, 5)), np.arange(2), RECIPE)
    keep(index, "one", [descriptor(1)])
    with pytest.raises(InvalidParameterError, match="of recipe 'test' have 3, and these have 5"):
        keep(index, "two", [longer])
    with pytest.raises(InvalidParameterError, match="of recipe 'test' have 3, and these have 5"):
        index.query(longer)
    assert [match.name for match in index.query(descriptor(1))] == ["one"]


def test_what_cannot_be_asked(index):
    keep(index, "one", [descriptor(1)])
    with pytest.raises(InvalidParameterError, match=r"of 'the query' entry \[0, 0\] is nan"):
        index.query(HeatDescriptor(np.full((2, 3), np.nan), np.arange(2), RECIPE))
    with pytest.raises(InvalidParameterError, match="of 'the query' it has none"):
        index.query(HeatDescriptor(np.empty((0, 3)), np.arange(0), RECIPE))


def test_recipes_are_equal_as_values_are(index):
    keep(index, "one", [descriptor(1, replace(RECIPE, time_unit=1))])
    keep(index, "two", [descriptor(2, replace(RECIPE, time_unit=1.0))])
    assert len(index.query(descriptor(1, replace(RECIPE, time_unit=1.0)))) == 2


def test_recipes_of_other_versions(index):
    keep(index, "one", [descriptor(1, replace(RECIPE, n_modes=HeatRecipe().n_modes))])
    fields = edit_recipe(index, lambda fields: fields.pop("n_modes"))
    assert "n_modes" not in fields
    assert index.query(descriptor(1))[0].score == 0
    edit_recipe(index, lambda fields: fields.update(color="red"))
    for ask in (
        index.records,
        lambda: index.query(descriptor(1)),
        lambda: keep(index, "two", [descriptor(2)]),
    ):
        with pytest.raises(
            StoreError, match=r"must be known to this version of eigenshape; .* argument 'color'"
        ):
            ask()


def edit_recipe(index, edit):
    with store.writing(index.folder) as database:
        row = database.execute("SELECT fields, n_columns, codebook FROM recipe").fetchone()
        fields = json.loads(row[0])
        edit(fields)
        row = (1, json.dumps(fields), *row[1:])
        database.execute("DELETE FROM recipe")
        values = (*row, checksum(*row))
        database.execute("INSERT INTO recipe VALUES (?, ?, ?, ?, ?)", values)
    return fields


def test_a_query_in_a_recipe_that_is_not_there(index):
    with pytest.raises(StoreError, match="holds no shape, and HeatRecipe"):
        index.query(descriptor(1))
    keep(index, "one", [descriptor(1)])
    with pytest.raises(
        StoreError,
        match=r"must hold descriptors of the requested recipe; .* holds test, and HeatRecipe",
    ):
        index.query(descriptor(1, HeatRecipe()))
    index.remove("one")
    with pytest.raises(StoreError, match="holds no shape, and HeatRecipe"):
        index.query(descriptor(1))
    keep(index, "one", [descriptor(1)])
    with pytest.raises(InvalidParameterError, match=r"n_matches must lie in 1\.\."):
        index.query(descriptor(1), n_matches=0)


def test_folders_that_are_no_index(tmp_path, index):
    with pytest.raises(
        StoreError,
        match=r"must be an index; it has no index.sqlite. .*ShapeIndex.create, or with `eigenshape i",
    ):
        ShapeIndex.open(tmp_path)
    with pytest.raises(StoreError, match="must be empty to become an index"):
        ShapeIndex.create(index.folder)
    (tmp_path / "file").touch()
    with pytest.raises(
        StoreError, match=r"An index needs a folder; .*file cannot be made: File exists"
    ):
        ShapeIndex.create(tmp_path / "file")
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    sqlite3.connect(foreign / store.DATABASE).execute("CREATE TABLE t (x)").connection.close()
    with pytest.raises(StoreError, match="belongs to another program"):
        ShapeIndex.open(foreign)
    (foreign / store.DATABASE).write_bytes(b"no database at all" * 100)
    with pytest.raises(StoreError, match="must be a readable index; file is not a database"):
        ShapeIndex.open(foreign)
    for version, message in (
        (4, "must be an index of format 10; it is of format 4, by an older version"),
        (11, "must be an index of format 10; it is of format 11, by a newer version"),
    ):
        with closing(sqlite3.connect(index.folder / store.DATABASE)) as database:
            database.execute(f"PRAGMA user_version = {version}")
        for act in (lambda: ShapeIndex.open(index.folder), lambda: index.remove("one")):
            with pytest.raises(StoreError, match=message):
                act()


def test_a_folder_that_is_gone_does_not_come_back(index):
    shutil.rmtree(index.folder)
    for act in (
        lambda: len(index),
        lambda: keep(index, "one", [descriptor(1)]),
        lambda: index.remove("one"),
    ):
        with pytest.raises(StoreError, match=r"must be an index; it has no index.sqlite"):
            act()
    assert not index.folder.exists()


def test_of_several_creators_one_succeeds(tmp_path):
    answers, barrier = [], threading.Barrier(4)

    def create():
        barrier.wait()
        try:
            answers.append(ShapeIndex.create(tmp_path / "index"))
        except StoreError as err:
            answers.append(err)

    creators = [threading.Thread(target=create) for _ in range(4)]
    for creator in creators:
        creator.start()
    for creator in creators:
        creator.join()
    assert sum(isinstance(answer, ShapeIndex) for answer in answers) == 1
    assert sum("must be empty to become an index" in str(answer) for answer in answers) == 3
    assert len(ShapeIndex.open(tmp_path / "index")) == 0


@pytest.mark.long
def test_three_first_writers_share_one_index(tmp_path):
    for trial in range(5):
        folder = tmp_path / str(trial)
        writers = [writer.begin(writer.open_and_add, folder) for _ in range(3)]
        assert [ours.recv() for _, ours in writers] == 3 * ["ready"]
        for number, (_, ours) in enumerate(writers):
            ours.send(f"shape {number}")
        assert [ours.recv() for _, ours in writers] == 3 * ["added"]
        for process, ours in writers:
            process.join()
            ours.close()
        assert [record.name for record in ShapeIndex.open(folder).records()] == [
            "shape 0",
            "shape 1",
            "shape 2",
        ]


def test_a_folder_of_other_things_becomes_no_index(tmp_path):
    (tmp_path / "letter.txt").touch()
    with pytest.raises(StoreError, match="must be empty to become an index"):
        ShapeIndex.open_or_create(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]


def test_damaged_rows_are_named_and_the_rest_is_served(index):
    keep(index, "one", [descriptor(1)])
    keep(index, "two", [descriptor(2)])
    spoil(index.folder, "UPDATE descriptor SET rows = substr(rows, 1, 20) WHERE id = 2")
    with pytest.warns(StoreWarning, match="index.sqlite, shape 'two': its rows cannot be read"):
        assert [match.name for match in index.query(descriptor(1))] == ["one"]
    spoil(index.folder, "UPDATE descriptor SET rows = zeroblob(24) WHERE id = 2")
    with pytest.warns(StoreWarning, match="index.sqlite, shape 'two': its rows differ"):
        assert [match.name for match in index.query(descriptor(1))] == ["one"]
    with pytest.raises(
        StoreError, match=r"An index must hold what was written; index.sqlite, shape 'two': its"
    ):
        index.descriptors("two", RECIPE)
    keep(index, "three", [descriptor(3)])
    spoil(index.folder, "UPDATE descriptor SET details = zeroblob(2) WHERE id = 3")
    with pytest.warns(StoreWarning, match="shape 'three': its details differ"):
        assert [match.name for match in index.query(descriptor(3), n_matches=1)] == ["one"]
    index.remove("three")
    spoil(index.folder, "UPDATE descriptor SET view = 'x' WHERE id = 1")
    with pytest.warns(StoreWarning, match="1 of 2 rows of table descriptor are lost"):
        index.records()
    spoil(index.folder, "DELETE FROM descriptor WHERE id = 1")
    with pytest.raises(StoreError, match="1 of its descriptors are lost"):
        index.descriptors("one", RECIPE)


def test_a_reader_leaves_out_what_is_damaged_once(index):
    for seed in range(5):
        keep(index, f"s{seed}", [descriptor(seed)])
    spoil(index.folder, "UPDATE descriptor SET rows = zeroblob(24) WHERE id = 2")
    with index.reader() as reader:
        with pytest.warns(StoreWarning, match="shape 's1': its rows differ"):
            found = reader.query(descriptor(1), n_matches=5)
        assert (len(found), found.n_shapes, found.n_compared) == (4, 4, 4)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert len(reader.query(descriptor(1), n_matches=5)) == 4


def test_numbers_that_became_infinite_are_named(index):
    keep(index, "one", [descriptor(1)])
    keep(index, "two", [descriptor(2)])
    spoil(index.folder, "UPDATE descriptor SET rows = x'0000c07f' || substr(rows, 5) WHERE id = 1")
    with pytest.warns(StoreWarning, match="shape 'one': its rows "):
        assert [match.name for match in index.query(descriptor(2))] == ["two"]


def test_a_copy_without_its_log_is_named(index, tmp_path):
    keep(index, "one", [descriptor(1)])
    with closing(sqlite3.connect(index.folder / store.DATABASE)) as reader:
        reader.execute("BEGIN")
        reader.execute("SELECT * FROM shape").fetchone()
        keep(index, "two", [descriptor(2)])
        whole = shutil.copytree(index.folder, tmp_path / "whole")
        part = shutil.copytree(
            index.folder, tmp_path / "part", ignore=shutil.ignore_patterns("*-wal")
        )
    assert len(ShapeIndex.open(whole)) == 2
    lost = r"index.sqlite-wal: \d of \d changes that were committed are lost"
    with pytest.warns(StoreWarning, match=lost):
        assert [record.name for record in ShapeIndex.open(part).records()] == ["one"]
    with pytest.raises(StoreError, match="An index must be whole to be changed; index"):
        keep(ShapeIndex(part), "three", [descriptor(3)])
    rest = ShapeIndex.create(tmp_path / "rest")
    with pytest.warns(StoreWarning, match=lost):
        assert rest.merge([ShapeIndex(part)]) == 1
    (whole / store.INDEX.changes).unlink()
    assert len(ShapeIndex.open(whole).records()) == 2


def test_a_second_writer_is_told(index, monkeypatch):
    monkeypatch.setattr(_sealed, "LONGEST_WAIT", 0.05)
    with (
        store.writing(index.folder),
        pytest.raises(
            StoreError, match=r"one writer at a time; another process has held .* 0.05 s"
        ),
    ):
        keep(index, "one", [descriptor(1)])
    keep(index, "one", [descriptor(1)])
    assert len(index) == 1


def test_a_database_that_cannot_be_written(index):
    spoil(index.folder, "DROP TABLE shape")
    with pytest.raises(StoreError, match="must be a readable index; no such table"):
        keep(index, "one", [descriptor(1)])


def test_a_damaged_list_of_names_is_named(index):
    keep(index, "one", [descriptor(1)])
    path = index.folder / store.DATABASE
    with closing(sqlite3.connect(path)) as database:
        query = "SELECT rootpage FROM sqlite_master WHERE name = 'sqlite_autoindex_shape_1'"
        start = PAGE * (database.execute(query).fetchone()[0] - 1)
    data = path.read_bytes()
    page = data[start : start + PAGE].replace(b"one", b"two")
    path.write_bytes(data[:start] + page + data[start + PAGE :])
    with pytest.raises(StoreError, match="must lead from 'two' to its shape; it leads to 'one'"):
        index.remove("two")
    assert len(index.descriptors("one", RECIPE)) == 1  # by a look at all rows


def test_a_failed_add_leaves_the_state_before(index):
    keep(index, "one", [descriptor(1)])
    with closing(sqlite3.connect(index.folder / store.DATABASE)) as database:
        (n_pages,) = database.execute("PRAGMA page_count").fetchone()
    connect = _sealed.connect

    def small(folder, mode):
        database = connect(folder, mode)
        database.execute(f"PRAGMA max_page_count = {n_pages}")
        return database

    large = HeatDescriptor(np.ones((9000, 3)), np.arange(9000), RECIPE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_sealed, "connect", small)
        message = "needs space on its disk; .*: database or disk is full. Nothing was changed"
        with pytest.raises(StoreError, match=message):
            index.add_many([DescribedShape("two", [descriptor(2)]), DescribedShape("x", [large])])
    assert [record.name for record in index.records()] == ["one"]
    keep(index, "two", [descriptor(2)])
    assert index.query(descriptor(2))[0].score == 0


def test_readers_work_while_one_writes(index):
    keep(index, "s-1", [descriptor(1000)])
    failures, stop = [], threading.Event()

    def read():
        while not stop.is_set():
            names = [match.name for match in index.query(descriptor(1000), n_matches=100)]
            if names[0] != "s-1" or len(set(names)) != len(names):
                failures.append(names)

    readers = [threading.Thread(target=read) for _ in range(2)]
    for reader in readers:
        reader.start()
    for seed in range(30):
        keep(index, f"s{seed}", [descriptor(seed)])
    stop.set()
    for reader in readers:
        reader.join()
    assert not failures
    assert len(index) == 31


@pytest.fixture
def open_folder():
    """Return a folder that other users can reach, as those of pytest are not."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        yield Path(name)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="rights are a Unix thing")
@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_reading_needs_no_right_to_write(index, open_folder):
    keep(index, "one", [descriptor(1)])
    reader = sqlite3.connect(index.folder / store.DATABASE)
    reader.execute("SELECT count(*) FROM shape").fetchone()
    keep(index, "two", [descriptor(2)])  # stays in the log as long as somebody reads
    shutil.copytree(index.folder, open_folder / "with log", ignore=shutil.ignore_patterns("*-shm"))
    reader.close()
    shutil.copytree(index.folder, open_folder / "whole")
    with read_only(open_folder / "whole") as folder:
        assert {match.name for match in ShapeIndex.open(folder).query(descriptor(1))} == {
            "one",
            "two",
        }
        with pytest.raises(StoreError, match="An index can change only in a writable folder"):
            ShapeIndex.open(folder).remove("one")
    with (
        read_only(open_folder / "with log") as folder,
        pytest.raises(
            StoreError, match=r"must be writable to be read as long as index\.sqlite-wal holds"
        ),
    ):
        ShapeIndex.open(folder)


@contextmanager
def read_only(folder):
    for path in folder.iterdir():
        path.chmod(0o444)
    folder.chmod(0o555)
    try:
        yield folder
    finally:
        folder.chmod(0o755)


def killed_at_random(work, folder, rng):
    """Kill a process in the midst of a step; the number of the last step that it called done."""
    process, done = writer.begin(work, folder)
    number = [done.recv() for _ in range(rng.integers(1, 4))][-1]
    time.sleep(rng.uniform(0.0, 0.02))
    process.kill()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    with suppress(EOFError, OSError):  # the last message may be cut short
        while True:
            number = done.recv()
    return number


kills = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kill -9 is a Unix thing")


@pytest.mark.long
@kills
def test_a_killed_writer_leaves_the_state_before_or_after(index):
    rng = np.random.default_rng(0)
    for _ in range(20):
        done = killed_at_random(writer.add_shapes, index.folder, rng)
        names = [record.name for record in index.records()]
        assert names == [f"shape-{number:05}" for number in range(len(names))]
        assert (
            done + 1 <= len(names) <= done + 2
        )  # all that was called done, and at most the one under way
        for number in {0, len(names) - 1} if names else ():
            assert index.query(descriptor(number))[0].name == f"shape-{number:05}"
    assert len(names) > 10


@kills
def test_a_killed_replacement_leaves_the_old_shape_or_the_new(index):
    rng = np.random.default_rng(1)
    keep(index, "one", [descriptor(0)], digest="0")
    for _ in range(20):
        done = killed_at_random(writer.replace_a_shape, index.folder, rng)
        (record,) = index.records()
        assert int(record.digest) in (done, done + 1)
        (match,) = index.query(descriptor(int(record.digest)))
        assert match.score == 0
    assert done > 10


@pytest.mark.long
@kills
def test_a_killed_creator_leaves_an_index_or_a_place_for_one(tmp_path):
    rng = np.random.default_rng(2)
    for _ in range(20):
        done = killed_at_random(writer.create_many, tmp_path, rng)
        assert done < 0 or (tmp_path / str(done) / store.DATABASE).is_file()
    folders = list(tmp_path.iterdir())
    assert len(folders) > 10
    for folder in folders:
        index = ShapeIndex.open_or_create(folder)
        keep(index, "one", [descriptor(1)])
        assert len(index) == 1


def test_what_a_stopped_block_wrote_is_gone(index):
    with pytest.raises(KeyboardInterrupt), store.writing(index.folder) as database:
        _write_and_stop(index, database)
    assert index.records() == []


def _write_and_stop(index, database):
    Writer(index.folder, database).add(
        described(DescribedShape("x", [descriptor(1)])), replace=False
    )
    raise KeyboardInterrupt
