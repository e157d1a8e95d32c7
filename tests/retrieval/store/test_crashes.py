"""A writer that is killed, or whose disk is full, leaves the state before its change or after it."""

import ctypes
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import store_trials
from describers import descriptor, keep

import eigenshape as es
from eigenshape.retrieval import DescribedShape

pytestmark = pytest.mark.long

kills = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kill -9 is a Unix thing")


@kills
def test_killed_writers_leave_the_state_before_or_after(tmp_path):
    """`python tests/store_trials.py --kills 1000` kills more."""
    assert store_trials.try_kills(tmp_path / "index", 20) == 20


# Fails each write to a regular file from the n-th on, as a full disk does.
FULL_DISK = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <sys/stat.h>
#include <sys/types.h>
static long left = -1;
void arm_full_disk(long n) { left = n; }
static int is_full(int fd) {
    struct stat facts;
    if (left < 0 || fstat(fd, &facts) || !S_ISREG(facts.st_mode)) return 0;
    if (left > 0) { left--; return 0; }
    errno = ENOSPC;
    return 1;
}
ssize_t write(int fd, const void *data, size_t n) {
    static ssize_t (*real)(int, const void *, size_t);
    if (!real) real = dlsym(RTLD_NEXT, "write");
    return is_full(fd) ? -1 : real(fd, data, n);
}
ssize_t pwrite64(int fd, const void *data, size_t n, off64_t at) {
    static ssize_t (*real)(int, const void *, size_t, off64_t);
    if (!real) real = dlsym(RTLD_NEXT, "pwrite64");
    return is_full(fd) ? -1 : real(fd, data, n, at);
}
ssize_t pwrite(int fd, const void *data, size_t n, off_t at) { return pwrite64(fd, data, n, at); }
"""


@pytest.fixture(scope="module")
def full_disk(tmp_path_factory):
    compiler = shutil.which("cc")
    if compiler is None or sys.platform != "linux":
        pytest.skip("a full disk is played by a C library, on Linux")
    folder = tmp_path_factory.mktemp("full")
    (folder / "full.c").write_text(FULL_DISK)
    library = folder / "full.so"
    command = [compiler, "-shared", "-fPIC", "-o", library, folder / "full.c", "-ldl"]
    subprocess.run(command, check=True)
    return library


def run_on_a_full_disk(library, folder, first, step):
    """Run `main` of this file with the library loaded."""
    here = Path(__file__).parent
    paths = [str(here), str(here.parents[1]), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"LD_PRELOAD": str(library), "PYTHONPATH": os.pathsep.join(paths)}
    command = [sys.executable, "-m", "test_crashes", library, folder, str(first), str(step)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return int(done.stdout)


def test_without_space_the_old_index_is_intact(full_disk, tmp_path):
    assert run_on_a_full_disk(full_disk, tmp_path, 0, 10) == 20


@pytest.mark.sweep
@pytest.mark.long
def test_without_space_at_each_of_the_first_two_hundred_writes(full_disk, tmp_path):
    assert run_on_a_full_disk(full_disk, tmp_path, 0, 1) == 200


def steps_of(index, part):
    """Yield changes of an index, and the names that it holds after each."""
    names = {f"s{seed}" for seed in range(5)}
    for round_ in range(8):
        new = [f"r{round_}-{number}" for number in range(3)]
        shapes = [DescribedShape(name, [descriptor(9)], thumbnail=bytes(3000)) for name in new]
        names = names | set(new)
        yield (lambda shapes=shapes: index.add_many(shapes)), names
        names = names - {new[0]}
        yield (lambda name=new[0]: index.remove(name)), names
        names = names | {"part"}
        yield (lambda: index.merge([part])), names
        yield index.compact, names


def refusal_of(act):
    """Return why a change is refused, or nothing."""
    try:
        act()
    except es.StoreError as err:
        return str(err)
    return ""


def main(library, place, first, step):
    """Fail at the so manieth write and at all that follow, and compare the index with its last state."""
    arm = ctypes.CDLL(library).arm_full_disk
    sound = es.ShapeIndex.create(place / "sound")
    sound.add_many(DescribedShape(f"s{seed}", [descriptor(seed)]) for seed in range(5))
    part = es.ShapeIndex.create(place / "part")
    keep(part, "part", [descriptor(77)], digest="part")
    n_failed = 0
    for number in range(first, 200, step):
        index = es.ShapeIndex(Path(shutil.copytree(sound.folder, place / f"index {number}")))
        kept = {f"s{seed}" for seed in range(5)}
        arm(ctypes.c_long(number))
        for act, names in steps_of(index, part):
            message = refusal_of(act)
            if message:
                break
            kept = names
        assert "needs space on its disk" in message, message
        n_failed += 1
        arm(ctypes.c_long(-1))
        assert {record.name for record in index.records()} == kept, number
        report = index.verify()
        assert report.damages == (), report
        assert index.query(descriptor(2))[0].score == 0
        act()  # with space again
        assert {record.name for record in index.records()} == names, number
        assert index.verify().damages == ()
        shutil.rmtree(index.folder)
    return n_failed


if __name__ == "__main__":
    n_failed = main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]))
    sys.stdout.write(f"{n_failed}\n")
