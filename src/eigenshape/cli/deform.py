"""eigenshape deform: a region of a shape turned or moved, the rest following."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import (
    JsonOption,
    MeshArgument,
    RepairOption,
    err,
    load_mesh,
    print_json,
    print_table,
    progress_bar,
    said,
    save_picture,
)
from eigenshape.cli.parts import require_paths
from eigenshape.cli.regions import REGIONS, told_region, told_rotation, told_translation
from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import require_mode
from eigenshape.deformation.distortion import measure_distortion
from eigenshape.deformation.edits import Edit, Move
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.rig import EigenRig, rig_shape
from eigenshape.deformation.session import replay
from eigenshape.figures.camera import three_quarter_view
from eigenshape.figures.poses import figure_poses
from eigenshape.geometry.crossings import self_intersections
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.edits import read_edits, write_edits
from eigenshape.io.mesh_files import write_mesh


def deform(
    mesh: MeshArgument,
    *,
    region: Annotated[str, typer.Option(help=f"What moves: {REGIONS}")] = "",
    rotate: Annotated[
        str, typer.Option(metavar="WORDS", help="Turn it: 'x by 90' (degrees), '0,1,1 by 30', 'z by 45 @ 0,0.1,0'.")
    ] = "",
    move: Annotated[str, typer.Option(metavar="X,Y,Z", help="Move it by a vector.")] = "",
    fixed: Annotated[str, typer.Option(help="What stays, in the same words; without it, all else is held.")] = "",
    mode: Annotated[
        str,
        typer.Option(
            help="graded: as rigid as can be; uncrossed: stiffer where faces would cross; thesis: as printed there."
        ),
    ] = "graded",
    n_modes: Annotated[
        int | None, typer.Option("-n", "--n-modes", help="Few bend widely, many sharply; 8, 50 or 300 by default.")
    ] = None,
    edits: Annotated[Path | None, typer.Option(help="Do the edits of this JSON file first.")] = None,
    save_edits: Annotated[Path | None, typer.Option(help="Write all edits to this JSON file.")] = None,
    repair: RepairOption = "",
    output: Annotated[Path | None, typer.Option("-o", "--output", "--out", help="Write the bent mesh.")] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw it before and after (PNG, SVG or PDF).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Bend, twist or stretch a mesh: a region is turned or moved, and the rest follows smoothly.

    For instance: eigenshape deform scan.ply --region 'y>60%' --rotate 'x by 30' -o bent.ply --picture bent.png
    """
    require_paths(picture, output)
    handles = [name for name in (rotate, move) if name]
    if bool(region) != (len(handles) == 1) or not (region or edits):
        raise InvalidParameterError("Give --region with either --rotate or --move, or --edits, or all of them.")
    checked = require_mode(mode)
    surface = load_mesh(mesh, repair)
    with progress_bar("modes") as progress:
        rig = rig_shape(surface, progress=progress)
        done = list(_kept(edits, surface)) if edits else []
        session = replay(rig, done)
        if region:
            chosen = told_region(region, session.mesh, progress)
            stays = told_region(fixed, session.mesh, progress) if fixed else None
            handle: Handle = told_rotation(rotate, session.mesh, chosen) if rotate else told_translation(move)
            session.apply(Edit((Move(chosen, handle),), stays, n_modes, checked))
    _report(session.mesh, surface, session.edits, rig, as_json=as_json)
    if output:
        write_mesh(session.mesh, output)
        said(output)
    if save_edits:
        write_edits(session.edits, surface, save_edits)
        said(save_edits)
    if picture:
        moved = np.linalg.norm(session.mesh.vertices - surface.vertices, axis=1)
        shares = _last_shares(rig, session.edits) if len(session.edits) == 1 else moved / max(moved.max(), 1e-300)
        camera = three_quarter_view(surface, up="auto")
        save_picture(figure_poses({"before": surface, "after": session.mesh}, shares, camera=camera), picture)


def _kept(path: Path, surface: TriangleMesh) -> list[Edit]:
    n_vertices, edits = read_edits(path)
    if n_vertices != surface.n_vertices:
        err.print(f"[yellow]note:[/] {path} was made on {n_vertices} vertices; this mesh has {surface.n_vertices}")
    return edits


def _last_shares(rig: EigenRig, edits: tuple[Edit, ...]) -> np.ndarray:
    edit = edits[0]
    return bind(rig, [m.region for m in edit.moves], fixed=edit.fixed, n_modes=edit.n_modes).shares.sum(axis=0)


def _report(
    after: TriangleMesh, before: TriangleMesh, edits: tuple[Edit, ...], rig: EigenRig, *, as_json: bool
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
    rows = [
        ["edits", f"{len(edits)}"],
        ["vertices that moved", f"{values['vertices_moved']:,} of {before.n_vertices:,}"],
        ["edges stretched, RMS", f"{100 * found.edge_error:.2f} %"],
        ["least area, after over before", f"{values['least_area_ratio']:.2f}"],
        ["faces flipped", f"{len(found.flipped):,}"],
        [
            "pairs of faces that cross",
            f"{len(values['crossing_faces']):,} ({len(self_intersections(before)):,} before)",
        ],
    ]
    print_table("Bent", ["", "value"], rows)
