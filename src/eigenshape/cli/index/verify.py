"""eigenshape index verify: compare an index with its checksums."""

from __future__ import annotations

from pathlib import Path

import typer

import eigenshape as es
from eigenshape.cli.console import count_shapes, escape_text, out, print_json

DAMAGED = 1  # exit code


def verify(index: Path, *, as_json: bool = False) -> None:
    """Read every byte of an index and name what is damaged.

    The exit code is 1 if anything is. Index the named shapes again, or merge the index into a new
    one, which keeps what is whole.
    """
    report = es.ShapeIndex.open(index).verify()
    if as_json:
        counts = {"shapes": report.n_shapes, "bytes": report.n_bytes}
        print_json(counts | {"damages": report.damages})
    else:
        for damage in report.damages:
            out.print(f"[red]damaged:[/] {escape_text(damage)}")
        verdict = "no damage" if not report.damages else f"{len(report.damages)} places damaged"
        out.print(
            f"{count_shapes(report.n_shapes)}, {report.n_bytes:,} bytes compared with their "
            f"checksums: {verdict}"
        )
    if report.damages:
        raise typer.Exit(DAMAGED)
