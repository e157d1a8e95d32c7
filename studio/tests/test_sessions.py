"""Nothing is lost: what a tab holds is found again in its file, and every step is undone exactly."""

import os
import re
import resource
import sqlite3
import subprocess
import sys
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np
import pytest
from conftest import stretched_ball
from test_workspace import PULL, TURN, Page, bend, file_of

import eigenshape as es
from eigenshape_studio.others.folders import Folders
from eigenshape_studio.owner import own, remove_old_of_others
from eigenshape_studio.server import Tabs, serve
from eigenshape_studio.shape.loading import Loaded
from eigenshape_studio.tab import sessions
from eigenshape_studio.tab.history import N_IN_MEMORY, History, Shape
from eigenshape_studio.tab.sessions import SessionFile, remove_old, unpack
from eigenshape_studio.tab.workspace import Workspace
from eigenshape_studio.wire import decode, encode

TAB = "a-tab-of-the-tests"


@pytest.fixture(scope="module")
def first():
    workspace = Workspace(stretched_ball(2), "ball.ply", shared=True)
    assert workspace.analysis.rig.wait(600)
    return workspace


@pytest.fixture
def top(first):
    return np.flatnonzero(first.mesh.vertices[:, 1] > 0.9).astype("<u4")


def owners(*vertices):
    found = np.full(162, 5, dtype=np.uint8)
    found[list(vertices)] = 0
    return found


def select(page, *vertices, **more):
    call = {"kind": "select", "text": "Stroke"} | more
    return page.call("finish", call, {"regions": owners(*vertices)})[0]["state"]


def test_a_thousand_actions_are_undone_to_the_first_state_and_done_again(first, tmp_path):
    """Also where most of them are in the file alone, and after the session was read anew."""
    random = np.random.default_rng(5)
    file = SessionFile(tmp_path / "tab.sqlite")
    history = History([shape.fork() for shape in first.history.shapes.values()], file)
    rest = first.mesh
    seen = []
    edit = es.deformation.Edit((es.deformation.Move([0, 1], es.Translation([0, 0.1, 0])),))
    for number in range(1000):
        if number % 3:
            history.select(random.integers(0, 6, 162, dtype=np.uint8), "Stroke")
        else:
            bent = es.TriangleMesh(rest.vertices + random.normal(size=(162, 3)), rest.faces)
            history.bend((edit,), bent, "Bend")
        seen.append((history.mesh(history.now.pose).vertices, history.owners(history.now)))
        history.save()

    again = History(
        [shape.fork() for shape in first.history.shapes.values()], SessionFile(file.path)
    )
    for each in (history, again):
        in_memory = {moment.pose for moment in each.moments if moment.pose.mesh is not None}
        assert len(in_memory) <= N_IN_MEMORY
        assert each.place == 1000
        for place in (*range(1000, -1, -1), *range(1, 1001)):
            each.go(place)
            vertices, chosen = seen[place - 1] if place else (rest.vertices, None)
            np.testing.assert_array_equal(each.mesh(each.now.pose).vertices, vertices)
            np.testing.assert_array_equal(each.owners(each.now), chosen)
        assert len(each.edits(each.now.pose)) == each.now.pose.n_edits == 334


def test_a_session_is_found_again_with_all_that_is_in_it(first, top, tmp_path):
    file = SessionFile(tmp_path / "tab.sqlite")
    page = Page(first.fork(file))
    bend(page, top)
    select(page, 3, 4)
    ball = file_of(es.icosphere(1))
    page.call("finish", {"kind": "open", "name": "b.ply"}, {"file": ball})
    page.call("finish", kind="undo")
    bent = page.workspace.mesh.vertices
    kept = page.call("meta")[0]
    page.workspace.close()

    again = Page(first.fork(SessionFile(file.path)))
    state = again.call("meta")[0]
    for name in ("name", "shape", "pose", "shapes", "history", "place", "selected"):
        assert state[name] == kept[name], name
    assert state["history"] == ["Bend", "Stroke", "Open b.ply"]
    np.testing.assert_array_equal(again.workspace.mesh.vertices, bent)
    np.testing.assert_array_equal(again.array("regions"), owners(3, 4))
    assert again.workspace.analysis.rig is first.analysis.rig  # what all tabs share stays shared
    again.call("finish", kind="redo")
    np.testing.assert_array_equal(again.workspace.mesh.vertices, es.icosphere(1).vertices)
    for _ in range(3):
        again.call("finish", kind="undo")
    np.testing.assert_array_equal(again.workspace.mesh.vertices, first.mesh.vertices)
    again.call("finish", kind="go", place=1)
    assert again.workspace.edits[0].moves[0].handle.angle == TURN["angle"]
    again.workspace.close()


