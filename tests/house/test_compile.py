"""Compiled loops are kept where the machine lets them be kept, and run where it does not."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from eigenshape._compile import make_private, temporary_folder

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
