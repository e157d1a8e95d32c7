import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
import warnings
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from describers import RECIPE, SPOIL_ROWS, mesh_of, read_and_count, read_by_content, spoil
from filelock import FileLock

import eigenshape
from certeig.kit.errors import CerteigError, InvalidParameterError
from eigenshape import _workers
from eigenshape._workers import Item, Outcome, Workers, run_in_workers
from eigenshape.retrieval.building.batch import (
    build_index,
    content_digest,
    train_codebook_from_files,
)
from eigenshape.retrieval.index import ShapeIndex
from eigenshape.retrieval.kinds import describe
from eigenshape.retrieval.patches.descriptor import PatchRecipe


@pytest.fixture
def index(tmp_path):
    return ShapeIndex.create(tmp_path / "index")


def items(folder, **contents):
    for name, word in contents.items():
        (folder / name).write_text(word)
    return [Item(name, folder / name, "label") for name in contents]


def build(index, todo, timeout=60.0, callback=None):
    return build_index(
        index,
        todo,
        read_by_content,
        recipes=(RECIPE,),
        n_views=0,
        workers=Workers(2, timeout),
        callback=callback,
    )


def nearest(index, number):
    return index.query(describe(mesh_of(number), RECIPE))[0]


BAD = {
    "raise": "A face must have area; face 3 has none.",
    "die": "it ended its process with exit code 77",
    "hang": "it took more than 20 s",
    "pickle badly": "PicklesBadlyError: pickle badly and more",
    "nothing": (
        "mesh must be a triangle mesh; it is None. Pass a TriangleMesh, a trimesh.Trimesh, "
        "a pyvista.PolyData of triangles, or a pair (vertices, faces)."
    ),
    "loose": (
        "Every vertex must belong to a face; vertex 42 at [9.0, 9.0, 9.0] has none (1 such). "
        'Try repair(mesh, ["auto"]), or --repair auto on the command line.'
    ),
    "surprise": "ValueError: invalid literal for int() with base 10: 'surprise'",
}


@pytest.mark.long
def test_bad_shapes_are_named_and_the_others_go_on(index, tmp_path):
    good = {"a": "1", "d": "2", "g": "3", "vanish": "vanish", "h": "4"}
    todo = items(
        tmp_path, a="1", **{word: word for word in BAD}, d="2", g="3", vanish="vanish", h="4"
    )
    calls = []
    report = build(index, todo, timeout=20.0, callback=lambda *call: calls.append(call))
    assert report.added == tuple(good)
    assert report.failed == tuple(BAD.items())
    assert [record.name for record in index.records()] == sorted(good)
    assert [call[0] for call in calls] == list(range(1, len(todo) + 1))
    assert {call[2]: call[3] for call in calls} == {**dict.fromkeys(good), **BAD}


@pytest.mark.long
def test_what_is_there_is_not_done_twice(index, tmp_path):
    todo = items(tmp_path, a="1", b="2")
    build(index, todo[:1])
    report = build(index, todo)
    assert (report.added, report.skipped, report.failed) == (("b",), ("a",), ())
    assert index.records()[0].digest == content_digest(tmp_path / "a")


@pytest.mark.long
def test_a_damaged_shape_is_described_anew(index, tmp_path):
    todo = items(tmp_path, a="1", b="2", c="3")
    build(index, todo)
    spoil(index.folder, SPOIL_ROWS)
    (damage,) = index.verify().damages
    report = build(index, todo)
    assert report.added == (damage.shape,)
    assert len(report.skipped) == 2
    assert index.verify().damages == ()
    assert nearest(index, 1).name == "a"


@pytest.mark.long
def test_a_changed_file_replaces_what_it_was(index, tmp_path):
    todo = items(tmp_path, a="1", b="2")
    build(index, todo)
    (tmp_path / "a").write_text("5")
    assert build(index, todo).added == ("a",)
    assert nearest(index, 5).name == "a"
    assert len(index) == 2