def test_what_was_undone_and_replaced_is_not_found_again(first, tmp_path):
    file = SessionFile(tmp_path / "tab.sqlite")
    page = Page(first.fork(file))
    for text, chosen in (("A", (3,)), ("B", (4,))):
        page.call("finish", {"kind": "select", "text": text}, {"regions": owners(*chosen)})
    page.call("finish", kind="undo")
    page.call("finish", {"kind": "select", "text": "C"}, {"regions": owners(5)})
    page.workspace.close()

    state = Page(first.fork(SessionFile(file.path))).call("meta")[0]
    assert (state["history"], state["place"]) == (["A", "C"], 2)


def test_a_session_does_not_need_the_shape_that_the_server_shows(first, top, tmp_path):
    file = SessionFile(tmp_path / "tab.sqlite")
    page = Page(first.fork(file))
    bend(page, top)
    bent = page.workspace.mesh.vertices
    page.workspace.close()
    other = Workspace(es.icosphere(1), "other.ply", shared=True)
    again = Page(other.fork(SessionFile(file.path)))
    assert again.call("meta")[0]["name"] == "ball.ply"
    np.testing.assert_array_equal(again.workspace.mesh.vertices, bent)
    # An edit that is sent while the modes are computed anew is sent again.
    call = {"kind": "commit", "handles": [PULL], "mode": "graded"}
    select(again, *top)
    assert again.workspace.analysis.rig.wait(600)
    again.call("finish", call)
    assert again.call("meta")[0]["deformation"]["n_edits"] == 2
    again.workspace.close()


def test_a_change_that_is_sent_twice_is_made_once(first, top, tmp_path):
    page = Page(first.fork(SessionFile(tmp_path / "tab.sqlite")))
    page.call("rig", {"n_regions": 1}, {"region0": top})
    commit = {"kind": "commit", "handles": [TURN], "mode": "graded", "id": "one"}
    _, once = page.call("finish", commit)
    _, twice = page.call("finish", commit)
    np.testing.assert_array_equal(once["vertices"], twice["vertices"])
    page.workspace.close()
    again = Page(first.fork(SessionFile(tmp_path / "tab.sqlite")))
    facts, _ = again.call("finish", commit)
    assert facts["state"]["deformation"]["n_edits"] == 1
    assert facts["state"]["history"] == ["Bend"]
    again.workspace.close()


def test_a_ninth_tab_sends_the_idle_one_to_its_file(first, top, tmp_path):
    tabs = Tabs(first, tmp_path, most=2)
    page = Page(tabs.workspace(TAB))
    bend(page, top)
    bent = page.workspace.mesh.vertices
    for number in range(3):
        tabs.workspace(f"another-tab-{number}")
    again = tabs.workspace(TAB)
    assert again is not page.workspace
    np.testing.assert_array_equal(again.mesh.vertices, bent)
    # A tab that is waiting for an answer stays.
    assert tabs.begin(TAB)
    for number in range(3):
        tabs.workspace(f"another-tab-{number}")
    assert tabs.workspace(TAB) is again
    tabs.end(TAB)


def test_a_file_that_is_broken_is_put_aside(first, tmp_path):
    path = tmp_path / "tab.sqlite"
    path.write_bytes(b"no database" * 1000)
    page = Page(first.fork(SessionFile(path)))
    assert page.call("meta")[0]["history"] == []
    assert path.with_suffix(".broken").exists()
    assert select(page, 1)["history"] == ["Stroke"]
    page.workspace.close()


def test_old_sessions_and_the_oldest_of_too_many_are_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(sessions, "MOST_BYTES", 250)
    ages = {"young": 0, "recent": 2, "open": 40, "week": 7, "old": 31}
    for name, days in ages.items():
        path = tmp_path / f"{name}.sqlite"
        path.write_bytes(bytes(100))
        os.utime(path, (path.stat().st_mtime - days * 86400,) * 2)
    # Of a session that was made when its server was killed
    for name in ("old.sqlite.0f", "old.sqlite.0f-journal"):
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (1.0, 1.0))
    remove_old(tmp_path, [tmp_path / "open.sqlite"])
    assert {path.stem for path in tmp_path.iterdir()} == {"young", "recent", "open"}


