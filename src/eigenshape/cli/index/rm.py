"""eigenshape index rm: remove shapes."""

from __future__ import annotations

from pathlib import Path

import eigenshape as es
from eigenshape._errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import count_shapes, out, print_json


def rm(
    index: Path,
    shapes: list[str] | None = None,
    *,
    where: list[str] | None = None,
    as_json: bool = False,
) -> None:
    """Remove shapes from an index.

    Give names, or a filter that chooses shapes. Their space serves shapes that are added later, or
    is given back by `eigenshape index compact`. A shape whose mesh stays in its folder comes back
    with the next `eigenshape index add`.

    Parameters
    ----------
    shapes
        Names of shapes.
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
        out.print(f"{count_shapes(len(chosen))} removed; the index holds {len(shelf)}.")
