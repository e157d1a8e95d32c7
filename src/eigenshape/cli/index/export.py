"""eigenshape index export: descriptors for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import print_written
from eigenshape.cli.inputs import FilterOption, IndexArgument


def export(
    index: IndexArgument,
    *,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", help="Folder to write to: a new one, or an empty one."),
    ],
    where: FilterOption = None,
) -> None:
    """Write the descriptors of shapes, and what is known of them, for other programs.

    records.json lists the shapes, descriptors.npz holds their arrays.
    """
    shelf = es.ShapeIndex.open(index)
    filters = steps.parse_filters(where)
    names = None if not filters else [record.name for record in shelf.records(where=filters)]
    shelf.export(output, names)
    print_written(output)
