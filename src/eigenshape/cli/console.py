"""What verbs print: tables, JSON, progress bars, notes on stderr. Nothing heavy is imported here."""

import json
import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import typer
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from certeig.kit.progress import Callback
from certeig.kit.text import printable

out = Console(highlight=False, soft_wrap=True)
err = Console(stderr=True, highlight=False, soft_wrap=True)

SOME_FAILED = 3  # exit code where some of several inputs failed, and the others are done
NUMBERS = "+-.0123456789"  # first characters of a number
LEAST_WIDTH = 8  # characters of a column that stay however narrow the terminal is
FRAME = 3  # characters of a table beside those of each column


def escape_text(text: object) -> str:
    """Return outside text, such as a file's name, as a terminal can show it: no control codes and no markup."""
    return escape(printable(str(text)))


def print_json(value: Any) -> None:
    """Print a value as JSON on stdout, results of the library among it.

    A result becomes an object, as `result_facts` has it. Arrays become lists, numbers that are not
    finite become null, and paths become text.
    """
    typer.echo(json.dumps(_plain(value), indent=2, allow_nan=False))


def result_facts(result: Any, *left_out: str) -> dict[str, Any]:
    """Return the fields and properties of a result by name, for JSON.

    What it explains in words is its `explanation`. Shapes and large arrays should be left out by name.
    """
    names = [field.name for field in fields(result)]
    for kind in type(result).__mro__:
        for name, member in vars(kind).items():
            if isinstance(member, property | cached_property):
                names.append(name)
    facts = {name: getattr(result, name) for name in names if name not in left_out}
    if hasattr(result, "explain") and "explanation" not in left_out:
        facts["explanation"] = result.explain()
    return facts


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        value = result_facts(value)
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):  # arrays and numbers of numpy, which is not imported for this
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def print_table(title: str, columns: list[str], rows: list[list[str]]) -> None:
    """Print rows under their headings, numbers to the right."""
    table = Table(title=title, title_justify="left", title_style="bold", header_style="bold")
    rows = [
        [printable(text) for text in row] for row in rows
    ]  # escapes are wider than what they name
    cells = [[row[index] for row in rows] for index in range(len(columns))]
    widths = [
        max(map(cell_len, [name, *texts])) for name, texts in zip(columns, cells, strict=True)
    ]
    numeric = [all(text[:1] in NUMBERS for text in texts) and any(texts) for texts in cells]
    # In a narrow terminal the longest texts are wrapped, numbers are not. Rich alone would leave no
    # character of a short column beside a long one.
    room = out.width - FRAME * len(columns) - 1
    longest = max(widths)
    while sum(widths) > room and longest > LEAST_WIDTH:
        longest -= 1
        widths = [
            width if is_number else min(width, longest)
            for width, is_number in zip(widths, numeric, strict=True)
        ]
    for index, (column, width) in enumerate(zip(columns, widths, strict=True)):
        justify: Literal["left", "right"] = "right" if numeric[index] and index else "left"
        table.add_column(column, justify=justify, no_wrap=numeric[index], width=width)
    for row in rows:
        table.add_row(*map(escape, row))
    out.print(table)


def count_shapes(number: int) -> str:
    """Return a number of shapes in words."""
    return f"{number} shape" if number == 1 else f"{number} shapes"


def print_repairs(report: tuple[str, ...]) -> None:
    """Print on stderr what repairs did."""
    for line in report:
        err.print(f"[yellow]repair:[/] {escape_text(line)}")


def print_written(path: Path) -> None:
    """Print on stderr that a file was written."""
    err.print(f"wrote {escape_text(path)}")


@contextmanager
def progress_bar(title: str) -> Iterator[Callable[[float, str], None]]:
    """Show a bar on stderr, if that is a terminal, while the block runs.

    The block calls what it is given with the share that is done and the name of the current step.
    """
    # A Progress that is disabled prints an empty line at its end, before rich 14.3.
    if not err.is_terminal:
        yield lambda share, step: None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=err, transient=True) as bar:
        task = bar.add_task(title, total=1.0)

        def update(share: float, step: str) -> None:
            description = f"{title}: {escape_text(step)}" if step else title
            bar.update(task, completed=share, description=description)

        yield update


def batch_reporter(
    progress: Callable[[float, str], None], failed: str = "not indexed", *, lines: bool = False
) -> Callback:
    """Return what a batch calls after each file: it moves the bar, and names a file that failed.

    Where stderr is a file, there is no bar; a batch that takes hours prints `lines` in its place.
    """

    def report(n_done: int, n_items: int, name: str, error: str | None) -> None:
        step = f"{n_done} of {n_items}, {name}"
        progress(n_done / n_items, step)
        if lines and not err.is_terminal:
            err.print(escape_text(step))
        if error is not None:
            err.print(f"[yellow]{failed}:[/] {escape_text(name)}: {escape_text(error)}")

    return report


def print_failures(failures: Iterable[tuple[str, str]]) -> None:
    """Name what failed, and why; on a terminal `batch_reporter` has done so already."""
    if not (out.is_terminal and err.is_terminal):
        for name, reason in failures:
            out.print(f"  [yellow]{escape_text(name)}[/]: {escape_text(reason)}")


def print_address(what: str, url: str) -> None:
    """Say where a page is open, at once, so that a program that started us can read it."""
    out.print(f"The {what} is open at {escape_text(url)}")
    out.file.flush()
