"""eigenshape match: where each point of a part lies on a whole shape."""

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import out, print_json, progress_bar
from eigenshape.cli.inputs import AutoRepairOption, JsonOption, ShapeArgument, UpOption, ViewOption


def match(
    mesh: ShapeArgument,
    whole: ShapeArgument,
    *,
    scale: Annotated[
        str,
        typer.Option(
            help=(
                "known if both files have one unit of length, unknown to search for the size of "
                "the part, or a number by which its lengths are multiplied. By default the root of "
                "the ratio of areas if both shapes are complete and differ in size, known if not, "
                "and unknown if the part is too large or too small for that."
            )
        ),
    ] = "auto",
    repair: AutoRepairOption = "auto",
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help=(
                "Write the map: a table with face, weights and confidence of each vertex of the "
                "part (CSV), the same as arrays (NPZ), or the nearest vertex of the whole, one a "
                "line, as `stability --map` reads it (TXT)."
            ),
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(help="Draw both, corresponding points in one color (PNG, SVG or PDF)."),
    ] = None,
    view: ViewOption = "auto",
    up: UpOption = "auto",
    as_json: JsonOption = False,
) -> None:
    """Find where each point of a part, a scan or a pose lies on a whole shape.

    Both meshes are repaired first where they need it, and loose pieces are left out; what was done is
    printed.

    For instance: eigenshape match scan.ply cat.ply --picture map.png -o map.csv
    """
    steps.require_picture(picture)
    side = steps.parse_side(view, up)
    steps.require_output(output, steps.MAP_FILES, "A map")
    size = steps.parse_scale(scale)
    ours, theirs = (steps.load_surface(path, repair) for path in (mesh, whole))
    with progress_bar("match") as progress:
        found = es.match_shapes(ours, theirs, scale=size, progress=progress)
    facts = steps.match_facts(found)
    if as_json:
        print_json(
            {
                "path": str(mesh),
                "whole": str(whole),
                **facts,
                "vertices": found.vertices,
                "vertex_confidence": found.confidence,
            }
        )
    else:
        out.print(steps.match_sentence(facts))
    if output:
        steps.save_match(found, output)
    if picture:
        steps.save_picture(es.plot.figure_match(ours, theirs, found, **side), picture)
