"""eigenshape index duplicates: shapes that are nearly the same."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli.console import out, print_json, print_table, progress_bar


def duplicates(
    index: Path,
    *,
    score: Annotated[float, typer.Option(min=0)] = 0.1,
    as_json: bool = False,
) -> None:
    """List pairs of shapes that are nearly the same, wherever they lie and whatever their size.

    Parameters
    ----------
    score
        Largest score of two shapes that count as nearly the same. Copies have a score near 0,
        also if they are moved or scaled, and other poses often less than 0.1.
    """
    shelf = es.ShapeIndex.open(index)
    with progress_bar("duplicates") as progress:
        pairs = es.retrieval.find_duplicates(shelf, most_score=score, progress=progress)
    if as_json:
        rows = [{"shape": one, "other": two, "score": number} for one, two, number in pairs]
        print_json({"index": str(index), "shapes": len(shelf), "pairs": rows})
    elif pairs:
        texts = [[one, two, f"{number:.3f}"] for one, two, number in pairs]
        print_table("Nearly the same", ["shape", "other", "score"], texts)
    else:
        out.print(f"none of {len(shelf)} shapes is nearly the same as another")
