"""eigenshape index verify: compare an index with its checksums."""

from __future__ import annotations

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import escape_text, out, print_json
from eigenshape.cli.inputs import IndexArgument, JsonOption

DAMAGED = 1  # exit code


def verify(index: IndexArgument, *, as_json: JsonOption = False) -> None:
    """Read every byte of an index and name what is damaged.

    The exit code is 1 if anything is. Index the named shapes again, or merge the index into a new
    one, which keeps what is whole.
    """
    report = es.ShapeIndex.open(index).verify()
    if as_json:
        damages = [vars(damage) for damage in report.damages]
        print_json({"shapes": report.n_shapes, "bytes": report.n_bytes, "damages": damages})
    else:
        for damage in report.damages:
            out.print(f"[red]damaged:[/] {escape_text(damage)}")
        verdict = "no damage" if not report.damages else f"{len(report.damages)} places damaged"
        out.print(
            f"{steps.count_shapes(report.n_shapes)}, {report.n_bytes:,} bytes compared with their "
            f"checksums: {verdict}"
        )
    if report.damages:
        raise typer.Exit(DAMAGED)
