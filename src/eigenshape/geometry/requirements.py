"""Checks of meshes for the functions that need them.

Each check costs a few sorts. Its error names the first offender by index and value, and the repair.
"""

import warnings

import numpy as np

from eigenshape._errors import InvalidShapeError, try_auto
from eigenshape.geometry.face_turns import face_turns, inconsistent_edges
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.seams import seams
from eigenshape.geometry.simplices import MEASURES, degenerate_simplices, require_span
from eigenshape.geometry.simplicial import Mesh
from eigenshape.geometry.topology import (
    non_manifold_edges,
    non_manifold_vertices,
    repeated_simplices,
    require_simplices_everywhere,
    unreferenced_vertices,
    vertex_components,
)


def require_sound(mesh: Mesh) -> None:
    """Raise an error if a mesh cannot carry finite elements.

    A simplex without volume, two simplices with the same corners and a point without simplex are
    refused.
    """
    require_volumes(mesh)
    require_simplices_everywhere(mesh)
    require_different_simplices(mesh)


def require_volumes(mesh: Mesh) -> None:
    """Raise an error if a simplex has no volume.

    If the points of the mesh lie in a flat, simplices have volume by rounding only, and are
    refused, too.
    """
    flat = degenerate_simplices(mesh)
    plural, singular, measure = MEASURES.get(mesh.dim, ("Simplices", "simplex", "volume"))
    if flat.size == len(mesh.simplices):
        raise InvalidShapeError(
            f"{plural} must have {measure}; all {flat.size} have none: their points are equal or "
            f"{'on a line' if mesh.dim == 2 else 'in a flat of lower dimension'}."
        )
    if flat.size:
        corners = mesh.simplices[flat[0]]
        raise InvalidShapeError(
            f"{plural} must have {measure}; {singular} {flat[0]} is {corners.tolist()} "
            f"with corners {mesh.points[corners].tolist()} ({flat.size} such). {try_auto()}"
        )
    used = np.delete(mesh.points, unreferenced_vertices(mesh), axis=0)
    require_span(used, mesh.dim, "The points of a mesh")


def require_different_simplices(mesh: Mesh) -> None:
    """Raise an error if two simplices have the same corners, in any order.

    Their volume would count twice.
    """
    repeated = repeated_simplices(mesh)
    if len(repeated):
        first, second = repeated[0]
        noun = "faces" if mesh.dim == 2 else "simplices"
        raise InvalidShapeError(
            f"{noun.capitalize()} must differ, or they count twice; {noun} {first} and {second} "
            f"both have the corners {mesh.simplices[first].tolist()} ({len(repeated)} such). "
            f"{try_auto()}"
        )


def require_joined(mesh: Mesh) -> None:
    """Raise an error if pieces of a mesh lie edge on edge without sharing vertices.

    Heat does not cross such an edge, so descriptors would be those of the pieces. Pieces that touch
    elsewhere, and closed pieces, are accepted as separate parts.
    """
    n_components, labels = vertex_components(mesh)
    if n_components == 1:
        return
    pairs = seams(mesh)
    apart = pairs[labels[pairs[:, 0, 0]] != labels[pairs[:, 1, 0]]]
    if len(apart):
        one, two = apart[0]
        raise InvalidShapeError(
            "Pieces that lie edge on edge must share their vertices; "
            f"those at vertices {one.tolist()} and {two.tolist()} do not, "
            f"at {mesh.points[one].tolist()} ({len(apart)} such). {try_auto()}"
        )


def warn_of_seams(mesh: Mesh) -> None:
    """Warn if points are double along seams, as those of a texture: the shape is open there."""
    pairs = seams(mesh)
    if len(pairs):
        one, two = pairs[0]
        warnings.warn(
            "Both sides of a seam must share their vertices, or the shape is open there as if it were "
            f"cut; the sides {one.tolist()} and {two.tolist()} lie on each other and do not "
            f'({len(pairs)} such). Try repair(mesh, ["weld_seams"]), or --repair weld_seams on the '
            "command line, unless a cut is meant.",
            stacklevel=3,
        )


def require_describable(mesh: Mesh) -> None:
    """Raise an error if a descriptor of the mesh would not describe the shape.

    A point without simplex, two simplices with the same corners and pieces that lie edge on edge
    without sharing vertices are refused; a warning names seams within a piece.
    """
    require_simplices_everywhere(mesh)
    require_different_simplices(mesh)
    require_joined(mesh)
    warn_of_seams(mesh)


def require_oriented(mesh: TriangleMesh) -> None:
    """Raise an error if two neighboring faces are turned against each other."""
    edges = inconsistent_edges(mesh)
    if not len(edges):
        return
    orientable = face_turns(mesh).orientable
    remedy = try_auto()
    if not orientable.all():
        one_sided = int(np.argmin(orientable))
        remedy = (
            f"The piece of face {one_sided} has one side only, like a Möbius strip. Try repair(mesh, "
            '["auto", "cut_one_sided"]), or --repair auto,cut_one_sided on the command line.'
        )
    raise InvalidShapeError(
        "Neighboring faces must be turned the same way; "
        f"the two at edge ({edges[0, 0]}, {edges[0, 1]}) are turned against each other "
        f"({len(edges)} such). {remedy}"
    )


def require_two_faces(mesh: TriangleMesh) -> None:
    """Raise an error if more than two faces share an edge."""
    edges = non_manifold_edges(mesh)
    if len(edges):
        raise InvalidShapeError(
            "At most two faces may share an edge; more share edge "
            f"({edges[0, 0]}, {edges[0, 1]}) ({len(edges)} such)."
        )


def require_oriented_manifold(mesh: TriangleMesh) -> None:
    """Raise an error if vertices have no tangent planes with a side to look at them from.

    An edge has at most two faces, a vertex one fan of faces, and neighboring faces are turned
    alike.
    """
    require_two_faces(mesh)
    vertices = non_manifold_vertices(mesh)
    if vertices.size:
        raise InvalidShapeError(
            f"Tangent planes need a manifold; the faces at vertex {vertices[0]} at "
            f"{mesh.vertices[vertices[0]].tolist()} form more than one fan ({vertices.size} such)."
        )
    require_oriented(mesh)
