"""Nothing is lost: what a tab holds is found again in its file, and every step is undone exactly."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from itertools import count
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest
from conftest import stretched_ball
from test_workspace import PULL, TURN, Page, bend, file_of

import eigenshape as es
from eigenshape_studio.server import Tabs
from eigenshape_studio.shape.loading import Loaded
from eigenshape_studio.tab import sessions
from eigenshape_studio.tab.history import N_IN_MEMORY, History, Shape
from eigenshape_studio.tab.sessions import SessionFile, remove_old
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
    file.close()
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


# Starts a studio for each line it reads. A child has all that the parent has imported, so it is
# there within a tenth of a second.
SERVERS = """
import os, signal, sys
from pathlib import Path
import eigenshape as es
from eigenshape_studio.server import serve

es.DeformationSession(es.rig_shape(es.icosphere(1)))  # imports what an edit takes
signal.signal(signal.SIGCHLD, signal.SIG_IGN)
port, mesh, sessions = 0, sys.argv[1], Path(sys.argv[2])
for line in sys.stdin:
    if os.fork() == 0:
        announce = lambda url: print(os.getpid(), url, flush=True)
        serve([mesh], port=int(line), sessions=sessions, browse=False, announce=announce)
        os._exit(0)
"""


class Dying:
    """A studio that is killed again and again, and a page that sends its calls until each is answered."""

    def __init__(self, mesh, sessions):
        command = [sys.executable, "-c", SERVERS, str(mesh), str(sessions)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        self.parent = subprocess.Popen(command, text=True, **pipes)
        self.port, self.client = 0, httpx.Client()
        self.start()

    def start(self):
        print(self.port, file=self.parent.stdin, flush=True)
        number, url = self.parent.stdout.readline().split()
        self.child, parts = int(number), urlsplit(url)
        self.port = parts.port
        self.token = parts.query.removeprefix("token=")
        self.client.close()
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{self.port}", timeout=60)

    def kill(self):
        with suppress(ProcessLookupError):  # it has just been killed
            os.kill(self.child, signal.SIGKILL)

    def call(self, name, meta, arrays=None):
        body = encode(meta, arrays)
        for _ in range(1000):
            headers = {
                "content-type": "application/octet-stream",
                "x-eigenshape-tab": TAB,
                "authorization": f"Bearer {self.token}",
            }
            try:
                answer = self.client.post(f"/api/{name}", headers=headers, content=body)
            except httpx.TransportError:  # it was killed
                self.start()
                continue
            if answer.status_code != 503:
                facts, found = decode(answer.content)
                assert answer.status_code == 200, facts
                return facts, found
            time.sleep(0.01)
        raise AssertionError("The studio does not become ready.")

    def close(self):
        self.kill()
        self.client.close()
        self.parent.communicate(timeout=20)


def script(top):
    """Return calls as a hand makes them: strokes, bends, undone and redone, other shapes."""
    ball = {"file": file_of(es.icosphere(1))}
    commit = {"kind": "commit", "mode": "graded"}
    calls = []
    for number in range(4):
        chosen = {"regions": owners(*top, *range(number))}
        calls.append(({"kind": "select", "text": f"Stroke {number}"}, chosen))
        calls.append(({**commit, "handles": [TURN if number % 2 else PULL]}, None))
    calls += [({"kind": "undo"}, None), ({"kind": "undo"}, None), ({"kind": "redo"}, None)]
    calls += [({"kind": "open", "name": "b.ply"}, ball), ({"kind": "choose", "shape": 0}, None)]
    calls += [({"kind": "reset"}, None), ({"kind": "undo"}, None)]
    calls.append(({"kind": "select", "text": "Clear"}, {"regions": owners()}))
    return calls


def states(call, n_places):
    """Return vertices and regions of every state of a session, from the last to the first."""
    found = []
    for place in reversed(range(n_places)):
        state = call("finish", {"kind": "go", "place": place})[0]["state"]
        arrays = [
            call("array", {"name": name})[1][name].tobytes() for name in ("vertices", "regions")
        ]
        found.append((state["name"], state["history"], *arrays))
    return found


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "fork"), reason="the studio is started by fork")
def test_no_edit_is_lost_by_a_server_that_is_killed(first, top, tmp_path, in_turn):
    """Each of 50 kills comes at another moment of a session: of a call, of its answer, between."""
    es.write_mesh(first.mesh, tmp_path / "ball.ply")
    calls = script(top)
    steady = Page(Workspace(es.read_mesh(tmp_path / "ball.ply"), "ball.ply").fork())
    assert steady.workspace.analysis.rig.wait(600)
    for meta, arrays in calls:
        steady.call("finish", meta, arrays)
    n_places = len(steady.call("meta")[0]["history"]) + 1
    wanted = states(steady.call, n_places)

    moments = np.random.default_rng(41).permutation(50)
    dying, numbers = Dying(tmp_path / "ball.ply", tmp_path / "sessions"), count()
    try:
        for turn in in_turn(range(50)):
            moment = moments[turn]
            for place, (meta, arrays) in enumerate(calls):
                if place == moment % len(calls):
                    timer = threading.Timer(0.02 * (moment // len(calls)) ** 2, dying.kill)
                    timer.start()
                dying.call("finish", {**meta, "id": f"change {next(numbers)}"}, arrays)
            timer.join()
            assert states(dying.call, n_places) == wanted
            (tmp_path / "sessions" / f"{TAB}.sqlite").unlink()
            dying.kill()
    finally:
        dying.close()
