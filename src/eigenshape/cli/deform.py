"""eigenshape deform: a region of a shape turned or moved, the rest following."""

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape._errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import print_written, progress_bar
from eigenshape.cli.inputs import (
    MESHES_TO_WRITE,
    REGIONS,
    JsonOption,
    MeshArgument,
    RepairOption,
    UpOption,
    ViewOption,
)
from eigenshape.deformation.modes import require_mode


def deform(
    mesh: MeshArgument,
    *,
    region: Annotated[str, typer.Option(help=f"Which part to turn or move: {REGIONS}")] = "",
    rotate: Annotated[
        str,
        typer.Option(
            metavar="ROTATION",
            help=(
                "Turn the region about an axis, in degrees: 'x by 90', '0,1,1 by 30', or 'z by "
                "45 @ 0,0.1,0' about a point. By default the axis passes through the middle of the "
                "region's boundary."
            ),
        ),
    ] = "",
    move: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="Move the region by this vector.")
    ] = "",
    fixed: Annotated[
        str,
        typer.Option(
            help="Which part must not move, written as for --region. By default everything outside the "
            "region is held close to its place."
        ),
    ] = "",
    mode: Annotated[
        str,
        typer.Option(
            help=(
                "graded keeps lengths best; uncrossed is stiffer where faces would cross; "
                "thesis is the method as published."
            )
        ),
    ] = "graded",
    n_modes: Annotated[
        int | None,
        typer.Option(
            "-n",
            "--n-modes",
            help=(
                "Number of eigenfunctions: few bend over a wide zone, many bend sharply. By default "
                "8, 50 or 300: the smaller the region beside the rest, the more."
            ),
        ),
    ] = None,
    edits: Annotated[
        Path | None, typer.Option(help="Apply the edits of this JSON file first.")
    ] = None,
    edits_mesh: Annotated[
        Path | None,
        typer.Option(
            help="Mesh on which --edits were made, if it is another one. Their regions then "
            "move to the nearest vertices."
        ),
    ] = None,
    save_edits: Annotated[
        Path | None, typer.Option(help="Write all edits to this JSON file, for --edits.")
    ] = None,
    repair: RepairOption = "",
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
    """Bend, twist or stretch a mesh: a region is turned or moved, and the rest follows smoothly.

    For instance: eigenshape deform scan.ply --region 'y>60%' --rotate 'x by 30' -o bent.ply
    --picture bent.png
    """
    steps.require_picture(picture)
    side = steps.parse_side(view, up)
    steps.require_mesh_path(output)
    steps.require_output(save_edits, (".json",), "A list of edits")
    handles = [name for name in (rotate, move) if name]
    if bool(region) != (len(handles) == 1) or not (region or edits):
        raise InvalidParameterError(
            "Give --region with either --rotate or --move, or give --edits, or both."
        )
    if edits_mesh and not edits:
        raise InvalidParameterError(
            f"--edits-mesh is used together with --edits; it is {edits_mesh}, and --edits is missing."
        )
    checked = require_mode(mode)
    surface = steps.load_mesh(mesh, repair)
    with progress_bar("modes") as progress:
        rig = es.rig_shape(surface, progress=progress)
        source = steps.load_mesh(edits_mesh, repair) if edits_mesh else None
        done = steps.read_edits_for(edits, source or surface) if edits else []
        session = es.deformation.replay(rig, done, source=source)
        if region:
            chosen = steps.parse_region(region, session.mesh, progress)
            stays = steps.parse_region(fixed, session.mesh, progress) if fixed else None
            handle = (
                steps.parse_rotation(rotate, session.mesh, chosen)
                if rotate
                else steps.parse_translation(move)
            )
            turned_or_moved = es.deformation.Move(chosen, handle)
            session.apply(es.deformation.Edit((turned_or_moved,), stays, n_modes, checked))
    steps.print_bend(session.mesh, surface, session.edits, rig, as_json=as_json)
    if output:
        steps.save_like(mesh, surface, output, session.mesh.vertices)
    if save_edits:
        es.io.write_edits(session.edits, surface, save_edits)
        print_written(save_edits)
    if picture:
        shares = steps.displacement_shares(session.mesh, surface, session.edits, rig)
        poses = {"before": surface, "after": session.mesh}
        steps.save_picture(es.plot.figure_poses(poses, shares, **side), picture)
