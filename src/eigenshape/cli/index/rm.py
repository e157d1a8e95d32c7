"""eigenshape index rm: remove shapes."""

from __future__ import annotations

from typing import Annotated

import typer

import eigenshape as es
from eigenshape._errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import out, print_json
from eigenshape.cli.inputs import FilterOption, IndexArgument, JsonOption


def rm(
    index: IndexArgument,
    shapes: Annotated[list[str] | None, typer.Argument(help="Names of shapes.")] = None,
    *,
    where: FilterOption = None,
    as_json: JsonOption = False,
) -> None:
    """Remove shapes from an index.

    Give names, or a filter that chooses shapes. Their space serves shapes that are added later, or
    is given back by `eigenshape index compact`. A shape whose mesh stays in its folder comes back
    with the next `eigenshape index add`.
    """
    shelf = es.ShapeIndex.open(index)
    filters = steps.parse_filters(where)
    if bool(shapes) == bool(filters):
        raise InvalidParameterError(
            "Shapes are removed by their names or by --filter; give one of the two. "
            "`eigenshape index ls` lists the names."
        )
    chosen = shapes or [record.name for record in shelf.records(where=filters)]
    shelf.remove(*chosen)
    if as_json:
        print_json({"index": str(index), "removed": chosen, "shapes": len(shelf)})
    else:
        out.print(f"{steps.count_shapes(len(chosen))} removed; the index holds {len(shelf)}.")
