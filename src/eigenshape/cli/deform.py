"""eigenshape deform: a region of a shape turned or moved, the rest following."""

from __future__ import annotations

import math
import re
import warnings
from pathlib import Path
from typing import Any

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import err, print_json, print_table, print_written, progress_bar
from eigenshape.cli.inputs import SEAMS, numbers_of
from eigenshape.deformation.modes import Mode

REGIONS = (
    "'y>0.5' or 'y>0.5, x<0' (coordinates, or percent of the bounding box: 'y>60%'); 'vertex 17 within 0.2' "
    "(distance along the surface, or percent of the square root of the area: 'within 10%'); 'part 3' (a number that "
    "`eigenshape segment` prints); or a file with one vertex index a line."
)
CONDITION = re.compile(r"\s*([xyz])\s*([<>])\s*(-?[\d.]+(?:e-?\d+)?)\s*(%?)\s*")
VERTEX = re.compile(r"\s*vertex\s+(\d+)\s+within\s+([\d.]+(?:e-?\d+)?)\s*(%?)\s*")
PART = re.compile(r"\s*part\s+(\d+)\s*")
TURN = re.compile(r"\s*([^@]+?)\s+by\s+(-?[\d.]+)(?:\s*@\s*(.+))?\s*")
AXES = {"x": [1.0, 0.0, 0.0], "y": [0.0, 1.0, 0.0], "z": [0.0, 0.0, 1.0]}


def deform(
    mesh: Path,
    *,
    region: str = "",
    rotate: str = "",
    move: str = "",
    fixed: str = "",
    mode: Mode = "graded",
    n_modes: int | None = None,
    edits: Path | None = None,
    edits_mesh: Path | None = None,
    save_edits: Path | None = None,
    repair: str = SEAMS,
    output: Path | None = None,
    picture: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    as_json: bool = False,
) -> None:
    """Bend, twist or stretch a mesh: a region is turned or moved, and the rest follows smoothly.

    For instance: eigenshape deform scan.ply --region 'y>60%' --rotate 'x by 30' -o bent.ply
    --picture bent.png

    Parameters
    ----------
    region
        Which part to turn or move: 'y>0.5' or 'y>0.5, x<0' (coordinates, or percent of the
        bounding box: 'y>60%'); 'vertex 17 within 0.2' (distance along the surface, or percent of
        the square root of the area: 'within 10%'); 'part 3' (a number that `eigenshape segment`
        prints); or a file with one vertex index a line.
    rotate : ROTATION
        Turn the region about an axis, in degrees: 'x by 90', '0,1,1 by 30', or 'z by 45 @
        0,0.1,0' about a point. By default the axis passes through the middle of the region's
        boundary; if the region is in several patches, each turns about its own.
    move : X,Y,Z
        Move the region by this vector.
    fixed
        Which part must not move, written as for --region. By default everything outside the
        region is held close to its place.
    mode
        graded keeps lengths best; uncrossed is stiffer where faces would cross; thesis is the
        method as published.
    n_modes
        Number of eigenfunctions: few bend over a wide zone, many bend sharply. By default 8, 50
        or 300: the smaller the region beside the rest, the more.
    edits
        Apply the edits of this JSON file first.
    edits_mesh
        Mesh on which --edits were made, if it is another one. Their regions then move to the
        nearest vertices.
    save_edits
        Write all edits to this JSON file, for --edits.
    picture
        Draw the mesh before and after (PNG, SVG or PDF).
    """
    side = steps.picture_side(view, up, picture, shapes=[mesh])
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
    surface = steps.load_surface(mesh, repair)
    with progress_bar("modes") as progress:
        rig = es.rig_shape(surface, progress=progress)
        source = steps.load_surface(edits_mesh, repair) if edits_mesh else None
        try:
            done = es.io.read_edits(edits, source or surface) if edits else []
        except InvalidParameterError as error:
            raise InvalidParameterError(
                f"{edits}: {error} On the command line, --edits-mesh names it."
            ) from error
        session = es.deformation.replay(rig, done, source=source)
        if region:
            chosen = parse_region(region, session.mesh, progress)
            stays = parse_region(fixed, session.mesh, progress) if fixed else None
            patches = [chosen]
            if rotate and "@" not in rotate:
                # Fingers bend at their own knuckles, not all about the middle of the palm.
                patches = steps.regions_of_patches(session.mesh, chosen)
            moves = []
            for patch in patches:
                turn = parse_rotation(rotate, session.mesh, patch) if rotate else None
                handle = turn or es.Translation(_three(move, "A move"))
                moves.append(es.deformation.Move(patch, handle))
            session.apply(es.deformation.Edit(tuple(moves), stays, n_modes, mode))
    _print(session, surface, as_json=as_json)
    if output:
        steps.save_like(mesh, surface, output, session.mesh.vertices)
    if save_edits:
        es.io.write_edits(session.edits, surface, save_edits)
        print_written(save_edits)
    if picture:
        # How much each vertex follows, from 0 to 1: by the binding of one edit, or by where several
        # have moved it
        if len(session.edits) == 1:
            (edit,) = session.edits
            regions = [move.region for move in edit.moves]
            with warnings.catch_warnings():  # said when the edit was made
                warnings.simplefilter("ignore")
                bound = es.deformation.bind(rig, regions, fixed=edit.fixed, n_modes=edit.n_modes)
            follows: Any = bound.shares.sum(axis=0)
        else:
            moved = ((session.mesh.vertices - surface.vertices) ** 2).sum(axis=1) ** 0.5
            follows = moved / max(moved.max(), 1e-300)
        poses = {"before": surface, "after": session.mesh}
        figure = es.plot.figure_poses(poses, follows, **side)
        steps.save_picture(figure, picture)


