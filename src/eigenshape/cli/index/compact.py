"""eigenshape index compact: give space back."""

from __future__ import annotations

from pathlib import Path

import eigenshape as es
from eigenshape.cli.console import out, print_json


def compact(index: Path, *, as_json: bool = False) -> None:
    """Give back the space of removed and replaced shapes.

    The last pages of the file move into free ones, so it takes as long as the removal. Queries go on
    meanwhile.
    """
    n_bytes = es.ShapeIndex.open(index).compact()
    if as_json:
        print_json({"index": str(index), "bytes": n_bytes})
    else:
        out.print(f"{n_bytes:,} bytes were given back")
