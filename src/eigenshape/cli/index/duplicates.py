"""eigenshape index duplicates: shapes that are nearly the same."""

from __future__ import annotations

from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli.console import out, print_json, print_table, progress_bar
from eigenshape.cli.inputs import IndexArgument, JsonOption


def duplicates(
    index: IndexArgument,
    *,
    score: Annotated[
        float,
        typer.Option(
            min=0,
            help="Largest score of two shapes that count as nearly the same. Copies have a score "
            "near 0, also if they are moved or scaled, and other poses often less than 0.1.",
        ),
    ] = 0.1,
    as_json: JsonOption = False,
) -> None:
    """List pairs of shapes that are nearly the same, wherever they lie and whatever their size."""
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
