"""eigenshape deform: a region of a shape turned or moved, the rest following."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import err, print_json, print_table, print_written, progress_bar
from eigenshape.cli.inputs import JsonOption, MeshArgument, RepairOption, load_mesh
from eigenshape.cli.outputs import (
    require_mesh_path,
    require_output,
    require_picture,
    save_like,
    save_picture,
)
from eigenshape.cli.regions import REGIONS, parse_region, parse_rotation, parse_translation
from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import require_mode
from eigenshape.deformation.distortion import measure_distortion
from eigenshape.deformation.edits import Edit, Move
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.rig import EigenRig, rig_shape
from eigenshape.deformation.session import replay
from eigenshape.geometry.crossings import self_intersections
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.edits import read_edits, write_edits
from eigenshape.plot.poses import figure_poses


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
        typer.Option("-o", "--output", help="Write the bent mesh (PLY, OBJ, OFF, STL or GLB)."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the mesh before and after (PNG, SVG or PDF).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Bend, twist or stretch a mesh: a region is turned or moved, and the rest follows smoothly.

    For instance: eigenshape deform scan.ply --region 'y>60%' --rotate 'x by 30' -o bent.ply --picture bent.png
    """
    require_picture(picture)
    require_mesh_path(output)
    require_output(save_edits, (".json",), "A list of edits")
    handles = [name for name in (rotate, move) if name]
    if bool(region) != (len(handles) == 1) or not (region or edits):
        raise InvalidParameterError(
            "Give --region with either --rotate or --move, or --edits, or all of them."
        )
    if edits_mesh and not edits:
        raise InvalidParameterError(
            f"--edits-mesh is used together with --edits; it is {edits_mesh}, and --edits is missing."
        )
    checked = require_mode(mode)
    surface = load_mesh(mesh, repair)
    with progress_bar("modes") as progress:
        rig = rig_shape(surface, progress=progress)
        source = load_mesh(edits_mesh, repair) if edits_mesh else None
        done = _read_edits(edits, source or surface) if edits else []
        session = replay(rig, done, source=source)
        if region:
            chosen = parse_region(region, session.mesh, progress)
            stays = parse_region(fixed, session.mesh, progress) if fixed else None
            handle: Handle = (
                parse_rotation(rotate, session.mesh, chosen) if rotate else parse_translation(move)
            )
            session.apply(Edit((Move(chosen, handle),), stays, n_modes, checked))
    _report(session.mesh, surface, session.edits, rig, as_json=as_json)
    if output:
        save_like(mesh, surface, output, session.mesh.vertices)
    if save_edits:
        write_edits(session.edits, surface, save_edits)
        print_written(save_edits)
    if picture:
        moved = np.linalg.norm(session.mesh.vertices - surface.vertices, axis=1)
        shares = (
            _last_shares(rig, session.edits)
            if len(session.edits) == 1
            else moved / max(moved.max(), 1e-300)
        )
        save_picture(figure_poses({"before": surface, "after": session.mesh}, shares), picture)


def _read_edits(path: Path, mesh: TriangleMesh) -> list[Edit]:
    try:
        return read_edits(path, mesh)
    except InvalidParameterError as error:
        raise InvalidParameterError(
            f"{path}: {error} On the command line, --edits-mesh names it."
        ) from error


def _last_shares(rig: EigenRig, edits: tuple[Edit, ...]) -> np.ndarray:
    edit = edits[0]
    return bind(
        rig, [m.region for m in edit.moves], fixed=edit.fixed, n_modes=edit.n_modes
    ).shares.sum(axis=0)


def _report(
    after: TriangleMesh,
    before: TriangleMesh,
    edits: tuple[Edit, ...],
    rig: EigenRig,
    *,
    as_json: bool,
) -> None:
    found = measure_distortion(before, after)
    moved = np.linalg.norm(after.vertices - before.vertices, axis=1)
    values: dict[str, Any] = {
        "edits": len(edits),
        "modes": rig.n_modes,
        "vertices_moved": int((moved > 0).sum()),
        "edge_error": found.edge_error,
        "edge_error_of_box": found.edge_error_of_box,
        "least_area_ratio": float(found.area_ratios.min()),
        "flipped_faces": found.flipped,
        "crossing_faces": self_intersections(after),
    }
    if as_json:
        print_json(values)
        return
    n_crossing, n_before = len(values["crossing_faces"]), len(self_intersections(before))
    rows = [
        ["edits", f"{len(edits)}"],
        ["vertices that moved", f"{values['vertices_moved']:,} of {before.n_vertices:,}"],
        ["edges stretched, RMS", f"{100 * found.edge_error:.2f} %"],
        ["least area, after over before", f"{values['least_area_ratio']:.2f}"],
        ["faces flipped", f"{len(found.flipped):,}"],
        ["pairs of faces that cross", f"{n_crossing:,} ({n_before:,} before)"],
    ]
    print_table("Bent", ["", "value"], rows)
    if n_crossing > n_before:
        err.print(
            "Faces cross that did not before. A wider bend may help (--fixed with a smaller part), "
            "or --mode uncrossed."
        )
