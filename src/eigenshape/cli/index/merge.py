"""eigenshape index merge: one index of several."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import err, escape_text, out, print_json
from eigenshape.cli.index.add import NewIndexArgument
from eigenshape.cli.inputs import JsonOption

MOST_NAMED = 5  # shapes that a message names


def merge(
    index: NewIndexArgument,
    others: Annotated[list[Path], typer.Argument(help="Folders of the indexes to add to it.")],
    *,
    replace: Annotated[
        bool,
        typer.Option("--replace", help="Let a shape replace one of the same name."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Make one index of several, by copying them.

    What is damaged in the others is left out with a warning. Shapes with different codebooks do not
    compare: build the others with --codebook.
    """
    parts = [es.ShapeIndex.open(other) for other in others]
    shelf = es.ShapeIndex.open_or_create(index)
    n_added = shelf.merge(parts, replace=replace)
    recipe = shelf.default_recipe()
    apart = [record.name for record in shelf.records() if recipe not in record.recipes]
    if as_json:
        facts = {"index": str(index), "added": n_added, "shapes": len(shelf)}
        print_json(facts | {"not_compared": apart})
    else:
        out.print(f"{steps.count_shapes(n_added)} added; the index holds {len(shelf)}.")
    if apart:
        err.print(
            f"[yellow]not found by queries:[/] {steps.count_shapes(len(apart))}, which "
            f"{recipe.name} does not describe: {escape_text(', '.join(apart[:MOST_NAMED]))}"
            f"{', ...' if len(apart) > MOST_NAMED else ''}. Index their files again, with "
            f"--codebook {escape_text(index)}"
        )