def test_shapes_are_chosen_from_a_list_and_read_when_they_are(tmp_path):
    path = tmp_path / "b.ply"
    shapes = [
        Shape(0, "a", lambda: Loaded(es.icosphere(1))),
        Shape(1, "b.ply", lambda: Loaded(es.read_mesh(path)), path=str(path)),
    ]
    page = Page(Workspace(shapes, shared=True).fork(SessionFile(tmp_path / "tab.sqlite")))
    assert page.call("meta")[0]["shapes"] == [[0, "a"], [1, "b.ply"]]
    assert "b.ply" in page.error("finish", kind="choose", shape=1)["message"]
    assert page.call("meta")[0]["shape"] == 0
    es.write_mesh(es.icosphere(2), path)
    assert page.call("finish", kind="choose", shape=1)[0]["state"]["n_vertices"] == 162
    select(page, 7)
    page.call("finish", kind="choose", shape=0)
    assert page.array("regions").size == 0
    page.call("finish", kind="choose", shape=1)
    np.testing.assert_array_equal(page.array("regions"), owners(7))
    assert "shape must be one of [0, 1]" in page.error("finish", kind="choose", shape=2)["message"]
    page.workspace.close()


def test_regions_of_another_shape_are_refused(first):
    page = Page(first.fork())
    call = {"kind": "select"}
    error = page.error("finish", call, {"regions": np.zeros(3, np.uint8)})
    assert "one region for each of the 162 vertices" in error["message"]
    assert "must have an array 'regions'" in page.error("finish", call)["message"]
    assert "undone edit to redo" in page.error("finish", kind="redo")["message"]


WORKS = ("health", "spectrum", "parts", "deformation")


def refused(page, status, *arguments):
    """Return the error of a change that is answered by a status, and that leaves the tab as it was."""
    before = page.call("meta")[0], page.workspace.mesh.vertices
    answer = page.workspace.answer("finish", encode(*arguments))
    assert answer.status == status
    after = page.call("meta")[0]
    # What is computed beside may have come further.
    assert [key for key in after if after[key] != before[0][key] and key not in WORKS] == []
    np.testing.assert_array_equal(page.workspace.mesh.vertices, before[1])
    return decode(answer.message)[0]["error"]


