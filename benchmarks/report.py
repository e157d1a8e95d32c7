"""What every benchmark does alike: its options, a process for each call, its table, and where that is written."""

import argparse
import datetime
import json
import multiprocessing
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from machine import describe

TIE = 1.4
END = "<!-- end -->\n"
THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "IGL_NUM_THREADS",
)
Row = dict[str, Any]


def options_of(text: str | None, **settings: Any) -> argparse.ArgumentParser:
    """Return a parser with what every benchmark takes, and the first line of the script's text as its help."""
    parser = argparse.ArgumentParser(description=(text or "").splitlines()[0], **settings)
    parser.add_argument("--quick", action="store_true", help="something small, in seconds")
    parser.add_argument(
        "--repeats", type=int, default=3, help="runs of each, of which the median is taken"
    )
    parser.add_argument("--json", type=Path, help="write all figures")
    parser.add_argument(
        "--markdown", type=Path, help="write the table; into a page between its two marks"
    )
    return parser


def in_process(work: Callable[..., Row], *arguments: object) -> Row:
    """Call in a new process, on one core with one thread."""
    os.environ |= dict.fromkeys(THREADS, "1")
    with multiprocessing.get_context("spawn").Pool(1, one_core) as pool:
        return pool.apply(work, arguments)


def one_core() -> None:
    """Keep this process on the last core that it may use."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def ratio_text(ratio: float) -> str:
    """Return a ratio to ours, marked where it is too near to call."""
    return f"{ratio:.1f}" + (" (tie)" if 1 / TIE < ratio < TIE and ratio != 1 else "")


class Report:
    """Rows of one benchmark: printed as they come, and written where the options say."""

    def __init__(
        self,
        script: str,
        packages: list[str],
        options: argparse.Namespace,
        columns: Sequence[str],
        cells: Callable[[Row], Sequence[str]],
    ) -> None:
        """Take the script's `__file__`, and how it makes texts of a row; the first names what rows have in common."""
        self.script, self.options, self.columns, self.cells = (
            Path(script).name,
            options,
            columns,
            cells,
        )
        self.figures = new_figures(packages, repeats=options.repeats)

    def add(self, row: Row) -> None:
        """Keep a row, also in the JSON file, and print it."""
        self.figures["rows"].append(row)
        if self.options.json:
            dump(self.options.json, self.figures)
        print(*self.cells(row), sep="  ", flush=True)

    def write(self) -> None:
        """Write the table, if one was asked for."""
        if self.options.markdown:
            rows = [self.cells(row) for row in self.figures["rows"]]
            put(
                self.options.markdown,
                f"{measured_on(self.figures)}\n\n{table(self.columns, rows)}",
                self.script,
            )


def new_figures(packages: list[str], **settings: object) -> dict[str, Any]:
    """Return figures without rows yet: the day, the machine, and the settings."""
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    return {"date": today, "machine": describe(packages), "settings": settings, "rows": []}


def dump(path: Path, figures: dict[str, Any]) -> None:
    """Write all figures as JSON."""
    path.write_text(json.dumps(figures, indent=1, ensure_ascii=False) + "\n")


def measured_on(figures: dict[str, Any]) -> str:
    """Say when and on what figures were measured, in one paragraph."""
    machine, repeats = figures["machine"], figures["settings"]["repeats"]
    versions = [f"{name} {number}" for name, number in machine["versions"].items() if number]
    speed = figures["settings"].get("speed")
    parts = (
        f"Measured {figures['date']} on one of {machine['cores']} cores, {machine['cpu']}, {machine['memory_gib']} GiB",
        f"load {machine['load'][0]} at the start{f', {speed}' if speed else ''}; {machine['system']}",
        f"Python {machine['python']}; {', '.join([*versions, *machine['blas']])}",
    )
    runs = f"Medians of {repeats} unless the table says so." if repeats > 1 else "One run each."
    return f"{', '.join(parts)}. {runs}"


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table for a page; a first cell that repeats the one above it is left empty."""
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    before = None
    for first, *others in rows:
        lines.append(f"| {' | '.join(['' if first == before else first, *others])} |")
        before = first
    return "\n".join(lines) + "\n"


def put(path: Path, text: str, script: str) -> None:
    """Write a section to a file; where the file has the two marks of the script, between them."""
    page, begin = path.read_text() if path.exists() else "", f"<!-- {script} --markdown -->\n"
    if begin in page and END in page.split(begin)[1]:
        before, rest = page.split(begin)
        text = before + begin + "\n" + text + "\n" + END + rest.split(END, 1)[1]
    path.write_text(text)
