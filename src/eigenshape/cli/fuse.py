"""eigenshape fuse: scans of one shape from several sides, as one surface."""

from pathlib import Path

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


def fuse(
    scans: list[Path],
    *,
    output: Path,
    repair: str = "auto",
    as_json: bool = False,
) -> None:
    """Join scans of one shape from several sides, in any places, to one surface.

    Neighbors should share a third of what they show. A scan that fits no other is named and left
    out; the exit code is then 3.

    For instance: eigenshape fuse frame1.pcd frame2.pcd frame3.pcd -o whole.ply

    Parameters
    ----------
    scans
        Scans of one rigid shape in one length unit: meshes, or frames of a depth camera (.pcd).
    """
    steps.require_mesh_path(output)
    meshes = [steps.load_surface(path, repair) for path in scans]
    with progress_bar("fuse") as progress:
        fused = es.matching.fuse_scans(meshes, progress=progress)
    es.write_mesh(fused.mesh, output)
    print_written(output)
    vertices, faces = fused.mesh.n_vertices, fused.mesh.n_faces
    if as_json:
        motions = []
        for path, motion in zip(scans, fused.motions, strict=True):
            facts = {"scan": path, "joined": motion is not None}
            if motion is not None:
                facts |= {"rotation": motion.rotation, "translation": motion.translation}
            motions.append(facts)
        print_json({"output": output, "vertices": vertices, "faces": faces, "scans": motions})
    else:
        out.print(
            f"joined {int(fused.joined.sum())} of {len(scans)} scans: {vertices:,} vertices, "
            f"{faces:,} faces"
        )
    left = [path for path, joined in zip(scans, fused.joined, strict=True) if not joined]
    for path in left:
        err.print(f"[yellow]left out:[/] {escape_text(path)} fits no other scan well enough")
    if left:
        raise typer.Exit(SOME_FAILED)
