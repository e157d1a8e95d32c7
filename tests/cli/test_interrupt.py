"""Ctrl-C, as a terminal sends it to a command and its workers: exit code 130 and one line, whenever it comes."""

import os
import signal
import subprocess
import sys
import time

import pytest

from eigenshape.cli.verbs import interruptible
from eigenshape.io.mesh_files import write_mesh
from eigenshape.retrieval.index import ShapeIndex
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import icosphere

pytestmark = pytest.mark.skipif(
    not hasattr(os, "killpg"), reason="groups of processes are a Unix thing"
)

# A background job has Ctrl-C ignored and hands that on, also to this test and from here to the command.
RESTORE = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
RUN = "from eigenshape_command import main; main()\n"
# Say that a moment has come, and wait there for the signal.
WAIT_AT = """
import sys
def wait(event, arguments):
    if event == {event!r} and str(arguments[0]) == {what!r}:
        print("reached", flush=True)
        signal.pause()
sys.addaudithook(wait)
"""


def start(*arguments, before=RESTORE):
    command = [sys.executable, "-c", before + RUN, *map(str, arguments)]
    return subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_until(happens, running):
    deadline = time.monotonic() + 300
    while not happens():
        assert running.poll() is None, running.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.005)


def press_ctrl_c(running):
    """Return the exit code and what was said."""
    os.killpg(running.pid, signal.SIGINT)
    said = running.communicate()[1]
    return running.returncode, said


@pytest.fixture
def ball(tmp_path):
    path = tmp_path / "ball.ply"
    write_mesh(icosphere(2), path)
    return path


@pytest.fixture
def herd(tmp_path):
    folder = tmp_path / "herd"
    folder.mkdir()
    for number in range(4):
        write_mesh(make_creature("fish", number, n_vertices=800), folder / f"fish{number}.ply")
    return folder


@pytest.mark.long
@pytest.mark.parametrize(
    ("module", "said"),
    [
        ("typer", "stopped\n"),
        ("eigenshape.cli.verbs", "stopped\n"),
        ("numpy", "stopped; what was finished is kept\n"),  # the verb has begun
    ],
)
def test_while_libraries_are_imported(ball, module, said):
    running = start("info", ball, before=RESTORE + WAIT_AT.format(event="import", what=module))
    assert running.stdout.readline() == "reached\n"
    assert press_ctrl_c(running) == (130, said)


@pytest.mark.long
@pytest.mark.parametrize("verb", ["info", "spectrum", "query"])
def test_while_a_verb_runs(ball, tmp_path, verb):
    places = (ShapeIndex.create(tmp_path / "index").folder, ball) if verb == "query" else (ball,)
    running = start(verb, *places, before=RESTORE + WAIT_AT.format(event="open", what=str(ball)))
    assert running.stdout.readline() == "reached\n"
    assert press_ctrl_c(running) == (130, "stopped; what was finished is kept\n")


class Finalized:
    """An object in whose finalizer Ctrl-C is pressed, where Python cannot raise it."""

    def __del__(self):
        signal.raise_signal(signal.SIGINT)


def finalize_and_go_on():
    Finalized()
    while True:
        pass


def fail_when_stopped():
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt as error:
        raise ValueError from error


@pytest.mark.parametrize("work", [finalize_and_go_on, fail_when_stopped])
def test_where_python_cannot_raise_it_and_where_it_becomes_another_error(work):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), interruptible():
            work()
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.long
@pytest.mark.parametrize("sign", ["index.sqlite", "changes.txt"])
def test_while_workers_start_and_work(herd, tmp_path, sign):
    """The first sign comes before the workers' own imports, the second with the first shape."""
    db = tmp_path / "db"
    running = start(
        "index", "add", db, herd, "--workers", 2, "--views", 0, "--method", "scale-free"
    )
    wait_until((db / sign).exists, running)
    assert press_ctrl_c(running) == (130, "stopped; what was finished is kept\n")
    assert len(ShapeIndex.open(db)) < 4


@pytest.mark.long
def test_after_everything_is_done(ball):
    """What an exit handler waits for, a thread say, ends at once."""
    at_exit = (
        "import atexit; atexit.register(lambda: print('reached', flush=True) or signal.pause())\n"
    )
    running = start("info", ball, "--json", before=RESTORE + at_exit)
    while running.stdout.readline() != "reached\n":
        assert running.poll() is None
    assert press_ctrl_c(running) == (130, "stopped\n")


@pytest.mark.long
def test_a_background_job_goes_on(ball):
    ignore = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
    at_file = "import sys, os\nsys.addaudithook(lambda event, what: event == 'open' and str(what[0]) == {!r} and {})\n"
    signalled = "os.kill(os.getpid(), signal.SIGINT)"
    running = start("info", ball, before=ignore + at_file.format(str(ball), signalled))
    said, complaint = running.communicate()
    assert (running.returncode, complaint) == (0, "")
    assert "162" in said
