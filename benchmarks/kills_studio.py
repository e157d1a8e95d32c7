"""Kill the server of the studio at random moments, turn single bits of a session, and see what a tab finds.

    python benchmarks/kills_studio.py --kills 300 --flips 333

A page sends strokes, bends, undone and redone edits, landmarks and other shapes, each with an id and again until
it is answered. After each kill (SIGKILL) the tab must hold what was acknowledged, with or without the one change
that was on its way, and in the end each state must be that of a run without kills. After each turned bit of the
session's file, each state must be the same, or the tab says what is gone, and what it still has must be the same.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from functools import partial
from itertools import count
from pathlib import Path
from threading import Timer
from urllib.parse import urlsplit

import httpx
import numpy as np

import eigenshape as es
from eigenshape_studio.tab.sessions import SessionFile
from eigenshape_studio.tab.workspace import Workspace
from eigenshape_studio.wire import decode, encode

# A server lives for a random part of some seconds. They grow with each kill and shrink with each answer,
# so that there is more than one answer a kill on any machine.
LEAST, GROWN, SHRUNK = 0.3, 1.15, 0.9
TURN = {"type": "rotation", "pivot": [0, 0.9, 0], "axis": [0, 0, 2], "angle": 0.6}
PULL = {"type": "translation", "vector": [0, 0.4, 0.1]}
# Starts a studio for each line it reads. A child has all that the parent has imported, so it is there
# within a tenth of a second.
SERVERS = """
import os, signal, sys
from pathlib import Path
import eigenshape as es
from eigenshape_studio.server import serve

es.DeformationSession(es.rig_shape(es.icosphere(1)))  # imports what an edit takes
signal.signal(signal.SIGCHLD, signal.SIG_IGN)
for line in sys.stdin:
    if os.fork() == 0:
        announce = lambda url: print(os.getpid(), url, flush=True)
        serve([sys.argv[1]], port=int(line), sessions=Path(sys.argv[2]), browse=False, announce=announce)
        os._exit(0)
