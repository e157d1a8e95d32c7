"""What a mesh must be before it is measured or described, each asked by whoever needs it.

Each check costs a few sorts, refuses by index and value, and names the repair that helps.
"""

import numpy as np

from eigenshape._errors import InvalidShapeError, try_auto
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import require_volumes
from eigenshape.geometry.simplicial import Mesh
from eigenshape.geometry.topology import (
    face_turns,
    inconsistent_edges,
    repeated_simplices,
    require_simplices_everywhere,
    seams,
    vertex_components,
)


def require_sound(mesh: Mesh) -> None:
    """Refuse a mesh that has no finite elements, or counts some of them twice.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume or the corners of another, or a point has no simplex.
    """
    require_volumes(mesh)
    require_simplices_everywhere(mesh)
    require_different_simplices(mesh)


def require_different_simplices(mesh: Mesh) -> None:
    """Refuse a mesh with two simplices of the same corners, in any order: their volume would count twice.

    Raises
    ------
    InvalidShapeError
        With the index of the first such pair, its corners, and the number of such simplices.
    """
    repeated = repeated_simplices(mesh)
    if len(repeated):
        first, second = repeated[0]
        noun = "faces" if mesh.dim == 2 else "simplices"
        raise InvalidShapeError(
            f"{noun.capitalize()} must differ, or they count twice; {noun} {first} and {second} both have the corners "
            f"{mesh.simplices[first].tolist()} ({len(repeated)} such). {try_auto()}"
        )


def require_joined(mesh: Mesh) -> None:
    """Refuse a soup: a mesh that falls apart where its pieces lie edge on edge and do not share vertices.

    Heat does not cross such an edge, so that descriptors would be those of the pieces. Pieces that touch elsewhere, or
    are closed, are parts in their own right.

    Raises
    ------
    InvalidShapeError
        With the first such edge and the number of them.
    """
    n_components, labels = vertex_components(mesh)
    if n_components == 1:
        return
    pairs = seams(mesh)
    apart = pairs[labels[pairs[:, 0, 0]] != labels[pairs[:, 1, 0]]]
    if len(apart):
        one, two = apart[0]
        raise InvalidShapeError(
            "Pieces that lie edge on edge must share their vertices; those at vertices "
            f"{one.tolist()} and {two.tolist()} do not, at {mesh.points[one].tolist()} ({len(apart)} such). "
            f"{try_auto()}"
        )


def require_describable(mesh: Mesh) -> None:
    """Refuse a mesh whose descriptor would be that of something else.

    Raises
    ------
    InvalidShapeError
        If a point has no simplex, two simplices have the same corners, or pieces lie edge on edge without sharing
        vertices.
    """
    require_simplices_everywhere(mesh)
    require_different_simplices(mesh)
    require_joined(mesh)


def require_oriented(mesh: TriangleMesh) -> None:
    """Refuse a mesh in which two neighboring faces are turned against each other.

    Raises
    ------
    InvalidShapeError
        With the first such edge and the number of them.
    """
    edges = inconsistent_edges(mesh)
    if not len(edges):
        return
    orientable = face_turns(mesh).orientable
    remedy = try_auto()
    if not orientable.all():
        one_sided = int(np.argmin(orientable))
        remedy = f"No repair helps: the piece of face {one_sided} has one side only, like a Möbius strip."
    raise InvalidShapeError(
        f"Faces must be turned one way; the two at edge ({edges[0, 0]}, {edges[0, 1]}) are turned against each other "
        f"({len(edges)} such). {remedy}"
    )
