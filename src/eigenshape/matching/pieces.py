"""The connected pieces of a shape, and the loose ones that are left out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from eigenshape.geometry.measure import face_areas, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_report import count_nouns
from eigenshape.geometry.topology import submesh, vertex_components
from eigenshape.matching.working_copy import WorkingCopy, make_working_copy
from eigenshape.operators.smoothing import denoise


@dataclass(frozen=True, eq=False)
class Piece:
    """A connected piece of a mesh: its faces and vertices there, its area, and its working copy."""

    faces: Int[np.ndarray, " f"]
    vertices: Int[np.ndarray, " n"]
    area: float
    copy: WorkingCopy

    def clean_area(self) -> float:
        """Return the area without noise: that of a quarter of an edge adds a fifth."""
        return surface_area(denoise(self.copy.mesh))


def split_pieces(mesh: TriangleMesh, least: float) -> list[Piece]:
    """Return the pieces with at least this share of the area, the largest first, and at least one."""
    count, labels = vertex_components(mesh)
    owners = labels[mesh.faces[:, 0]]
    areas = np.bincount(owners, weights=face_areas(mesh), minlength=count)
    found: list[Piece] = []
    for number in np.argsort(-areas, kind="stable").tolist():
        if found and areas[number] < least * areas.sum():
            break
        keep = owners == number
        piece, vertices = submesh(mesh, keep) if count > 1 else (mesh, np.arange(mesh.n_vertices))
        copy = make_working_copy(piece)
        found.append(Piece(np.flatnonzero(keep), vertices, float(areas[number]), copy))
    return found


def report_left_out(mesh: TriangleMesh, kept: Sequence[Piece], name: str) -> tuple[str, ...]:
    """Return a sentence on the pieces of a shape that are not kept; none if all are."""
    n_lost = vertex_components(mesh)[0] - len(kept)
    if not n_lost:
        return ()
    share = 1 - sum(piece.area for piece in kept) / surface_area(mesh)
    verb = "was" if n_lost == 1 else "were"
    pieces = count_nouns(n_lost, "loose piece")
    return (f"{pieces} of {100 * share:.2g} % of the area of the {name} {verb} left out",)
