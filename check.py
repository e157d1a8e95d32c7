"""Run the checks: format, lint, types, layers, tests. CI runs this same file.

python check.py            all of it but the long tests; two to five minutes on two cores
python check.py --all      the long tests, the docs site and the studio in a browser, too
python check.py --nightly  as --all, with every part of the broad sweeps; a commit runs a tenth of these
python check.py --fast     without the tests
"""

import os
import platform
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np  # noqa: F401  brings the BLAS that is looked for
from conftest import TURNS, turn_of_commit
from threadpoolctl import threadpool_info

FIRST = {
    "format": ["-m", "ruff", "format", "--check", "."],
    "lint": ["-m", "ruff", "check", "."],
}
TYPES_AND_LAYERS = {
    "types": ["-m", "mypy"],
    "layers": ["-c", "from importlinter.cli import lint_imports_command as main; main()"],
}
# Each process takes half of the files in a row, so that tests of one file share what they make.
TESTS = ["-m", "pytest", "--dist", "worksteal"]
CERTEIG = ["-m", "pytest", "certeig/tests", "certeig/src"]  # with the options of its own package
STUDIO = [
    "-m",
    "pytest",
    "studio/tests",
]  # in one process, which waits for a browser most of the time
DOCS = ["-m", "sphinx", "-q", "-W", "--keep-going", "docs"]
OPTIONS = {"--all", "--nightly", "--fast"}


def main() -> int:
    """Run the checks and print which failed."""
    options = set(sys.argv[1:])
    if unknown := options - OPTIONS:
        sys.exit(
            f"check.py takes --all, --nightly or --fast; it was given {', '.join(sorted(unknown))}."
        )
    everything = options & {"--all", "--nightly"}
    nightly = sorted(options & {"--nightly"})  # an option of pytest, too
    # Tests start hundreds of processes, each of which would translate all modules anew.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    # Threads of BLAS burn a core while they wait for each other. Tests, docs and studio share two
    # cores, where eigenvalues of a matrix of 300 rows took 130 times as long with two threads.
    if not nightly:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with tempfile.TemporaryDirectory() as site:
        beside, tests = dict(TYPES_AND_LAYERS), {}
        if "--fast" not in options:
            beside["certeig"] = [*CERTEIG, *(["--types", "-m", ""] if everything else [])]
        if everything:
            pages = run_gallery(0, 1) if nightly else run_gallery(turn_of_commit(), TURNS)
            beside |= {"docs": [*DOCS, *pages, site], "studio": [*STUDIO, *nightly]}
            tests["all tests"] = [*TESTS, *two_processes(), *nightly]
        elif "--fast" not in options:
            tests["tests"] = [*TESTS, *two_processes(), "-m", "not long"]
        failed = run_checks(FIRST)
        # Beside the tests, so that no core waits: types take one, and the studio half of one.
        with ThreadPoolExecutor(2) as pool:
            for found in pool.map(run_checks, [tests, beside]):
                failed += found
    print("== readability, for looking and not for enforcing", flush=True)
    subprocess.run([sys.executable, "tests/house/readability.py"], check=True)
    print("== figures that are older than what they time, for looking", flush=True)
    subprocess.run([sys.executable, "benchmarks/figures.py", "--stale"], check=True)
    names = [*FIRST, *beside, *tests]
    print(f"failed: {', '.join(failed)}" if failed else f"passed: {', '.join(names)}")
    return 1 if failed else 0


def two_processes() -> list[str]:
    """Return the options of two processes of tests, the second with another BLAS kernel.

    No answer may depend on the family of the CPU. Every other commit swaps the halves of the tests
    that they begin with. Kernels are chosen by OpenBLAS on x86 alone.
    """
    blas = [library for library in threadpool_info() if library["internal_api"] == "openblas"]
    if not blas or platform.machine() not in ("x86_64", "AMD64"):
        return ["-n", "2"]
    used = {library["architecture"] for library in blas}
    # OpenBLAS takes Zen for Haswell, so that Haswell would be no other kernel there.
    kernel = "Sandybridge" if used <= {"Haswell", "Zen"} else "Haswell"
    processes = ["popen", f"popen//env:OPENBLAS_CORETYPE={kernel}"]
    if turn_of_commit() % 2:
        processes.reverse()
    return ["--tx", processes[0], "--tx", processes[1]]


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
