"""Time, memory, residuals and missed eigenvalues of `solve_spectrum` beside other libraries, in one run on one core.

    python benchmarks/bench_spectrum.py                              everything; an hour or two
    python benchmarks/bench_spectrum.py --quick                      three small shapes, a minute
    python benchmarks/bench_spectrum.py --cases dragon --libraries eigenshape,LaPy
    python benchmarks/bench_spectrum.py a.off b.ply -k 300           meshes of your own

Every library is called as its documentation does (`spectrum_libraries.py`), each time in a new process with one thread,
and they take turns: A B C, A B C, A B C. A figure is the median of its repetitions; a ratio to ours under 1.4 is a tie.
Ours includes the proof that nothing is missing, theirs prove nothing; so what they return is compared with the
certified eigenvalues of their own matrices.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from report import THREADS, Row, dump, new_figures, options_of
from rich.console import Console
from spectrum_cases import FULL, QUICK, Case
from spectrum_libraries import LIBRARIES, OURS
from spectrum_tables import HEADER, cells, printed, title

import eigenshape as es

WORKER = Path(__file__).with_name("spectrum_worker.py")
MEDIANS = ("cpu", "wall", "cpu_build", "memory", "memory_peak", "residual")
ALSO = ["numpy", "scipy", "threadpoolctl"]


def arguments(argv: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = options_of(__doc__)
    parser.add_argument("meshes", nargs="*", type=Path, help="mesh files, instead of the cases")
    parser.add_argument("--cases", help=f"of {', '.join(FULL)}; with --quick of {', '.join(QUICK)}")
    parser.add_argument(
        "--libraries", help="parts of names, separated by commas; ours is always there"
    )
    parser.add_argument("-k", type=int, help="eigenpairs, instead of what the case has")
    parser.add_argument(
        "--limit", type=float, default=900.0, help="seconds after which a process is stopped"
    )
    return parser.parse_args(argv)


def chosen_cases(options: argparse.Namespace) -> dict[str, Case]:
    """Return the cases to run."""
    if options.meshes:
        return {
            path.name: Case(path.name, lambda path=path: es.read_mesh(path), options.k or 300)
            for path in options.meshes
        }
    cases = QUICK if options.quick else FULL
    names = options.cases.split(",") if options.cases else list(cases)
    unknown = [name for name in names if name not in cases]
    if unknown:
        sys.exit(f"Cases must be of {', '.join(cases)}; {unknown[0]!r} is not.")
    return {name: cases[name] for name in names}


def chosen_libraries(options: argparse.Namespace, takes: str) -> list[str]:
    """Return ours first, then the others that take such a shape."""
    parts = options.libraries.lower().split(",") if options.libraries else [""]
    fitting = [
        name
        for name, library in LIBRARIES.items()
        if library.takes == takes and name != OURS[takes]
    ]
    return [OURS[takes], *(name for name in fitting if any(part in name.lower() for part in parts))]


def run_worker(task: Row, limit: float) -> Row:
    """Measure once in a new process; what goes wrong there is the result."""
    environment = os.environ | dict.fromkeys(THREADS, "1")
    command = [sys.executable, str(WORKER), json.dumps(task)]
    try:
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=limit, check=False
        )
    except subprocess.TimeoutExpired:
        return {"status": "over the limit", "reason": f"stopped after {limit:g} s"}
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [""])[-1]
        return {"status": "failed", "reason": f"process ended with {done.returncode}: {last}"[:200]}
    return json.loads(done.stdout.strip().splitlines()[-1])


def summary(runs: list[Row]) -> Row:
    """Return medians of the runs, and the checks of the first; or why there is none."""
    bad = next((run for run in runs if run["status"] != "ok"), None)
    if bad:
        return bad
    medians = {key: statistics.median(run[key] for run in runs) for key in MEDIANS}
    return runs[0] | medians | {"cpu_runs": [run["cpu"] for run in runs]}


def run_case(name: str, case: Case, options: argparse.Namespace, console: Console) -> list[Row]:
    """Measure every library on one case, taking turns, and return a row each."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shape.npz"
        n = case.save(path)
        k = min(options.k or case.k, n - 1)
        runs: dict[str, list[Row]] = {
            library: [] for library in chosen_libraries(options, case.takes)
        }
        core = max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 0
        for repeat in range(options.repeats):
            for library, done in runs.items():
                if done and done[-1]["status"] != "ok":
                    continue
                with console.status(f"{name}: {library}, {repeat + 1} of {options.repeats}"):
                    task = {
                        "shape": str(path),
                        "library": library,
                        "k": k,
                        "core": core,
                        "check": repeat == 0,
                    }
                    done.append(run_worker(task, options.limit))
    rows = [
        {"case": name, "title": case.title, "n": n, "k": k, "library": library} | summary(done)
        for library, done in runs.items()
    ]
    return with_ratios(rows)


def with_ratios(rows: list[Row]) -> list[Row]:
    """Add CPU seconds and memory over ours, which is the first row."""
    ours = rows[0]
    for row in rows:
        if row["status"] == ours["status"] == "ok":
            row["ratio"] = row["cpu"] / ours["cpu"]
            row["memory_ratio"] = row["memory"] / ours["memory"] if ours["memory"] > 0 else None
    return rows


def measure(options: argparse.Namespace) -> None:
    """Run all chosen cases, print each when it is done, and write what was asked for."""
    console = Console()
    packages = sorted({library.package for library in LIBRARIES.values()})
    figures = new_figures(
        [*packages, *ALSO],
        ("shape", *HEADER),
        "one thread",
        repeats=options.repeats,
        limit=options.limit,
        calls={name: library.call for name, library in LIBRARIES.items()},
    )
    for name, case in chosen_cases(options).items():
        rows = run_case(name, case, options, console)
        console.print(printed(rows))
        figures["rows"] += rows
        figures["table"] += [(title(row), *cells(row)) for row in rows]
        if options.json:
            dump(options.json, figures)


if __name__ == "__main__":
    measure(arguments())
