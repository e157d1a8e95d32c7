"""eigenshape index convert: an index of an older format."""

from __future__ import annotations

from pathlib import Path

from eigenshape.cli import steps
from eigenshape.cli.console import count_shapes, escape_text, out, print_json


def convert(old: Path, new: Path, *, as_json: bool = False) -> None:
    """Write an index of an older version anew, in the format of this one.

    The old index is not changed. Shapes whose numbers are damaged are left out with a warning.

    Parameters
    ----------
    old
        Folder of an index of format 7 or 8.
    new
        Folder for the new index: a new or an empty one.
    """
    n_shapes = steps.convert_index(old, new)
    if as_json:
        print_json({"index": str(new), "shapes": n_shapes})
    else:
        out.print(f"{count_shapes(n_shapes)} converted; the index is {escape_text(new)}")
