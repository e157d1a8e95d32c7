"""Space is freed from inside, on a disk that is full to its last byte and below a limit of files."""

import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from describers import RECIPE, descriptor

import eigenshape as es
from eigenshape.retrieval import DescribedShape

MOUNT = 'mount -t tmpfs -o size=8m tmpfs "$1" && shift && exec "$@"'
LIMIT = 3_000_000  # bytes of a file
DATABASE = "index.sqlite"

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform != "linux", reason="the disk is a tmpfs of Linux"),
]


def run(prefix, *arguments):
    """Run `main` of this file in a process of its own, behind a command."""
    here = Path(__file__).parent
    paths = [str(here), str(here.parents[1]), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    command = [*prefix, sys.executable, "-m", "test_full_disk", *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.fixture
def small_disk(tmp_path):
    """A command that runs another one where a folder is a disk of 8 MB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    prefix = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", MOUNT, "sh", str(disk)]
    if shutil.which("unshare") is None or subprocess.run([*prefix, "true"], check=False).returncode:
        pytest.skip("a disk takes the right to mount one")
    return [*prefix, "env", f"DISK={disk}"]


@pytest.mark.parametrize("at_once", [1, 40])
@pytest.mark.parametrize("reader", ["alone", "read"])
def test_a_full_disk_is_freed_from_inside(small_disk, at_once, reader):
    run(small_disk, "disk", str(at_once), reader)


@pytest.mark.parametrize("at_once", [1, 20])
def test_a_file_at_its_limit_is_made_shorter(tmp_path, at_once):
    run(["env", f"DISK={tmp_path}"], "limit", str(at_once), "alone")


def shape(number):
    """Return a shape of 24 KB, which takes two pages."""
    rng = np.random.default_rng(number)
    rows = [es.retrieval.HeatDescriptor(rng.random((1000, 3)), np.arange(1000), RECIPE)]
    return DescribedShape(f"s{number}", [*rows, descriptor(number)], thumbnail=bytes(4000))


def fill(disk):
    """Take all that is left of a disk."""
    with suppress(OSError), (disk / "rest").open("ab", buffering=0) as file:
        while True:
            file.write(bytes(4096))


def main(kind, at_once, is_read):
    """Add shapes until there is no space, then remove some of them until there is."""
    disk = Path(os.environ["DISK"])
    if kind == "limit":
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, LIMIT))
    index = es.ShapeIndex.create(disk / "index")
    reader = index.reader() if is_read else None
    names = []

    def refresh():
        if reader is not None:
            reader.refresh()
            assert len(reader) == len(names)

    def grow():
        while True:
            shapes = [shape(len(names) + number) for number in range(at_once)]
            index.add_many(shapes)
            names.extend(each.name for each in shapes)
            refresh()

    with pytest.raises(es.StoreError, match="needs space on its disk"):
        grow()
    assert len(names) >= 40
    np.random.default_rng(0).shuffle(names)
    freed = 0
    for _ in range(6):
        if kind == "disk":
            fill(disk)
            assert shutil.disk_usage(disk).free == 0
        assert len(index) == len(names)
        index.remove(names.pop(), names.pop())
        refresh()
        if kind == "disk":
            fill(disk)  # another program may take what a removal gives up
        freed += index.compact()
        refresh()
    assert freed > 12 * 10_000
    if kind == "disk":
        (disk / "rest").unlink()
    index.add_many([shape(1000)])
    assert {record.name for record in index.records()} == {*names, "s1000"}
    assert index.query(shape(1000).descriptors[0])[0].name == "s1000"
    assert index.verify().damages == ()
    size = (index.folder / DATABASE).stat().st_size
    assert size <= LIMIT or kind == "disk"


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3] == "read")
