"""eigenshape pose: a shape in the pose of another one."""

from math import sqrt
from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import out, print_json, progress_bar
from eigenshape.cli.inputs import (
    MESHES_TO_WRITE,
    AutoRepairOption,
    JsonOption,
    MeshArgument,
    UpOption,
    ViewOption,
)


def pose(
    mesh: MeshArgument,
    *,
    like: Annotated[Path, typer.Option("--like", help="Mesh in the wanted pose.")],
    rest: Annotated[
        Path | None,
        typer.Option(
            "--rest",
            help=(
                "The shape of --like, with the same faces, in the pose that the mesh has now. The "
                "mesh is then bent as that shape was bent from --rest to --like."
            ),
        ),
    ] = None,
    repair: AutoRepairOption = "auto",
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help=f"Write the bent mesh ({MESHES_TO_WRITE})."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the mesh before and after (PNG, SVG or PDF).")
    ] = None,
    view: ViewOption = "auto",
    up: UpOption = "auto",
    as_json: JsonOption = False,
) -> None:
    """Bend a mesh into the pose of another one; what corresponds is found by itself.

    All meshes are repaired; what is done to --rest is done to the same faces of --like.

    For instance: eigenshape pose cat.ply --like lion.ply -o bent.ply --picture bent.png
    """
    steps.require_picture(picture)
    side = steps.parse_side(view, up)
    steps.require_mesh_path(output)
    target = steps.load_mesh(mesh, repair)
    source, posed = steps.load_poses(rest or like, like, repair)
    factor = sqrt(es.geometry.surface_area(source) / es.geometry.surface_area(target))
    with progress_bar("match") as progress:
        found = es.match_shapes(target, source, scale=factor, progress=progress)
        if rest:
            bent = es.deformation.transfer_deformation(source, posed, target, found)
        else:
            bent = es.matching.take_pose(target, posed, match=found)
    facts = steps.match_facts(found)
    if as_json:
        print_json({"path": str(mesh), "like": str(like), **facts})
    else:
        out.print(steps.match_sentence(facts))
    if output:
        steps.save_like(mesh, target, output, bent.vertices)
    if picture:
        poses = {"before": target, "after": bent}
        steps.save_picture(es.plot.figure_poses(poses, **side), picture)
