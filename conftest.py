"""Options of all tests, those of the studio too: which share of the broad sweeps is run, and what tests cost."""

import os
import subprocess
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from zlib import crc32

import pytest

ROOT = Path(__file__).resolve().parent
TURNS = 10  # commits until every part of every sweep has been run
TURN = pytest.StashKey[int | None]()
COST = "CPU seconds"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("eigenshape")
    group.addoption("--nightly", action="store_true", help="run every part of the broad sweeps")
    group.addoption("--turn", type=int, choices=range(TURNS), help="the part of sweeps to run")
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


@pytest.hookimpl(trylast=True)  # after other files have marked their tests
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the tests marked `sweep` that have another turn.

    The tests of a file take turns one after the other. Those with the same argument, `sweep("ch5_parts")`, have the
    same turn, wherever they are.
    """
    turn = config.stash[TURN]
    if turn is None:
        return
    places: Counter[Path] = Counter()
    kept, left_out = [], []
    for item in items:
        mark = item.get_closest_marker("sweep")
        if mark is None:
            kept.append(item)
            continue
        key = mark.args[0] if mark.args else item.path.name
        place = crc32(key.encode()) + (0 if mark.args else places[item.path])
        places[item.path] += 1
        (kept if place % TURNS == turn else left_out).append(item)
    config.hook.pytest_deselected(items=left_out)
    items[:] = kept


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
    """Print where the CPU time went."""
    n_dearest = config.getoption("--cpu")
    if n_dearest is None:
        return
    costs: Counter[str] = Counter()
    folders: Counter[str] = Counter()
    for reports in terminalreporter.stats.values():
        for report in reports:
            if getattr(report, "when", None) == "teardown":
                cost = sum(value for name, value in report.user_properties if name == COST)
                costs[report.nodeid] = cost
                folders["/".join(report.nodeid.split("::")[0].split("/")[:-1])] += cost
    terminalreporter.section("CPU seconds, those of processes that were started included")
    for place, cost in [
        ("all", costs.total()),
        *folders.most_common(),
        *costs.most_common(n_dearest),
    ]:
        terminalreporter.write_line(f"{cost:9.2f}  {place}")
