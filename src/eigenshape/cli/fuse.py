"""eigenshape fuse: scans of one shape from several sides, as one surface."""

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import (
    SOME_FAILED,
    err,
    escape_text,
    out,
    print_json,
    print_written,
    progress_bar,
)
from eigenshape.cli.inputs import AutoRepairOption, JsonOption


def fuse(
    scans: Annotated[
        list[Path],
        typer.Argument(
            help="Scans of one rigid shape in one length unit: meshes, or frames of a depth camera (.pcd)."
        ),
    ],
    *,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Write the surface to this mesh file.")
    ],
    repair: AutoRepairOption = "auto",
    as_json: JsonOption = False,
) -> None:
    """Join scans of one shape from several sides, in any places, to one surface.

    Neighbors should share a third of what they show. A scan that fits no other is named and left
    out; the exit code is then 3.

    For instance: eigenshape fuse frame1.pcd frame2.pcd frame3.pcd -o whole.ply
    """
    meshes = [steps.load_surface(path, repair) for path in scans]
    with progress_bar("fuse") as progress:
        fused = es.matching.fuse_scans(meshes, progress=progress)
    es.write_mesh(fused.mesh, output)
    left = [path for path, joined in zip(scans, fused.joined, strict=True) if not joined]
    if as_json:
        motions = [
            {"scan": str(path), "joined": motion is not None}
            | ({"rotation": motion.rotation, "translation": motion.translation} if motion else {})
            for path, motion in zip(scans, fused.motions, strict=True)
        ]
        print_json(
            {
                "output": str(output),
                "vertices": fused.mesh.n_vertices,
                "faces": fused.mesh.n_faces,
                "scans": motions,
            }
        )
    else:
        out.print(
            f"joined {int(fused.joined.sum())} of {len(scans)} scans: {fused.mesh.n_vertices:,} "
            f"vertices, {fused.mesh.n_faces:,} faces"
        )
    print_written(output)
    for path in left:
        err.print(f"[yellow]left out:[/] {escape_text(path)} fits no other scan well enough")
    if left:
        raise typer.Exit(SOME_FAILED)