def parse_region(text: str, mesh: es.TriangleMesh, progress: Any) -> Any:
    """Return the region that a text describes; raise an error if it describes none."""
    if found := VERTEX.fullmatch(text):
        vertex = int(found[1])
        _require_at_most(vertex, mesh.n_vertices - 1, "A vertex of a region")
        percent = es.geometry.surface_area(mesh) ** 0.5 / 100
        radius = float(found[2]) * (percent if found[3] else 1.0)
        return es.deformation.BrushRegion(mesh.vertices[vertex], radius)

    if found := PART.fullmatch(text):
        labels = es.find_parts(mesh, progress=progress).parts.labels
        _require_at_most(int(found[1]), int(labels.max()), "A part")
        return sorted({*mesh.faces[labels == int(found[1])].ravel().tolist()})

    conditions = [CONDITION.fullmatch(piece) for piece in text.split(",")]
    if all(conditions):
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        ends = {">": [-math.inf] * 3, "<": [math.inf] * 3}
        for name, comparison, value, percent in (found.groups() for found in conditions if found):
            axis, bound = "xyz".index(name), float(value)
            if percent:
                bound = low[axis] + bound / 100 * (high - low)[axis]
            ends[comparison][axis] = bound
        return es.deformation.BoxRegion(ends[">"], ends["<"])

    if Path(text).is_file():
        try:
            return [int(line) for line in Path(text).read_text().split()]
        except ValueError as error:
            raise InvalidParameterError(
                f"A file with a region has one vertex index a line; {text} does not: {error}."
            ) from error
    raise InvalidParameterError(f"A region is one of these: {REGIONS} It is {text!r}.")


def parse_rotation(text: str, mesh: es.TriangleMesh, region: Any) -> es.Rotation:
    """Return the rotation that a text describes, by default about the middle of the region's boundary."""
    found = TURN.fullmatch(text)
    if found is None:
        raise InvalidParameterError(
            f"A rotation is 'x by 90', '0,1,1 by -30', or 'z by 45 @ 0,0.1,0' (degrees, and a point of the axis); "
            f"it is {text!r}."
        )
    axis = AXES.get(found[1]) or _three(found[1], "An axis other than x, y and z")
    angle = math.radians(float(found[2]))
    if found[3]:
        return es.Rotation(_three(found[3], "A pivot"), axis, angle)
    rim = es.deformation.region_boundary(mesh, es.deformation.region_mask(mesh, region))
    middle = mesh.vertices[rim].mean(axis=0) if len(rim) else [0.0, 0.0, 0.0]
    return es.Rotation(middle, axis, angle)


def _three(text: str, name: str) -> list[float]:
    numbers = numbers_of(text)
    if len(numbers) != 3:
        raise InvalidParameterError(f"{name} is three numbers separated by commas; it is {text!r}.")
    return numbers


def _require_at_most(number: int, last: int, name: str) -> None:
    if number > last:
        raise InvalidParameterError(f"{name} must lie in 0..{last}; it is {number}.")


def _print(session: es.DeformationSession, before: es.TriangleMesh, *, as_json: bool) -> None:
    """Print how many vertices moved, and how far lengths and areas changed."""
    after, n_edits = session.mesh, len(session.edits)
    found = es.deformation.measure_distortion(before, after)
    crossing = es.geometry.self_intersections(after)
    n_moved = int((after.vertices != before.vertices).any(axis=1).sum())
    least = float(found.area_ratios.min())
    if as_json:
        print_json(
            {
                "edits": n_edits,
                "modes": session.rig.n_modes,
                "vertices_moved": n_moved,
                "edge_error": found.edge_error,
                "edge_error_of_box": found.edge_error_of_box,
                "least_area_ratio": least,
                "flipped_faces": found.flipped,
                "crossing_faces": crossing,
            }
        )
        return
    n_before = len(es.geometry.self_intersections(before))
    rows = [
        ["edits", f"{n_edits}"],
        ["vertices that moved", f"{n_moved:,} of {before.n_vertices:,}"],
        ["edges stretched, RMS", f"{100 * found.edge_error:.2f} %"],
        ["least area, after over before", f"{least:.2f}"],
        ["faces flipped", f"{len(found.flipped):,}"],
        ["pairs of faces that cross", f"{len(crossing):,} ({n_before:,} before)"],
    ]
    print_table("Bent", ["", "value"], rows)
    if len(crossing) > n_before:
        err.print(
            "Faces cross that did not before. A wider bend may help (--fixed with a smaller part), "
            "or --mode uncrossed."
        )
