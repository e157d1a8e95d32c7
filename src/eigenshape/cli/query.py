"""eigenshape query: which shapes of an index are most similar to a scan, and which features correspond."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import typer

import eigenshape as es
from eigenshape._text import literal
from eigenshape.cli import steps
from eigenshape.cli.console import out, print_json, print_table, progress_bar
from eigenshape.cli.inputs import (
    JsonOption,
    RepairOption,
    StoredMethodOption,
    repair_names,
    require_method,
)


def query(
    index: Annotated[Path, typer.Argument(help="Folder of the index.")],
    scan: Annotated[
        Path,
        typer.Argument(
            help="Mesh file to search for: a whole shape or a part of one, in any pose."
        ),
    ],
    *,
    n_matches: Annotated[
        int, typer.Option("-n", "--n-matches", min=1, help="Number of matches to show.")
    ] = 5,
    method: StoredMethodOption = None,
    repair: RepairOption = "",
    picture: Annotated[
        Path | None,
        typer.Option(
            help="Draw the scan beside its matches, corresponding parts in one color (PNG, SVG or "
            "PDF)."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the shapes of an index that are most like a scan, and which features correspond."""
    steps.require_picture(picture)
    if method is not None:
        require_method(method)
    shelf = es.ShapeIndex.open(index)
    recipe = steps.query_recipe(shelf, method)
    surface = steps.load_mesh(scan, repair)
    began = perf_counter()
    with progress_bar("describe") as progress:
        shape = steps.color_query(surface, recipe, progress)
    described = perf_counter()
    matches = shelf.query(shape.descriptor, n_matches=n_matches)
    answered = perf_counter()
    if as_json:
        seconds = {"describe": described - began, "query": answered - described}
        print_json(
            {
                "scan": str(scan),
                "seconds": seconds,
                "matches": [_facts(shape, match) for match in matches],
            }
        )
    else:
        print_matches(matches)
        out.print("score: 0 for the same description, about 1 if nothing is alike")
        out.print(
            f"described in {described - began:.2f} s, answered in {1000 * (answered - described):.0f} ms"
        )
    if picture:
        names = literal(scan.name), literal(index.name)
        caption = (
            f"{names[0]} and the {len(matches)} most similar shapes in {names[1]} ({steps.CAPTION})"
        )
        title, repairs = literal(scan.stem), repair_names(repair)
        steps.save_picture(
            steps.contact_sheet(shape, title, matches, repairs=repairs, caption=caption), picture
        )


def _facts(shape: steps.ColoredQuery, match: es.retrieval.Match) -> dict[str, Any]:
    pairs = [
        {
            "query_vertex": int(shape.descriptor.vertices[one]),
            "match_vertex": int(match.vertices[two]),
        }
        for one, two in match.correspondences
    ]
    return {
        "name": match.name,
        "class": match.label,
        "source": match.source,
        "score": match.score,
        "correspondences": pairs,
    }


def print_matches(matches: Sequence[es.retrieval.Match]) -> None:
    """Print matches, best first, with the number of corresponding points."""
    rows = [
        [match.name, match.label or "", f"{match.score:.4g}", str(len(match.correspondences))]
        for match in matches
    ]
    print_table("Most similar shapes", ["shape", "class", "score", "corresponding points"], rows)
