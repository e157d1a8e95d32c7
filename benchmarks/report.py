"""What every benchmark does alike: its options, a process for each call, its rows, and the file that keeps them."""

import argparse
import datetime
import json
import multiprocessing
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from machine import command, commit, describe

TIE = 1.4
THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
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
    parser.add_argument("--json", type=Path, help="write all figures and their table")
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
    """Rows of one run of a benchmark: printed as they come, and written where the options say."""

    def __init__(
        self,
        packages: list[str],
        options: argparse.Namespace,
        columns: Sequence[str],
        cells: Callable[[Row], Sequence[str]],
        *,
        threads: str = "one thread",
    ) -> None:
        """Take how texts of a row are made; the first names what rows have in common."""
        self.options, self.cells = options, cells
        self.figures = new_figures(packages, columns, threads, repeats=options.repeats)

    def add(self, row: Row) -> None:
        """Keep a row, also in the JSON file, and print it."""
        self.figures["rows"].append(row)
        self.figures["table"].append(list(self.cells(row)))
        if self.options.json:
            dump(self.options.json, self.figures)
        print(*self.figures["table"][-1], sep="  ", flush=True)


def new_figures(
    packages: list[str], columns: Sequence[str], threads: str, **settings: object
) -> dict[str, Any]:
    """Return figures without rows yet: the command, the day, the commit, the machine and the settings."""
    return {
        "command": command("--json"),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "commit": commit(),
        "machine": describe(packages) | {"threads": threads},
        "settings": settings,
        "columns": list(columns),
        "table": [],
        "rows": [],
    }


def dump(path: Path, figures: dict[str, Any]) -> None:
    """Write figures as JSON, one line for each entry and for each row."""
    lines = []
    for name, value in figures.items():
        if name in ("table", "rows") and value:
            items = ",\n  ".join(json.dumps(item, ensure_ascii=False) for item in value)
            lines.append(f" {json.dumps(name)}: [\n  {items}\n ]")
        else:
            lines.append(f" {json.dumps(name)}: {json.dumps(value, ensure_ascii=False)}")
    path.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
