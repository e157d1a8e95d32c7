"""eigenshape decimate: the same surface by fewer faces."""

from pathlib import Path

import eigenshape as es
from eigenshape._errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import escape_text, out, print_json, print_repairs


def decimate(
    mesh: Path,
    *,
    output: Path,
    n_faces: int | None = None,
    ratio: float | None = None,
    repair: str = "none",
    as_json: bool = False,
) -> None:
    """Write a mesh with fewer faces and the same topology, by collapsing edges.

    All else that the file holds stays, or is named: textures, materials, colors, groups, fields.
    Vertices that are double along seams are joined first.

    For instance: eigenshape decimate scan.ply --ratio 0.1 -o small.ply

    Parameters
    ----------
    n_faces
        Number of faces to keep.
    ratio
        Instead of -n: the share of faces to keep, between 0 and 1.
    """
    steps.require_mesh_path(output)
    if (n_faces is None) == (ratio is None):
        raise InvalidParameterError(
            "The number of faces must be given by one of --n-faces and --ratio."
        )
    surface = steps.load_surface(mesh, repair)
    # Vertices are double along seams of textures, where the surface would come apart.
    joined = es.repair(surface, ["weld_seams"])
    if joined.mesh.n_vertices < surface.n_vertices:
        print_repairs(joined.report)
    done = es.geometry.decimate(joined.mesh, n_faces, ratio=ratio)
    steps.save_like(mesh, done.mesh, output)
    if as_json:
        facts = {"n_vertices": done.mesh.n_vertices, "n_faces": done.mesh.n_faces}
        print_json({"path": mesh, "output": output, "report": done.report, **facts})
    else:
        for sentence in done.report:
            out.print(escape_text(sentence))
