"""Run the checks: format, lint, types, layers, tests. CI runs this same file.

python check.py            all of it but the long tests and the studio; four minutes on two cores
python check.py core       only the files and quick tests of a group of tests/house/groups.toml; two minutes
python check.py --all      the long tests, the docs site and the studio in a browser, too; twenty minutes
python check.py --rest     what `python check.py` leaves of `--all`
python check.py --nightly  everything; a commit runs half of the long tests and a tenth of the broad sweeps
python check.py --fast     without the tests
python check.py --record   the quick tests alone, and write their CPU seconds into tests/house/budgets.toml
"""

import argparse
import os
import platform
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np  # noqa: F401  brings the BLAS that is looked for
from conftest import GROUPS, TURNS, turn_of_commit
from threadpoolctl import threadpool_info

FORMAT, LINT, TYPES = ["-m", "ruff", "format", "--check"], ["-m", "ruff", "check"], ["-m", "mypy"]
LAYERS = ["-c", "from importlinter.cli import lint_imports_command as main; main()"]
PYTEST = ["-m", "pytest", "--cpu", "40"]
QUICK = ["-m", "not long"]
CERTEIG = ["-m", "pytest", "certeig/tests", "certeig/src"]  # with the options of its own package
DOCS = ["-m", "sphinx", "-q", "-W", "--keep-going", "docs"]

Checks = dict[str, list[str]]


def main() -> int:
    """Run the checks and print which failed."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("group", nargs="?", choices=GROUPS)
    modes = parser.add_mutually_exclusive_group()
    for mode in ("all", "rest", "nightly", "fast", "record"):
        modes.add_argument(f"--{mode}", dest="mode", action="store_const", const=mode)
    options = parser.parse_args()
    if options.group and options.mode:
        parser.error("a group is checked without options")
    # Tests start hundreds of processes, each of which would translate all modules anew.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    # Threads of BLAS and OpenMP burn a core while they wait for each other. Tests, docs and studio
    # share two cores, where eigenvalues of a matrix of 300 rows took 130 times as long with two.
    if options.mode != "nightly":
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        os.environ.setdefault("OMP_NUM_THREADS", "1")
    with tempfile.TemporaryDirectory() as site:
        if options.group:
            first, *chains = checks_of_group(options.group)
        else:
            first, *chains = checks_of_all(options.mode, site)
        failed = run_checks(first)
        # Side by side, so that no core waits: types take one, and the studio half of one.
        with ThreadPoolExecutor(len(chains)) as pool:
            for found in pool.map(run_checks, chains):
                failed += found
    if not options.group and options.mode != "record":
        print("== readability, for looking and not for enforcing", flush=True)
        subprocess.run([sys.executable, "tests/house/readability.py"], check=True)
        print("== figures that are older than what they time, for looking", flush=True)
        subprocess.run([sys.executable, "benchmarks/figures.py", "--stale"], check=True)
    names = [name for checks in (first, *chains) for name in checks]
    print(f"failed: {', '.join(failed)}" if failed else f"passed: {', '.join(names)}")
    return 1 if failed else 0


def checks_of_group(group: str) -> list[Checks]:
    """Return the checks of the files of one group to begin with, its quick tests, and what runs beside them."""
    sources, tests = GROUPS[group]["sources"], GROUPS[group]["tests"]
    first = {"format": [*FORMAT, *sources, *tests], "lint": [*LINT, *sources, *tests]}
    quick = [*PYTEST, *QUICK, "--group", group, *tests]
    if group != "studio":  # which waits for a browser most of the time, in one process
        quick += two_processes()
    beside: Checks = {"types": [*TYPES, *sources]}
    if group == "certeig":
        beside["tests without shapes"] = CERTEIG
    return [first, {"tests": quick}, beside]


def checks_of_all(mode: str | None, site: str) -> list[Checks]:
    """Return the checks to begin with, and those that run side by side; the docs go to the folder `site`."""
    if mode == "record":
        # The same seconds on every day: all by one kernel, and no other process.
        quick = [*PYTEST, *QUICK, "--record"]
        return [{}, {"tests": quick, "tests of the studio": [*quick, "studio/tests"]}]
    first: Checks = {"format": [*FORMAT, "."], "lint": [*LINT, "."]}
    beside: Checks = {"types": TYPES, "layers": LAYERS}
    if mode == "fast":
        return [first, beside]
    if mode is None:
        beside["certeig"] = CERTEIG
        return [first, {"tests": [*PYTEST, *QUICK, *two_processes()]}, beside]
    nightly = mode == "nightly"
    share = ["--nightly"] if nightly else ["--half"]
    turn, turns = (0, 1) if nightly else (turn_of_commit(), TURNS)
    beyond: Checks = {
        # With the types of arguments checked; its long tests are the rest of a sweep.
        "certeig": [*CERTEIG, "--types", *(["-m", ""] if nightly else [])],
        "docs": [*DOCS, *run_gallery(turn, turns), site],
    }
    studio: Checks = {"studio": [*PYTEST, *share, "studio/tests"]}
    if mode == "rest":
        return [
            {},
            {"long tests": [*PYTEST, *share, "-m", "long", *two_processes()]},
            beyond,
            studio,
        ]
    return [first, {"all tests": [*PYTEST, *share, *two_processes()]}, beside | beyond, studio]


def two_processes() -> list[str]:
    """Return the options of two processes of tests, the second with another BLAS kernel.

    No answer may depend on the family of the CPU. Every other commit swaps the halves of the tests
    that they begin with. Kernels are chosen by OpenBLAS on x86 alone.
    """
    blas = [library for library in threadpool_info() if library["internal_api"] == "openblas"]
    # Each takes half of the files in a row, so that tests of one file share what they make.
    shared = ["--dist", "worksteal"]
    if not blas or platform.machine() not in ("x86_64", "AMD64"):
        return ["-n", "2", *shared]
    used = {library["architecture"] for library in blas}
    # OpenBLAS takes Zen for Haswell, so that Haswell would be no other kernel there.
    kernel = "Sandybridge" if used <= {"Haswell", "Zen"} else "Haswell"
    processes = ["popen", f"popen//env:OPENBLAS_CORETYPE={kernel}"]
    if turn_of_commit() % 2:
        processes.reverse()
    return ["--tx", processes[0], "--tx", processes[1], *shared]


def run_gallery(turn: int, turns: int) -> list[str]:
    """Return the options of a build of the docs that runs the scripts of the gallery which have this turn.

    They run here and nowhere else, also where their pages are there from an older library.
    """
    scripts = sorted(path.name for path in Path("gallery").rglob("plot_*.py"))
    pattern = "|".join(map(re.escape, scripts[turn::turns]))
    return [
        *["-D", "sphinx_gallery_conf.run_stale_examples=1"],
        *["-D", f"sphinx_gallery_conf.filename_pattern={pattern}"],
    ]


def run_checks(checks: dict[str, list[str]]) -> list[str]:
    """Run checks one after the other, and return which failed.

    The tests show how far they are. What the others print is shown when they end, each in one piece.
    """
    failed = []
    for name, command in checks.items():
        output = None if "tests" in name else subprocess.PIPE
        done = subprocess.run(
            [sys.executable, *command],
            check=False,
            stdout=output,
            stderr=output and subprocess.STDOUT,
            text=True,
        )
        print(f"== {name}\n{done.stdout or ''}", end="", flush=True)
        if done.returncode:
            failed.append(name)
    return failed


if __name__ == "__main__":
    sys.exit(main())
