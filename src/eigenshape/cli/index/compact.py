"""eigenshape index compact: give space back."""

from __future__ import annotations

from pathlib import Path

import eigenshape as es
from eigenshape.cli.console import out, print_json


def compact(index: Path, *, as_json: bool = False) -> None:
    """Give back the space of removed and replaced shapes.

    Files are written anew beside the old ones, so the disk must hold both for a moment. Queries go
    on meanwhile.
    """
    n_bytes = es.ShapeIndex.open(index).compact()
    if as_json:
        print_json({"index": str(index), "bytes": n_bytes})
    else:
        out.print(f"{n_bytes:,} bytes were given back")
