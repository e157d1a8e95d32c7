"""eigenshape pose: a shape in the pose of another one."""

from math import sqrt
from pathlib import Path

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import print_json, progress_bar
from eigenshape.cli.match import match_facts, print_match


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
    side = steps.picture_side(view, up, picture)
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
    if as_json:
        print_json({"path": mesh, "like": like, **match_facts(found)})
    else:
        print_match(found)
    if output:
        steps.save_like(mesh, target, output, bent.vertices)
    if picture:
        figure = es.plot.figure_poses({"before": target, "after": bent}, **side)
        steps.save_picture(figure, picture)
