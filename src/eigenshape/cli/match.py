"""eigenshape match: where each point of a part lies on a whole shape."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import eigenshape as es
from eigenshape._errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import out, print_json, progress_bar, result_facts

MAP_FILES = (".csv", ".npz", ".txt")


def match(
    mesh: Path,
    whole: Path,
    *,
    scale: str = "auto",
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
        Part, scan or pose: a mesh, points or a frame of a depth camera.
    whole
        Whole shape, in a file of the same kinds.
    scale
        Size of the part: known if both files have one unit of length, unknown to search for it, or
        a number by which lengths of the part are multiplied. auto takes the root of the ratio of
        areas if both shapes are complete and differ in size, known if not, and unknown if the part
        is too large or too small for that.
    output
        Write the map: a table with face, weights and confidence of each vertex of the part (CSV),
        the same as arrays (NPZ), or the nearest vertex of the whole, one a line, as `stability
        --map` reads it (TXT).
    picture
        Draw both, corresponding points in one color (PNG, SVG or PDF).
    """
    side = steps.picture_side(view, up, picture)
    steps.require_output(output, MAP_FILES, "A map")
    size = _parse_scale(scale)
    ours, theirs = (steps.load_surface(path, repair) for path in (mesh, whole))
    with progress_bar("match") as progress:
        found = es.match_shapes(ours, theirs, scale=size, progress=progress)
    if as_json:
        each = {"vertices": found.vertices, "vertex_confidence": found.confidence}
        print_json({"path": mesh, "whole": whole, **match_facts(found), **each})
    else:
        print_match(found)
    if output:
        steps.save_match(found, output)
    if picture:
        steps.save_picture(es.plot.figure_match(ours, theirs, found, **side), picture)


def _parse_scale(text: str) -> Any:
    """Return "auto", "known" and "unknown" as they are, and a number as a number."""
    if text in ("auto", "known", "unknown"):
        return text
    try:
        return float(text)
    except ValueError as error:
        raise InvalidParameterError(
            f"--scale takes auto, known, unknown or a number; it is {text!r}."
        ) from error


def match_facts(found: es.matching.ShapeMatch) -> dict[str, Any]:
    """Return what a map says of the whole shape, without what it says of each vertex."""
    arrays = ("vertices", "faces", "corners", "weights", "confidence", "evidence")
    means = {"mean_confidence": found.confidence.mean(), "share_sure": found.sure().mean()}
    return result_facts(found, *arrays) | means


def print_match(found: es.matching.ShapeMatch) -> None:
    """Print in words how good a map is."""
    text = (
        f"{found.n_vertices} vertices; {found.sure().mean():.0%} have a confidence of at least "
        f"0.5, the mean is {found.confidence.mean():.2f}."
    )
    if not found.handed:
        text += " Nothing tells outside from inside: left and right may be exchanged."
    if found.n_equally_good > 1:
        text += (
            f" At least {found.n_equally_good} maps that differ fit equally well, since the shape "
            "can be turned into itself; this is one of them."
        )
    out.print("\n".join([text, *(f"{sentence}." for sentence in found.report)]))
