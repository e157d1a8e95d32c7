"""eigenshape index merge: one index of several."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import out, print_json
from eigenshape.cli.index.add import NewIndexArgument
from eigenshape.cli.inputs import JsonOption


def merge(
    index: NewIndexArgument,
    others: Annotated[list[Path], typer.Argument(help="Folders of the indexes to add to it.")],
    *,
    by_reference: Annotated[
        bool,
        typer.Option(
            "--by-reference",
            help="Leave the numbers in the folders of the other indexes, and refer to them. Do not "
            "move or compact those.",
        ),
    ] = False,
    replace: Annotated[
        bool,
        typer.Option("--replace", help="Let a shape replace one of the same name."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Make one index of several, by copying them or by reference.

    What is damaged in the others is left out with a warning.
    """
    parts = [es.ShapeIndex.open(other) for other in others]
    shelf = es.ShapeIndex.open_or_create(index)
    n_added = shelf.merge(parts, copy=not by_reference, replace=replace)
    if as_json:
        print_json({"index": str(index), "added": n_added, "shapes": len(shelf)})
    else:
        out.print(f"{steps.count_shapes(n_added)} added; the index holds {len(shelf)}.")
