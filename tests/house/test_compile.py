"""Compiled loops are kept where the machine lets them be kept, and run where it does not."""

import gc
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core import event

import eigenshape._compile
from eigenshape._compile import make_private, njit, temporary_folder

SOURCE = Path(__file__).resolve().parents[2] / "src"
MEASURE = """
import eigenshape as es
print(es.geometry.geodesic_distances(es.icosphere(1), [0]).max())
"""


def test_every_loop_is_compiled_in_one_way():
    users = [
        path
        for path in SOURCE.rglob("*.py")
        if re.search(r"numba(\.| import )njit", path.read_text())
    ]
    assert [path.name for path in users] == ["_compile.py"]


@pytest.fixture
def closed_copy(tmp_path):
    """A copy of the package beside whose sources nothing can be kept, not even by root: a file is in the way."""
    copy = tmp_path / "installed"
    shutil.copytree(SOURCE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    for folder in [path for path in copy.rglob("*") if path.is_dir()]:
        (folder / "__pycache__").write_text("in the way")
    (tmp_path / "temporary").mkdir()
    return copy


def run_without_home(code, installed):
    """Run code from a package and with a home in which nothing can be kept."""
    temporary = installed.parent / "temporary"
    settings = {"PYTHONPATH": str(installed), "HOME": os.devnull, "TMPDIR": str(temporary)}
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    }
    done = subprocess.run(
        [sys.executable, "-B", "-c", code],
        check=False,
        env=kept | settings,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.long
def test_a_private_folder_keeps_loops_where_the_package_and_the_home_cannot(closed_copy):
    done = run_without_home(MEASURE, closed_copy)
    assert "Warning" not in done.stderr
    kept = closed_copy.parent / "temporary" / temporary_folder().name
    assert kept.stat().st_mode & 0o777 == 0o700
    assert list(kept.rglob("*.nbi"))


@pytest.mark.long
def test_without_any_folder_loops_are_compiled_each_time_and_it_is_said_once(closed_copy):
    (closed_copy.parent / "temporary" / temporary_folder().name).write_text("in the way")
    done = run_without_home(
        f"import warnings; warnings.simplefilter('always')\n{MEASURE}", closed_copy
    )
    assert done.stderr.count("Set NUMBA_CACHE_DIR to such a folder") == 1


class CollectorRecorder(event.Listener):
    """Whether the garbage collector runs when compilations start."""

    def __init__(self):
        self.collects = []

    def on_start(self, event):
        self.collects.append(gc.isenabled())

    def on_end(self, event):
        pass


@pytest.mark.parametrize("collects", [True, False])
def test_the_garbage_collector_pauses_while_loops_compile_and_not_longer(
    tmp_path, monkeypatch, collects
):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    @njit
    def inner(value):
        return value + 1

    @njit
    def outer(value):
        return inner(value) + 1

    @njit
    def failing(value):
        return value.no_such_attribute

    theirs = numba.njit(inner.py_func)
    before = gc.isenabled()
    try:
        (gc.enable if collects else gc.disable)()
        with event.install_listener("numba:compile", CollectorRecorder()) as recorder:
            assert outer(1) == 3
            assert gc.isenabled() is collects
            with pytest.raises(numba.TypingError, match="no_such_attribute"):
                failing(1)
            assert gc.isenabled() is collects
            assert recorder.collects == [False] * 3
            assert theirs(1) == 2
            assert recorder.collects[3:] == [collects]
    finally:
        (gc.enable if before else gc.disable)()


def stderr_on_a_terminal(code, cache):
    """Run code in a new process whose stderr is a terminal, and return what it writes there."""
    ours, theirs = os.openpty()
    settings = {"PYTHONPATH": str(SOURCE), "NUMBA_CACHE_DIR": str(cache)}
    try:
        done = subprocess.run(
            [sys.executable, "-c", code], check=False, env=os.environ | settings, stderr=theirs
        )
        assert done.returncode == 0
        os.write(theirs, b"END")
        written = b""
        while not written.endswith(b"END"):
            written += os.read(ours, 4096)
    finally:
        os.close(ours)
        os.close(theirs)
    return written.decode().removesuffix("END")


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "openpty"), reason="a terminal that is no window needs a pty")
def test_a_terminal_is_told_once_that_loops_compile_and_only_when_they_do(tmp_path):
    two_threads = f"""
from concurrent.futures import ThreadPoolExecutor
import eigenshape as es
with ThreadPoolExecutor(2) as pool:
    list(pool.map(lambda source: es.geometry.geodesic_distances(es.icosphere(1), [source]), range(2)))
{MEASURE}"""
    assert stderr_on_a_terminal(two_threads, tmp_path).count("eigenshape compiles its loops") == 1
    assert list(tmp_path.rglob("*.nbi"))
    assert stderr_on_a_terminal(two_threads, tmp_path) == ""


