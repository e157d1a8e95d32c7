"""What `deform` reads and reports: earlier edits, distortion, and how far each vertex moved."""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import err, print_json, print_table
from eigenshape.deformation.binding import bind
from eigenshape.deformation.distortion import measure_distortion
from eigenshape.deformation.edits import Edit
from eigenshape.deformation.rig import EigenRig
from eigenshape.geometry.distances.crossings import self_intersections
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.edits import read_edits


def read_edits_for(path: Path, mesh: TriangleMesh) -> list[Edit]:
    """Read edits that were made on a mesh. If it was another mesh, the message names the option for it."""
    try:
        return read_edits(path, mesh)
    except InvalidParameterError as error:
        raise InvalidParameterError(
            f"{path}: {error} On the command line, --edits-mesh names it."
        ) from error


def print_bend(
    after: TriangleMesh,
    before: TriangleMesh,
    edits: tuple[Edit, ...],
    rig: EigenRig,
    *,
    as_json: bool,
) -> None:
    """Print how many vertices moved, and how far lengths and areas changed."""
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


def displacement_shares(
    after: TriangleMesh, before: TriangleMesh, edits: tuple[Edit, ...], rig: EigenRig
) -> Float[np.ndarray, " n"]:
    """Return, for each vertex, by how much it follows: 1 moves fully, 0 not at all.

    After one edit these are the shares of the binding, after several the displacements over the
    largest.
    """
    if len(edits) == 1:
        edit = edits[0]
        regions = [move.region for move in edit.moves]
        return bind(rig, regions, fixed=edit.fixed, n_modes=edit.n_modes).shares.sum(axis=0)
    moved = np.linalg.norm(after.vertices - before.vertices, axis=1)
    return moved / max(moved.max(), 1e-300)
