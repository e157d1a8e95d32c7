"""eigenshape match, pose and fuse: points of two shapes that correspond, and what follows from them."""

from __future__ import annotations

from math import sqrt
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import (
    SOME_FAILED,
    err,
    escape_text,
    out,
    print_json,
    print_written,
    progress_bar,
    result_facts,
)

MAP_FILES = (".csv", ".npz", ".txt")


def match(
    mesh: Path,
    whole: Path,
    *,
    scale: str = "auto",
    mirrored: Annotated[bool | None, typer.Option("--mirrored/--no-mirrored")] = None,
    overlap: Literal["full", "partial"] = "full",
    repair: str = "auto",
    output: Path | None = None,
    picture: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    as_json: bool = False,
) -> None:
    """Find where each point of a part, a scan or a pose lies on a whole shape.

    Both meshes are repaired first where they need it, and loose pieces are left out; what was done is
    printed.

    For instance: eigenshape match scan.ply cat.ply --picture map.png -o map.csv

    Parameters
    ----------
    mesh
        Part, scan or pose: a mesh, points or a depth scan.
    whole
        Whole shape, in a file of the same kinds.
    scale
        Size of the part: known if both files have one unit of length, unknown to search for it, or
        a number by which lengths of the part are multiplied. auto takes the root of the ratio of
        areas if both shapes are complete and differ in size, known if not, and unknown if the part
        is too large or too small for that. If the proportions differ, as those of a broken bone,
        known is tried, too.
    mirrored
        Match the mirror image of the part, as a left hand to a right one. By default it is tried where
        patches suggest it, and what was done is printed; --no-mirrored never does that.
    overlap
        partial if each of the two shapes has regions that the other one lacks: only the region that
        both have is mapped.
    output
        Write the map: a table with face, weights and confidence of each vertex of the part (CSV),
        the same as arrays (NPZ), or the nearest vertex of the whole, one a line, as `stability
        --map` reads it (TXT).
    picture
        Draw both, corresponding points in one color (PNG, SVG or PDF).
    """
    side = steps.picture_side(view, up, picture, shapes=[mesh, whole])
    steps.require_output(output, MAP_FILES, "A map")
    size: Any = scale
    if scale not in ("auto", "known", "unknown"):
        try:
            size = float(scale)
        except ValueError as error:
            raise InvalidParameterError(
                f"--scale takes auto, known, unknown or a number; it is {scale!r}."
            ) from error
    ours, theirs = (steps.load_surface(path, repair) for path in (mesh, whole))
    with progress_bar("match") as progress:
        side_of_part = "auto" if mirrored is None else mirrored
        found = es.match_shapes(
            ours, theirs, scale=size, mirrored=side_of_part, overlap=overlap, progress=progress
        )
    if as_json:
        each: dict[str, Any] = {"vertices": found.vertices, "vertex_confidence": found.confidence}
        if overlap == "partial":
            each["covered"] = found.covered
        print_json({"path": mesh, "whole": whole, **_match_facts(found), **each})
    else:
        _print_match(found)
    if output:
        found.save(output)
        print_written(output)
    if picture:
        steps.save_picture(es.plot.figure_match(ours, theirs, found, **side), picture)


def _match_facts(found: es.matching.ShapeMatch) -> dict[str, Any]:
    """Return what a map says of the whole shape, without what it says of each vertex."""
    of_vertices = "vertices", "faces", "corners", "weights", "confidence", "evidence"
    arrays = (*of_vertices, "covered", "mapped")
    means = {"mean_confidence": found.confidence.mean(), "share_sure": found.sure().mean()}
    return result_facts(found, *arrays) | means


def _print_match(found: es.matching.ShapeMatch) -> None:
    """Print in words how good a map is."""
    text = (
        f"{found.n_vertices} vertices; {found.sure().mean():.0%} have a confidence of at least "
        f"0.5, the mean is {found.confidence.mean():.2f}. It is the probability that a vertex is "
        "within 5 % of the root of the whole's area of its true place."
    )
    if not found.handed:
        text += " Nothing tells outside from inside: left and right may be exchanged."
    if found.n_equally_good > 1:
        text += (
            f" At least {found.n_equally_good} maps that differ fit equally well, since the shape "
            "can be turned into itself, the whole has equal pieces, or nothing tells the places of a "
            "small part apart; this is one of them."
        )
    out.print("\n".join([text, *(f"{sentence}." for sentence in found.report)]))


def pose(
    mesh: Path,
    *,
    like: Path,
    rest: Path | None = None,
    repair: str = "auto",
    output: Path | None = None,
    picture: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    as_json: bool = False,
) -> None:
    """Bend a mesh into the pose of another one; what corresponds is found by itself.

    All meshes are repaired; what is done to --rest is done to the same faces of --like.

    For instance: eigenshape pose cat.ply --like lion.ply -o bent.ply --picture bent.png

    Parameters
    ----------
    like
        Mesh in the wanted pose.
    rest
        The shape of --like, with the same faces, in the pose that the mesh has now. The mesh is
        then bent as that shape was bent from --rest to --like.
    picture
        Draw the mesh before and after (PNG, SVG or PDF).
    """
    side = steps.picture_side(view, up, picture, shapes=[mesh])
    steps.require_mesh_path(output)
    target = steps.load_surface(mesh, repair)
    source, posed = steps.load_poses(rest or like, like, repair)
    factor = sqrt(es.geometry.surface_area(source) / es.geometry.surface_area(target))
    with progress_bar("match") as progress:
        found = es.match_shapes(target, source, scale=factor, progress=progress)
        if rest:
            bent = es.deformation.transfer_deformation(source, posed, target, found)
        else:
            bent = es.matching.take_pose(target, posed, match=found)
    if as_json:
        print_json({"path": mesh, "like": like, **_match_facts(found)})
    else:
        _print_match(found)
    if output:
        steps.save_like(mesh, target, output, bent.vertices)
    if picture:
        figure = es.plot.figure_poses({"before": target, "after": bent}, **side)
        steps.save_picture(figure, picture)


def fuse(
    scans: list[Path],
    *,
    output: Path,
    bend: bool = True,
    repair: str = "auto",
    as_json: bool = False,
) -> None:
    """Join scans of one shape from several sides, in any places, to one surface.

    Neighbors should share a third of what they show. A scan of another pose is bent to lie on what it
    shares with the others, which takes about 10 s a pair. A scan that fits no other is named and left
    out; the exit code is then 3.

    For instance: eigenshape fuse frame1.pcd frame2.pcd frame3.pcd -o whole.ply

    Parameters
    ----------
    scans
        Scans of one shape in one length unit: meshes, or depth scans (.pcd).
    bend
        Bend scans of other poses. If the shape is rigid, turn it off.
    """
    steps.require_mesh_path(output)
    meshes = [steps.load_surface(path, repair) for path in scans]
    with progress_bar("fuse") as progress:
        fused = es.matching.fuse_scans(meshes, bend=bend, progress=progress)
    es.write_mesh(fused.mesh, output)
    print_written(output)
    vertices, faces = fused.mesh.n_vertices, fused.mesh.n_faces
    if as_json:
        motions = []
        for path, motion, joined in zip(scans, fused.motions, fused.joined, strict=True):
            facts = {"scan": path, "joined": bool(joined)}
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
