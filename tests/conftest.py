"""What every test may lean on: the real data where it is there, and shapes checked at run time."""

import json
import os
import sys
from pathlib import Path

import pytest
import runtime_types
import scipy.linalg  # noqa: F401 - its BLAS must be there to be limited
from threadpoolctl import threadpool_limits

runtime_types.install()

TESTS = Path(__file__).resolve().parent
ROOT = TESTS.parent
BEYOND_THE_QUICK_PART = ("analytic", "benchmarks", "laws", "oracle")
DATA = Path(os.environ.get("EIGENSHAPE_DATA", ROOT.parent / "shared" / "data"))


def pytest_configure(config: pytest.Config) -> None:
    """Give each worker of pytest-xdist one thread of BLAS: two workers with two each fight for two cores."""
    if hasattr(config, "workerinput"):
        threadpool_limits(1, user_api="blas")
    if config.getoption("--nightly"):
        runtime_types.Limit.calls = sys.maxsize


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave folders that are beyond the quick part unread, where it is asked for alone."""
    is_beyond = collection_path.parent == TESTS and collection_path.name in BEYOND_THE_QUICK_PART
    return (is_beyond and config.option.markexpr == "not long") or None


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Begin to count the calls whose types are checked."""
    runtime_types.Limit.test += 1
    runtime_types.Limit.file = item.nodeid.split("::")[0]


def pytest_sessionfinish() -> None:
    """Write which functions were called by which files, if a folder is named for that."""
    if folder := os.environ.get("EIGENSHAPE_CALLS"):
        path = Path(folder, f"{os.getpid()}.json")
        path.write_text(json.dumps(runtime_types.callers))


@pytest.hookimpl(tryfirst=True)  # before long tests are left out
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark folders that are beyond the quick part; skip what reads real shapes where they are absent."""
    for item in items:
        if item.path.relative_to(TESTS).parts[0] in BEYOND_THE_QUICK_PART:
            item.add_marker(pytest.mark.long)
    # unless CI asks for them to be there
    if DATA.is_dir() or os.environ.get("EIGENSHAPE_REQUIRE_DATA"):
        return
    skip = pytest.mark.skip(
        reason=f"real shapes are absent: {DATA} is not a folder (set EIGENSHAPE_DATA)"
    )
    for item in items:
        if "data" in item.keywords:
            item.add_marker(skip)


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of real shapes; a test that uses it is marked `data`."""
    return DATA
