"""Faces turned over so that neighbors agree, solids face outward and cavities inward."""

import numpy as np

from eigenshape._errors import count_nouns
from eigenshape.geometry.distances.nesting import faces_to_turn
from eigenshape.geometry.face_turns import turn_faces
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_report import RepairedMesh


def orient(mesh: TriangleMesh) -> RepairedMesh[TriangleMesh]:
    """Turn faces over so that neighbors agree, solids face outward and cavities inward.

    In each piece the smaller group of faces is turned. Then each piece is turned as a whole if
    `faces_to_turn` finds that it faces to the wrong side. A piece that cannot be oriented, such as
    a Möbius strip, is left as it is, and the report names one of its faces.
    """
    turned, one_sided, piece = faces_to_turn(mesh)
    report = f"orient turned {count_nouns(int(turned.sum()), 'face')} over"
    if one_sided.any():
        # The report names the first face of each of the first nine such pieces.
        first = np.flatnonzero(one_sided)[np.unique(piece[one_sided], return_index=True)[1]]
        names = ", ".join(map(str, first[:9]))
        report += f", left {count_nouns(len(first), 'piece')} with one side only, of face {names}"
        report += " and others" if len(first) > 9 else ""
    return RepairedMesh(turn_faces(mesh, turned), (report,), np.arange(mesh.n_vertices))