"""


def require(held, what):
    """Raise an error that says what does not hold."""
    if not held:
        raise AssertionError(what)


class Dying:
    """A studio that is killed again and again, and a page that sends its calls until each is answered."""

    def __init__(self, mesh, sessions, random):
        command = [sys.executable, "-c", SERVERS, str(mesh), str(sessions)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        self.parent = subprocess.Popen(command, text=True, **pipes)
        self.random, self.longest = random, LEAST
        self.port, self.n_kills, self.tab = 0, -1, ""
        self.start()

    def start(self):
        """Start a server that is killed after a while."""
        self.n_kills += 1
        print(self.port, file=self.parent.stdin, flush=True)
        number, url = self.parent.stdout.readline().split()
        self.child, parts = int(number), urlsplit(url)
        self.port = parts.port
        self.token = parts.query.removeprefix("token=")
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{self.port}", timeout=60)
        self.timer = Timer(self.longest * self.random.random(), self.kill)
        self.timer.start()

    def kill(self):
        """Kill the present server."""
        with suppress(ProcessLookupError):  # it has just been killed
            os.kill(self.child, signal.SIGKILL)

    def call(self, name, meta, arrays=None, started=lambda: None):
        """Return what a call answers; `started` is called after each start of another server."""
        body = encode(meta, arrays)
        while True:
            headers = {
                "content-type": "application/octet-stream",
                "x-eigenshape-tab": self.tab,
                "authorization": f"Bearer {self.token}",
            }
            try:
                answer = self.client.post(f"/api/{name}", headers=headers, content=body)
            except httpx.TransportError:  # it was killed
                self.longest *= GROWN
                self.client.close()
                self.start()
                started()
                continue
            if answer.status_code != 503:  # otherwise the shape is being prepared
                facts, found = decode(answer.content)
                require(answer.status_code == 200, facts)
                if name == "finish":  # what only looks is quick, and would never let a change end
                    self.longest = max(LEAST, SHRUNK * self.longest)
                return facts, found
            time.sleep(0.01)

    def close(self):
        """End the last server, and what starts them."""
        self.timer.cancel()
        self.kill()
        self.client.close()
        self.parent.communicate(timeout=20)


def call_of(workspace):
    """Return how a page calls a workspace of this process; an error of the library is a StoreError."""

    def call(name, meta, arrays=None):
        answer = workspace.answer(name, encode(meta, arrays))
        facts, found = decode(answer.message)
        if answer.status == 200:
            return facts, found
        require(answer.status in (400, 507), facts)
        raise es.StoreError(facts["error"]["message"])

    return call


def changes(mesh):
    """Return changes as a hand makes them: strokes, bends, undone and redone, landmarks, other shapes."""
    top = np.flatnonzero(mesh.vertices[:, 1] > 0.9)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "b.ply")
        es.write_mesh(es.icosphere(1), path)
        ball = {"file": np.frombuffer(path.read_bytes(), np.uint8)}
    commit = {"kind": "commit", "mode": "graded"}
    found = []
    for number in range(4):
        owners = np.full(mesh.n_vertices, 5, dtype=np.uint8)
        owners[[*top, *range(number)]] = 0
        found.append(({"kind": "select", "text": f"Stroke {number}"}, {"regions": owners}))
        found.append(({**commit, "handles": [TURN if number % 2 else PULL]}, None))
    points = {"points": mesh.vertices[:2].ravel()}
    found.append(({"kind": "reset"}, None))
    found.append(({"kind": "landmarks", "names": ["a", "b"]}, points))
    found += [({"kind": "undo"}, None), ({"kind": "undo"}, None), ({"kind": "redo"}, None)]
    found += [({"kind": "open", "name": "b.ply"}, ball), ({"kind": "choose", "shape": 0}, None)]
    owners = np.full(mesh.n_vertices, 5, dtype=np.uint8)
    found.append(({"kind": "select", "text": "Clear"}, {"regions": owners}))
    found.append(({"kind": "beside", "shape": 1}, None))
    return found


def shown(call):
    """Return what a tab shows: the steps up to its place, and what they lead to."""
    state = call("meta", {})[0]
    names = ("vertices", "faces", "regions")
    arrays = [call("array", {"name": name})[1][name].tobytes() for name in names]
    beside = state["beside"] and state["beside"]["name"]
    done = state["history"][: state["place"]]
    return done, (state["name"], done[-1:], state["landmarks"], beside, *arrays)


def all_shown(call):
    """Return what each step of the history shows, from the last to the first."""
    n_steps = len(call("meta", {})[0]["history"])
    found = []
    for place in reversed(range(n_steps + 1)):
        call("finish", {"kind": "go", "place": place})
        found.append(shown(call)[1])
    return found


def run_calm(workspace, mesh):
    """Return what is shown after each change, and in the end at each step."""
    call = call_of(workspace)
    steps = [shown(call)]
    for meta, arrays in changes(mesh):
        call("finish", meta, arrays)
        steps.append(shown(call))
    return steps, all_shown(call)


def make_studio(folder):
    """Return a small shape, and a studio that shows it."""
    es.write_mesh(es.icosphere(2), folder / "ball.ply")
    mesh = es.read_mesh(folder / "ball.ply")
    studio = Workspace(mesh, "ball.ply", shared=True)
    studio.analysis.rig.wait()
    return mesh, studio


def try_kills(n_kills, folder, random):
    """Kill the server until it was killed often enough; return how often a change was on its way."""
    mesh, studio = make_studio(folder)
    steps, wanted = run_calm(studio.fork(), mesh)
    dying, seen = Dying(folder / "ball.ply", folder / "sessions", random), Counter()

    def compare(number):
        now = shown(dying.call)
        require(now in steps[number : number + 2], f"change {number} was lost: {now[0]}")
        seen["killed before a change" if now == steps[number] else "killed before its answer"] += 1

    try:
        for turn in count():
            dying.tab = f"tab-that-is-killed-{turn}"
            for number, (meta, arrays) in enumerate(changes(mesh)):
                change = {**meta, "id": f"change {number}"}
                dying.call("finish", change, arrays, partial(compare, number))
            require(all_shown(dying.call) == wanted, "The states are others than without kills.")
            print(f"{dying.n_kills} kills", flush=True)
            if dying.n_kills >= n_kills:
                return seen | {"kills": dying.n_kills, "lost": 0}
    finally:
        dying.close()


def try_flips(n_flips, folder, random):
    """Turn single bits of the file of a session; return how often that was harmless, said, or silent."""
    mesh, studio = make_studio(folder)
    whole, path = folder / "whole.sqlite", folder / "tab.sqlite"
    _, wanted = run_calm(studio.fork(SessionFile(whole)), mesh)
    data, seen = whole.read_bytes(), Counter({"silent": 0, "bare errors": 0})
    for _ in range(n_flips):
        for left in folder.glob("tab.*"):
            left.unlink()
        place, bit = random.integers(len(data)), random.integers(8)
        turned = bytearray(data)
        turned[place] ^= 1 << bit
        path.write_bytes(turned)
        found = look_at(studio, path, wanted)
        if found in ("silent", "bare errors"):
            print(f"{found}: bit {bit} of byte {place}", flush=True)
        seen[found] += 1
    return seen


def look_at(studio, path, wanted):
    """Say what becomes of a tab whose file was damaged."""
    try:
        tab = studio.fork(SessionFile(path))
        found = all_shown(call_of(tab))
        if not tab.losses:
            return "harmless" if found == wanted else "silent"
        # What is still there must be as it was, but for a lost second shape and the text of the step
        # that is now the first; and the tab must go on, now and after a restart.
        if not {step[0:1] + step[4:] for step in found} <= {
            step[0:1] + step[4:] for step in wanted
        }:
            return "silent"
        owners = np.zeros(tab.mesh.n_vertices, dtype=np.uint8)
        call_of(tab)("finish", {"kind": "select", "text": "On"}, {"regions": owners})
        again = studio.fork(SessionFile(path))
        require(not again.losses, again.losses)
        require(shown(call_of(again)) == shown(call_of(tab)), "The change was not kept.")
    except es.StoreError:
        return "named error"
    except Exception as error:  # noqa: BLE001  that there is none is what is shown
        print(f"{type(error).__name__}: {error}")
        return "bare errors"
    return "said, and the tab goes on" if path.with_suffix(".broken").exists() else "silent"


def main():
    """Run what the command line asks for, and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=300)
    parser.add_argument("--flips", type=int, default=333)
    parser.add_argument("--seed", type=int, default=55)
    options = parser.parse_args()
    for attempt, number in ((try_kills, options.kills), (try_flips, options.flips)):
        if number:
            with tempfile.TemporaryDirectory() as folder:
                seen = attempt(number, Path(folder), np.random.default_rng(options.seed))
            print(
                attempt.__name__, *(f"{what}: {n}" for what, n in sorted(seen.items())), sep="\n  "
            )


if __name__ == "__main__":
    main()