@contextmanager
def full_disk():
    """Let no file grow, as on a full disk."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_a_change_on_a_full_disk_is_refused_until_there_is_room(first, top, tmp_path):
    """The same change with the same id is not taken for made, and is made when there is room."""
    file = SessionFile(tmp_path / "tab.sqlite")
    page = Page(first.fork(file))
    page.call("rig", {"n_regions": 1}, {"region0": top})
    ball = {"file": file_of(es.icosphere(1))}
    changes = [
        ({"kind": "commit", "handles": [TURN], "mode": "graded"}, None),
        ({"kind": "select", "text": "Stroke"}, {"regions": owners(7)}),
        ({"kind": "open", "name": "b.ply"}, ball),
        ({"kind": "beside", "shape": 0}, None),
        ({"kind": "undo"}, None),
        ({"kind": "go", "place": 0}, None),
        ({"kind": "choose", "shape": 1}, None),
    ]
    for number, (meta, arrays) in enumerate(changes):
        call = {**meta, "id": f"change {number}"}
        with full_disk():
            for _ in range(2):
                error = refused(page, 507, call, arrays)
                assert error["kind"] == "NotKeptError"
                assert "needs space on its disk" in error["message"]
                assert "free some space and repeat the call" in error["message"]
        made = page.call("finish", call, arrays)[0]["state"]
        again = Page(first.fork(SessionFile(file.path)))
        kept = again.call("meta")[0]
        for name in ("history", "place", "name", "shapes", "pose", "selected"):
            assert made[name] == kept[name], (call, name)
        np.testing.assert_array_equal(again.workspace.mesh.vertices, page.workspace.mesh.vertices)
    assert made["history"] == ["b.ply"]
    page.workspace.close()


def test_a_change_that_is_refused_for_another_reason_leaves_nothing(first, tmp_path):
    page = Page(first.fork(SessionFile(tmp_path / "tab.sqlite")))
    page.workspace.folders = Folders(tmp_path)
    (tmp_path / "shapes").mkdir()
    (tmp_path / "shapes" / "a.ply").write_text("no shape")
    error = refused(page, 400, {"kind": "folder", "folder": str(tmp_path / "shapes")})
    assert "No shape of the folder can be opened" in error["message"]


def test_a_session_whose_file_was_removed_takes_no_change(first, tmp_path):
    file = SessionFile(tmp_path / "tab.sqlite")
    page = Page(first.fork(file))
    select(page, 1)
    file.path.unlink()
    error = refused(page, 507, {"kind": "select"}, {"regions": owners(2)})
    assert "It was removed: save the shape as a file" in error["message"]


def test_a_damaged_session_says_what_is_gone_and_goes_on(first, top, tmp_path):
    file = SessionFile(tmp_path / "tab.sqlite")
    page = Page(first.fork(file))
    select(page, 1)
    bend(page, top)
    select(page, 2, text="Last stroke")
    bent = page.workspace.mesh.vertices
    with closing(sqlite3.connect(file.path)) as database:
        database.execute("DROP TRIGGER steps_update")
        database.execute("UPDATE steps SET landmarks = 'x' WHERE text = 'Last stroke'")
        database.commit()
    damaged = file.path.read_bytes()

    again = Page(first.fork(SessionFile(file.path)))
    state = again.call("meta")[0]
    (loss,) = state["losses"]
    assert "Gone: 1 of 4 steps. The damaged file is kept as" in loss
    assert file.path.with_suffix(".broken").read_bytes() == damaged
    assert (state["history"], state["place"]) == (["Stroke", "Bend"], 2)
    np.testing.assert_array_equal(again.workspace.mesh.vertices, bent)
    assert select(again, 3)["history"] == ["Stroke", "Bend", "Stroke"]
    state = Page(first.fork(SessionFile(file.path))).call("meta")[0]
    assert (state["history"], state["losses"]) == (["Stroke", "Bend", "Stroke"], [])


def test_a_row_that_is_damaged_while_the_tab_is_open_is_named(first, top, tmp_path):
    file = SessionFile(tmp_path / "tab.sqlite")
    page = Page(first.fork(file))
    bend(page, top)
    page.workspace.history.now.pose.mesh = None  # as of a pose that has left the memory
    with closing(sqlite3.connect(file.path)) as database:
        database.execute("DROP TRIGGER poses_update")
        database.execute("UPDATE poses SET shape = 5")
        database.commit()
    assert "row 1 of poses differs from its checksum" in page.error("meta")["message"]
    with pytest.raises(es.StoreError, match="by the version of eigenshape that wrote it"):
        unpack(b"no pickle")


def test_a_session_of_another_format_is_put_aside(first, tmp_path):
    file = SessionFile(tmp_path / "tab.sqlite")
    select(Page(first.fork(file)), 1)
    with closing(sqlite3.connect(file.path)) as database:
        database.execute("PRAGMA user_version = 1")
    state = Page(first.fork(SessionFile(file.path))).call("meta")[0]
    assert state["history"] == []
    assert "Gone: everything" in state["losses"][0]
    assert "by an older version of eigenshape" in state["losses"][0]


def test_an_index_that_has_gone_is_named_and_the_tab_opens(first, tmp_path):
    page = Page(first.fork(SessionFile(tmp_path / "tab.sqlite")))
    page.workspace.history.index = str(tmp_path / "gone")
    select(page, 1)
    state = Page(first.fork(SessionFile(tmp_path / "tab.sqlite"))).call("meta")[0]
    assert state["history"] == ["Stroke"]
    assert f"{tmp_path / 'gone'} cannot be opened any more" in state["losses"][0]


OWNER = """
import sys
from pathlib import Path
from eigenshape_studio.owner import own
owner = own(Path(sys.argv[1]), "http://127.0.0.1:1234")
print("owned", flush=True)
sys.stdin.read()
"""


def test_a_folder_of_sessions_has_one_server(tmp_path):
    """Also where that one was killed: the system takes its lock."""
    command = [sys.executable, "-c", OWNER, str(tmp_path)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as other:
        assert other.stdout.readline() == "owned\n"
        name = (
            rf"process {other.pid} on .*, http://127.0.0.1:1234. End that server, or choose another"
        )
        with pytest.raises(es.StoreError, match=name):
            own(tmp_path, "here", 0)
        es.write_mesh(es.icosphere(1), tmp_path / "ball.ply")
        with pytest.raises(es.StoreError, match="must have one server"):
            serve([tmp_path / "ball.ply"], sessions=tmp_path, browse=False)
        other.kill()
    own(tmp_path, "here").close()


def test_folders_of_other_ports_are_cleaned_up_unless_they_have_a_server(tmp_path):
    old = []
    for port in ("1", "2", "3"):
        own(tmp_path / port, "http://127.0.0.1").close()
        old.append(tmp_path / port / "tab.sqlite")
        old[-1].write_bytes(b"")
        os.utime(old[-1], (1.0, 1.0))
    with closing(own(tmp_path / "2", "http://127.0.0.1:2")):
        remove_old_of_others(tmp_path / "3")
        assert [path.exists() for path in old] == [False, True, True]


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "fork"), reason="the studio is started by fork")
def test_no_edit_is_lost_by_kills_and_no_turned_bit_is_silent():
    script = Path(__file__).parents[2] / "benchmarks" / "kills_studio.py"
    command = [sys.executable, script, "--kills", "10", "--flips", "10"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    found = dict(re.findall(r"^  (.*): (\d+)$", done.stdout, re.MULTILINE))
    assert int(found["kills"]) >= 10
    assert (found["silent"], found["bare errors"]) == ("0", "0")
    assert sum(map(int, found.values())) >= 20
