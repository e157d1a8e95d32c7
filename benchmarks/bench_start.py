"""Starting: importing eigenshape beside other libraries, and the help of the command line.

    python benchmarks/bench_start.py                  half a minute
    python benchmarks/bench_start.py --quick          two starts, seconds

Each start is a process of its own, so that nothing is loaded already. The first run of each warms the
disk and is not counted; the others take turns, so that a busy moment of the machine affects all of them.
CPU seconds of the process, user and system, median; a ratio under 1.4 is a tie. Libraries that are not
installed are left out.
"""

import importlib.util
import resource
import statistics
import subprocess
import sys

from report import Report, Row, options_of, ratio_text

PACKAGES = ["eigenshape", "lapy", "trimesh", "libigl", "typer", "numpy", "scipy"]
COLUMNS = ("start", "CPU s", "to import eigenshape")
COMMAND = "from eigenshape_command import main; main()"
OURS = "import eigenshape"
STARTS = {
    OURS: ["-c", OURS],
    "import lapy": ["-c", "import lapy"],
    "import trimesh": ["-c", "import trimesh"],
    "import igl": ["-c", "import igl"],
    "eigenshape --help": ["-c", COMMAND, "--help"],
    "eigenshape query --help": ["-c", COMMAND, "query", "--help"],
}
QUICK = (OURS, "eigenshape --help")
REPEATS = 7


def start_seconds(arguments: list[str]) -> float:
    """Run Python once; return the CPU seconds that it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def is_installed(name: str) -> bool:
    """Return whether the module of an `import` is installed."""
    words = name.split()
    return words[0] != "import" or importlib.util.find_spec(words[1]) is not None


def cells(row: Row) -> list[str]:
    """Return a row as text."""
    return [row["start"], f"{row['cpu']:.3f}", ratio_text(row["ratio"])]


def main() -> None:
    """Measure, print, and write what the options ask for."""
    parser = options_of(__doc__)
    parser.set_defaults(repeats=REPEATS)
    options = parser.parse_args()
    names = [name for name in (QUICK if options.quick else STARTS) if is_installed(name)]
    report = Report(PACKAGES, options, COLUMNS, cells)
    for name in names:
        start_seconds(STARTS[name])
    rounds = [{name: start_seconds(STARTS[name]) for name in names} for _ in range(options.repeats)]
    medians = {name: statistics.median(taken[name] for taken in rounds) for name in names}
    for name, cpu in medians.items():
        report.add({"start": name, "cpu": cpu, "ratio": cpu / medians[OURS]})


if __name__ == "__main__":
    main()