@pytest.mark.long
def test_a_file_that_changes_while_it_is_read_is_read_again(index, tmp_path):
    todo = items(tmp_path, a="change")
    assert build(index, todo).added == ("a",)
    assert build(index, todo).added == ("a",)
    assert nearest(index, 9).score == 0
    assert build(index, todo).skipped == ("a",)


@pytest.mark.long
def test_ctrl_c_keeps_what_is_done(index, tmp_path):
    todo = items(tmp_path, **{f"s{number}": str(number) for number in range(8)})

    def interrupt(n_done, n_items, name, error):
        if n_done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build(index, todo, callback=interrupt)
    assert len(index) == 3
    report = build(index, todo)
    assert len(report.added) == 5
    assert len(report.skipped) == 3


@pytest.mark.long
def test_a_missing_file_is_named(index, tmp_path):
    report = build(index, [Item("gone", tmp_path / "gone")])
    assert report.failed[0][0] == "gone"
    assert "No such file" in report.failed[0][1]


@pytest.fixture
def stoppable():
    """Have Ctrl-C raise KeyboardInterrupt, also where a background job runs the tests with Ctrl-C ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.long
@pytest.mark.usefixtures("stoppable")
def test_ctrl_c_ends_workers_that_hang(index, tmp_path):
    todo, done = items(tmp_path, a="1", b="hang"), threading.Event()

    def interrupt_soon():
        try:
            wait_until((tmp_path / "b.busy").exists)
            wait_until(done.is_set)
        finally:  # without it the build would hang as long as its worker
            os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt_soon, daemon=True).start()
    with pytest.raises(KeyboardInterrupt):
        build(index, todo, timeout=600, callback=lambda *_: done.set())
    with FileLock(tmp_path / "b.lock", timeout=20):  # let go by its death only
        assert [record.name for record in index.records()] == ["a"]


@pytest.mark.long
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kill -9 is a Unix thing")
def test_workers_do_not_outlive_a_killed_batch(index, tmp_path):
    todo = items(tmp_path, a="hang")
    batch = multiprocessing.get_context("spawn").Process(target=build, args=(index, todo, 600.0))
    batch.start()
    wait_until((tmp_path / "a.busy").exists)
    batch.kill()
    batch.join()
    with FileLock(tmp_path / "a.lock", timeout=20):
        assert len(index) == 0


def wait_until(happens):
    deadline = time.monotonic() + 120
    while not happens():
        assert time.monotonic() < deadline
        time.sleep(0.01)


UNGUARDED = """
from pathlib import Path
from unittest.mock import Mock
from describers import RECIPE, read_by_content
import eigenshape as es