@pytest.mark.long
def test_nothing_is_written_about_compiling_where_there_is_no_terminal(tmp_path):
    settings = {"PYTHONPATH": str(SOURCE), "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", MEASURE], check=True, env=os.environ | settings, capture_output=True
    )
    assert list(tmp_path.rglob("*.nbi"))
    assert done.stderr == b""


def double(value):
    return 2 * value


@pytest.fixture
def loop_folder(tmp_path, monkeypatch):
    """Where a loop is kept that was compiled for whole and for real numbers."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    loop = njit(double)
    assert loop(2) == 4
    assert loop(0.25) == 0.5
    (folder,) = tmp_path.iterdir()
    assert sorted(path.suffix for path in folder.iterdir()) == [".nbc", ".nbc", ".nbi"]
    return folder


def n_loaded():
    """Call the loop as a new process would: return how many of its two forms came from the disk."""
    loop = njit(double)
    assert loop(2) == 4
    assert loop(0.25) == 0.5
    return sum(loop.stats.cache_hits.values())


def flip_a_bit(content, generator):
    place, bit = generator.integers(len(content)), generator.integers(8)
    flipped = bytes([content[place] ^ (1 << bit)])
    return content[:place] + flipped + content[place + 1 :]


DAMAGES = {
    "a flipped bit": flip_a_bit,
    "cut": lambda content, generator: content[: generator.integers(1, len(content))],
    "empty": lambda content, generator: b"",
    "noise": lambda content, generator: generator.bytes(len(content)),
    "longer": lambda content, generator: content + b"\0",
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=list(DAMAGES))
@pytest.mark.parametrize(("suffix", "n_left"), [(".nbi", 0), (".1.nbc", 1), (".2.nbc", 1)])
def test_a_damaged_file_of_a_loop_is_compiled_again_and_replaced(
    loop_folder, damage, suffix, n_left
):
    generator = np.random.default_rng(0)
    assert n_loaded() == 2
    (path,) = loop_folder.glob(f"*{suffix}")
    for _ in range(3):
        path.write_bytes(damage(path.read_bytes(), generator))
        assert n_loaded() == n_left
        assert n_loaded() == 2


def test_a_loop_of_other_versions_is_compiled_again(loop_folder, monkeypatch):
    monkeypatch.setattr(eigenshape._compile, "MADE_BY", "another numba")
    assert n_loaded() == 0
    assert n_loaded() == 2


def test_code_for_other_types_is_not_run_under_a_name_that_two_processes_gave(loop_folder):
    one, two = sorted(loop_folder.glob("*.nbc"))
    shutil.copy(one, two)
    assert n_loaded() == 1
    assert n_loaded() == 2


def test_a_file_of_a_loop_that_cannot_be_read_is_compiled_again(loop_folder):
    (index,) = loop_folder.glob("*.nbi")
    index.unlink()
    index.mkdir()
    eigenshape._compile._warn_once.cache_clear()
    with pytest.warns(UserWarning, match="must be kept in a folder with space left"):
        assert n_loaded() == 0


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="folders are closed by their owner's number")
def test_a_folder_that_others_can_write_to_is_not_believed(tmp_path):
    folder = tmp_path / "loops"
    make_private(folder)
    assert folder.stat().st_mode & 0o777 == 0o700
    folder.chmod(0o777)
    with pytest.raises(PermissionError, match="must belong to its user alone"):
        make_private(folder)
    link = tmp_path / "link"
    link.symlink_to(tmp_path)
    with pytest.raises(PermissionError, match="must belong to its user alone"):
        make_private(link)
