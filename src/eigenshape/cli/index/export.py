"""eigenshape index export: descriptors for other programs."""

from __future__ import annotations

from pathlib import Path

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import print_written


def export(
    index: Path,
    *,
    output: Path,
    where: list[str] | None = None,
) -> None:
    """Write the descriptors of shapes, and what is known of them, for other programs.

    records.json lists the shapes, descriptors.npz holds their arrays.

    Parameters
    ----------
    output
        Write to this folder, a new or an empty one.
    """
    shelf = es.ShapeIndex.open(index)
    filters = steps.parse_filters(where)
    names = None if not filters else [record.name for record in shelf.records(where=filters)]
    shelf.export(output, names)
    print_written(output)