index = es.ShapeIndex.open_or_create("index")
items = [es.retrieval.Item(name, Path(name)) for name in "abc"]
print(es.retrieval.build_index(index, items, read_by_content, recipes=(RECIPE,)))
"""


def run_script(folder, text):
    (folder / "script.py").write_text(text)
    paths = [str(Path(__file__).parents[2]), str(Path(eigenshape.__file__).parents[1])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    command = [sys.executable, "script.py"]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.long
def test_a_script_without_a_main_guard_is_told_so(tmp_path):
    items(tmp_path, a="1", b="2", c="3")
    done = run_script(tmp_path, UNGUARDED)
    assert done.returncode == 1
    assert (
        done.stderr.count(
            "Put what the script does, from its first call of eigenshape on, under `if __name__"
        )
        == 1
    )
    assert "bootstrapping" not in done.stderr
    assert len(ShapeIndex.open(tmp_path / "index")) == 0
    imports, _, body = UNGUARDED.partition("\n\n")
    guarded = f"{imports}\n\nif __name__ == '__main__':\n{textwrap.indent(body, '    ')}"
    assert "added=('a', 'b', 'c')" in run_script(tmp_path, guarded).stdout


def test_a_pool_that_gives_up_before_it_takes_a_file_says_why(index, tmp_path, monkeypatch):
    pool, given_up = Mock(), RuntimeError("Unexpected error within the Pool")
    monkeypatch.setattr(_workers, "start_pool", lambda *_: pool)
    monkeypatch.setattr(_workers, "schedule_work", Mock(side_effect=given_up))
    with pytest.raises(CerteigError, match="under `if __name__"):
        build(index, items(tmp_path, a="1"))
    assert (pool.stop.call_count, pool.join.call_count) == (1, 1)


def test_what_a_batch_cannot_begin_with(index, tmp_path):
    with pytest.raises(
        InvalidParameterError,
        match=r"Items must have different names; 'x' is the name of both .*a and .*b",
    ):
        build(index, [Item("x", tmp_path / "a"), Item("x", tmp_path / "b")])
    with pytest.raises(InvalidParameterError, match="count must be at least 1; it is 0"):
        Workers(count=0)
    with pytest.raises(InvalidParameterError, match="timeout must be positive and finite"):
        Workers(timeout=0.0)


@pytest.mark.long
def test_shapes_that_a_codebook_is_learned_from_are_read_once(index, tmp_path):
    todo = items(tmp_path, **{f"shape{number}": str(number) for number in range(42)})
    report = build_index(index, todo, read_and_count, learn=True, n_views=0, workers=Workers(2))
    assert len(report.added) == len(index) == len(todo)
    assert [(tmp_path / f"{item.name}.count").read_bytes() for item in todo] == [b"1"] * len(todo)
    (recipe,) = index.recipes()
    learned = train_codebook_from_files(todo, read_and_count)
    assert recipe == PatchRecipe(learned) != PatchRecipe()
    for number in (0, 41):
        stored = index.descriptors(f"shape{number}", recipe)[0]
        alone = describe(mesh_of(number), recipe)
        assert np.array_equal(stored.codes[0], alone.codes[0])


def test_learning_and_recipes_exclude_each_other(index):
    with pytest.raises(InvalidParameterError, match="both were given"):
        build_index(index, [], read_by_content, recipes=(RECIPE,), learn=True)


def test_unknown_repairs_are_refused_before_a_file_is_read(index, tmp_path):
    with pytest.raises(InvalidParameterError, match="name 1 is 'polish'"):
        build_index(index, items(tmp_path, a="raise"), read_by_content, repairs=["weld", "polish"])


@pytest.mark.long
def test_repairs_are_reported(index, tmp_path):
    todo = items(tmp_path, whole="1", loose="loose")
    report = build_index(
        index, todo, read_by_content, recipes=(RECIPE,), repairs=["auto"], n_views=0
    )
    assert report.added == ("whole", "loose")
    ((name, done),) = report.repaired
    assert (name, done) == ("loose", ("drop_unreferenced removed 1 vertex without a face",))


@pytest.mark.long
def test_an_executor_runs_the_work_and_loses_no_worker_to_a_file(index, tmp_path, monkeypatch):
    monkeypatch.setattr("eigenshape._workers.FILES_A_TASK", 2)
    bad = {word: BAD[word] for word in ("raise", "die")}
    todo = items(tmp_path, a="1", **{word: word for word in bad}, b="2", c="3")
    with ThreadPoolExecutor(2) as executor:
        report = build_index(
            index,
            todo,
            read_by_content,
            recipes=(RECIPE,),
            n_views=0,
            workers=Workers(timeout=60.0, executor=executor),
        )
    assert report.added == ("a", "b", "c")
    assert report.failed == tuple(bad.items())
    assert nearest(index, 2).name == "b"


class CountingExecutor(Executor):
    """Answers at once that there is nothing, and counts what it is given."""

    n_tasks = 0

    def submit(self, run, order):
        self.n_tasks += 1
        _, files, _ = pickle.loads(order)
        done = Future()
        done.set_result(pickle.dumps([(item, Outcome(error="none")) for item in files]))
        return done


def test_few_tasks_are_submitted_ahead_so_that_results_do_not_pile_up(index, tmp_path, monkeypatch):
    monkeypatch.setattr("eigenshape._workers.FILES_A_TASK", 1)
    monkeypatch.setattr("eigenshape._workers.TASKS_AHEAD", 3)
    executor = CountingExecutor()
    submitted = []
    todo = items(tmp_path, **{f"s{number}": str(number) for number in range(9)})
    report = build_index(
        index,
        todo,
        read_by_content,
        recipes=(RECIPE,),
        workers=Workers(executor=executor),
        callback=lambda *_: submitted.append(executor.n_tasks),
    )
    assert len(report.failed) == 9
    assert submitted == [4, 5, 6, 7, 8, 9, 9, 9, 9]


@pytest.mark.parametrize(
    ("n_files", "n_tasks"), [(1, 1), (27, 27), (63, 63), (200, 67), (4096, 128)]
)
def test_few_files_go_to_many_workers_and_many_files_in_few_tasks(n_files, n_tasks, tmp_path):
    executor = CountingExecutor()
    todo = [Item(str(number), tmp_path / str(number)) for number in range(n_files)]
    found = run_in_workers(read_by_content, todo, Workers(executor=executor))
    assert sorted(item.name for item, _ in found) == sorted(item.name for item in todo)
    assert executor.n_tasks == n_tasks


@pytest.mark.long
def test_a_cluster_that_loses_a_worker_in_the_middle_loses_no_shape(index, tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr("eigenshape._workers.FILES_A_TASK", 2)
    todo = items(tmp_path, **{f"shape{number}": str(number) for number in range(9)}, bad="raise")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as two,
        distributed.Client(two) as client,
    ):
        victim = next(iter(client.run(os.getpid).values()))
        executor = client.get_executor(pure=False, retries=3)
        build_index(
            index,
            todo,
            read_by_content,
            recipes=(RECIPE,),
            n_views=0,
            workers=Workers(timeout=60.0, executor=executor),
            callback=lambda n_done, *_: os.kill(victim, signal.SIGKILL) if n_done == 2 else None,
        )
    assert {record.name for record in index.records()} == {f"shape{n}" for n in range(9)}


@pytest.mark.long
def test_a_folder_that_moves_and_a_table_that_changes_are_no_new_shapes(index, tmp_path):
    (tmp_path / "old").mkdir()
    todo = items(tmp_path / "old", a="1", loose="loose")
    options = {"recipes": (RECIPE,), "n_views": 0, "repairs": ["auto"]}
    build_index(index, todo, read_by_content, **options)
    new = (tmp_path / "old").rename(tmp_path / "new")
    moved = [
        Item(item.name, new / item.path.name, "cat", ("wild",), {"height": 2.0}) for item in todo
    ]
    report = build_index(index, moved, read_by_content, **options)
    assert report.skipped == ("a", "loose")
    first, second = index.records()
    assert (first.label, first.tags, first.attributes) == ("cat", ("wild",), {"height": 2.0})
    assert first.source == str(new / "a")
    assert second.attributes == {
        "height": 2.0,
        "repairs": "drop_unreferenced removed 1 vertex without a face",
    }
    assert index.query(describe(mesh_of(1), RECIPE), where={"height": (1, 3)})[0].name == "a"


def warn_of(path):
    warnings.warn(f"{path.name}: the fields rgba are not read", stacklevel=1)
    return 1


def test_a_warning_of_a_worker_has_no_line_of_code(tmp_path, capfd):
    todo = items(tmp_path, one="1")
    assert [outcome.value for _, outcome in run_in_workers(warn_of, todo, Workers(1))] == [1]
    said = capfd.readouterr().err
    assert "warning: one: the fields rgba are not read\n" in said
    assert ".py:" not in said
