"""Options of all tests, those of the studio too: whose tests, which share of the broad sweeps, what they cost."""

import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from zlib import crc32

import pytest

ROOT = Path(__file__).resolve().parent
STUDIO = ROOT / "studio" / "tests"
sys.path.append(str(ROOT / "tests" / "house"))
from budgets import SECONDS, read_budgets, write_budgets  # noqa: E402
from groups import GROUPS, group_of  # noqa: E402

TURNS = 10  # commits until every part of every sweep has been run
TURN = pytest.StashKey[int | None]()
COST = "CPU seconds"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("eigenshape")
    group.addoption("--nightly", action="store_true", help="run every part of the broad sweeps")
    group.addoption("--turn", type=int, choices=range(TURNS), help="the part of sweeps to run")
    group.addoption(
        "--half",
        action="store_true",
        help="of files with long tests, and of those of the studio, the half whose turn it is",
    )
    group.addoption("--group", choices=GROUPS, help="collect the tests of one group alone")
    group.addoption(
        "--record", action="store_true", help="write the CPU time of groups into budgets.toml"
    )
    group.addoption(
        "--cpu", type=int, metavar="N", help="print the CPU time of folders and N tests"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Decide once which turn it is; None if all are run."""
    turn = config.getoption("--turn")
    if config.getoption("--nightly"):
        turn = None
    elif turn is None:
        turn = turn_of_commit()
    config.stash[TURN] = turn


def turn_of_commit() -> int:
    """Return the turn that the files of the commit decide, so that it is the same on every machine."""
    command = ["git", "rev-parse", "HEAD^{tree}"]
    try:
        found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):  # an archive of the sources, without git
        return 0
    return int(found.stdout, 16) % TURNS


def pytest_report_header(config: pytest.Config) -> str:
    """Say which turn it is, so that a failure can be repeated."""
    turn = config.stash[TURN]
    if turn is None:
        return "sweeps: every turn"
    return f"sweeps: turn {turn} of 0..{TURNS - 1} (the same again: --turn {turn}; all: --nightly)"


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out files of other groups unread."""
    group = config.getoption("--group")
    if group is None or collection_path.is_dir():
        return None
    return group_of(collection_path, "tests") != group or None


@pytest.hookimpl(trylast=True)  # after other files have marked their tests
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the tests marked `sweep` that have another turn, and half of the long ones if asked to.

    The tests of a file take turns one after the other. Those with the same argument, `sweep("ch5_parts")`, have the
    same turn, wherever they are. Long tests of one file share what they make, and are in one half.
    """
    turn = config.stash[TURN]
    if turn is None:
        return
    waiting = set()
    if config.getoption("--half"):
        files = sorted({item.path for item in items if _is_long(item)})
        # Not by odd and even turns, which decide in `check.py` which BLAS a file has.
        waiting = set(files[turn // (TURNS // 2) :: 2])
    places: Counter[Path] = Counter()
    kept, left_out = [], []
    for item in items:
        mark = item.get_closest_marker("sweep")
        if mark is None:
            (left_out if item.path in waiting and _is_long(item) else kept).append(item)
            continue
        key = mark.args[0] if mark.args else item.path.name
        place = crc32(key.encode()) + (0 if mark.args else places[item.path])
        places[item.path] += 1
        (kept if place % TURNS == turn else left_out).append(item)
    config.hook.pytest_deselected(items=left_out)
    items[:] = kept


def _is_long(item: pytest.Item) -> bool:
    return item.get_closest_marker("long") is not None or STUDIO in item.path.parents


@pytest.fixture(scope="session")
def in_turn(request: pytest.FixtureRequest) -> Callable[[Sequence[str]], list[str]]:
    """Return a function that chooses the parts whose turn it is, for a test that sweeps over many."""
    turn = request.config.stash[TURN]
    return lambda parts: list(parts) if turn is None else list(parts)[turn::TURNS]


@pytest.hookimpl(wrapper=True, tryfirst=True)
def _measure(item: pytest.Item) -> Generator[None, object, object]:
    """Note the CPU time of a setup, call or teardown, and that of processes that have ended in it."""
    before = sum(os.times()[:4])
    try:
        return (yield)
    finally:
        item.user_properties.append((COST, sum(os.times()[:4]) - before))


pytest_runtest_setup = pytest_runtest_call = pytest_runtest_teardown = _measure


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Print where the CPU time went, and record it."""
    costs: Counter[str] = Counter()
    groups: Counter[str] = Counter()
    for reports in terminalreporter.stats.values():
        for report in reports:
            if getattr(report, "when", None) == "teardown":
                cost = sum(value for name, value in report.user_properties if name == COST)
                costs[report.nodeid] = cost
                file = ROOT / report.nodeid.split("::")[0]
                groups[group_of(file, "tests") or "the whole house"] += cost
    if config.getoption("--record"):
        budgets = read_budgets()
        for group in GROUPS.keys() & groups.keys():
            budgets[group][SECONDS] = groups[group]
        write_budgets(budgets)
    n_dearest = config.getoption("--cpu")
    if n_dearest is None:
        return
    terminalreporter.section("CPU seconds, those of processes that were started included")
    rows = [("all", costs.total()), *groups.most_common(), *costs.most_common(n_dearest)]
    for place, cost in rows:
        terminalreporter.write_line(f"{cost:9.2f}  {place}")
