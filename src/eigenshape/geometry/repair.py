"""Repairs, each asked for by name, each saying what it did."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Int
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.holes import fillings
from eigenshape.geometry.measure import area_vectors, unit_scaled
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import degenerate_simplices, scaled_corners
from eigenshape.geometry.topology import submesh, unreferenced_vertices, vertex_components


@dataclass(frozen=True, eq=False)
class Repaired:
    """A mesh after one or more repairs, and what they did.

    Attributes
    ----------
    mesh : TriangleMesh
    report : tuple of str
        One sentence a repair, such as "drop_degenerate removed 2 faces".
    source_vertices : (n,) int
        For each vertex of `mesh`, the vertex of the original that it was.
    """

    mesh: TriangleMesh
    report: tuple[str, ...]
    source_vertices: Int[np.ndarray, " n"]


def weld(mesh: TriangleMesh, *, tolerance: float = 0.0) -> Repaired:
    """Make one vertex of all that lie at the same place.

    Parameters
    ----------
    mesh : TriangleMesh
    tolerance : float
        Vertices at most this share of the bounding box' diagonal apart are the same place, chains of them too. At 0
        coordinates must be equal.

    Raises
    ------
    InvalidParameterError
        If the tolerance is not within 0..0.1.
    """
    if not 0 <= tolerance <= 0.1:
        raise InvalidParameterError(f"tolerance must lie in 0..0.1 of the bounding box' diagonal; it is {tolerance}.")
    group = _groups(mesh, tolerance)
    _, first, renumbered = np.unique(group, return_index=True, return_inverse=True)
    order = np.argsort(first)  # keep the vertices in the order in which they first appear
    rank = np.argsort(order)
    welded = TriangleMesh(mesh.vertices[first[order]], rank[renumbered[mesh.faces]])
    report = f"weld joined {mesh.n_vertices - welded.n_vertices} vertices to others at the same place"
    return Repaired(welded, (report,), first[order])


def _groups(mesh: TriangleMesh, tolerance: float) -> Int[np.ndarray, " n"]:
    # Adding 0.0 makes -0.0 equal to 0.0 also where bytes are compared.
    _, group = np.unique(mesh.vertices + 0.0, axis=0, return_inverse=True)
    if tolerance > 0:
        points, _ = unit_scaled(mesh)
        radius = tolerance * float(np.linalg.norm(np.ptp(points, axis=0)))
        pairs = cKDTree(points).query_pairs(radius, output_type="ndarray")
        graph = sp.coo_array((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(mesh.n_vertices,) * 2)
        group = connected_components(graph, directed=False)[1]
    return group.ravel().astype(np.int64)


def drop_degenerate(mesh: TriangleMesh) -> Repaired:
    """Remove faces without area; their vertices stay."""
    keep = np.ones(mesh.n_faces, dtype=bool)
    keep[degenerate_simplices(mesh)] = False
    return _kept(mesh, keep, "drop_degenerate", "faces without area")


def drop_duplicate_faces(mesh: TriangleMesh) -> Repaired:
    """Keep the first of all faces with the same three corners, whatever their order."""
    keep = np.zeros(mesh.n_faces, dtype=bool)
    keep[np.unique(np.sort(mesh.faces, axis=1), axis=0, return_index=True)[1]] = True
    return _kept(mesh, keep, "drop_duplicate_faces", "faces that repeat an earlier one")


def _kept(mesh: TriangleMesh, keep: np.ndarray, name: str, what: str) -> Repaired:
    kept = TriangleMesh(mesh.vertices, mesh.faces[keep])
    return Repaired(kept, (f"{name} removed {int((~keep).sum())} {what}",), np.arange(mesh.n_vertices))


def drop_unreferenced(mesh: TriangleMesh) -> Repaired:
    """Remove vertices that no face uses."""
    n_loose = len(unreferenced_vertices(mesh))
    kept, source = submesh(mesh, np.ones(mesh.n_faces, dtype=bool))
    return Repaired(kept, (f"drop_unreferenced removed {n_loose} vertices without a face",), source)


def largest_component(mesh: TriangleMesh) -> Repaired:
    """Keep the connected component with the most area; of equal ones, the one with the lowest vertex."""
    count, _ = vertex_components(mesh)
    keep = faces_of_largest(mesh)
    kept, source = submesh(mesh, keep)
    report = f"largest_component removed {count - 1} components with {int((~keep).sum())} faces"
    return Repaired(kept, (report,), source)


def faces_of_largest(mesh: TriangleMesh) -> Bool[np.ndarray, " f"]:
    """Mark the faces of the component that `largest_component` keeps."""
    _, labels = vertex_components(mesh)
    of_face = np.unique(labels[mesh.faces[:, 0]], return_inverse=True)[1]
    areas = np.linalg.norm(area_vectors(scaled_corners(mesh)[0]), axis=1)
    return np.asarray(of_face == np.argmax(np.bincount(of_face, weights=areas)))


def seal_holes(mesh: TriangleMesh, *, most_edges: int = 1000) -> Repaired:
    """Close every hole by faces between the vertices around it; no vertex is added.

    Each boundary loop is triangulated with the least sum of areas (Barequet and Sharir, Filling gaps in the boundary of
    a polyhedron, 1995), to which a little of the sides' squares is added against slivers. An open surface is closed
    along its rim, too. What cannot be closed without a face that has no area, or an edge of three faces, is left, and
    the report says so.

    Parameters
    ----------
    mesh : TriangleMesh
    most_edges : int
        Holes with more edges are left: work goes with the third power (1,000 take about a second).

    Raises
    ------
    InvalidParameterError
        If `most_edges` is under 3.
    """
    if most_edges < 3:
        raise InvalidParameterError(f"most_edges must be at least 3, the sides of a triangle; it is {most_edges}.")
    found = fillings(mesh, most_edges)
    sealed = TriangleMesh(mesh.vertices, np.concatenate([mesh.faces, *found.faces]))
    n_closed, n_faces = len(found.faces), sealed.n_faces - mesh.n_faces
    report = f"seal_holes closed {n_closed} hole{'s' * (n_closed != 1)} with {n_faces} face{'s' * (n_faces != 1)}"
    report += f", left {found.n_long} of more than {most_edges} edges" if found.n_long else ""
    report += f", left {found.n_open} that good faces do not close" if found.n_open else ""
    return Repaired(sealed, (report,), np.arange(mesh.n_vertices))


REPAIRS: dict[str, Callable[[TriangleMesh], Repaired]] = {
    "weld": weld,
    "drop_degenerate": drop_degenerate,
    "drop_duplicate_faces": drop_duplicate_faces,
    "drop_unreferenced": drop_unreferenced,
    "largest_component": largest_component,
    "seal_holes": seal_holes,
}


def repair(mesh: TriangleMesh, names: Sequence[str]) -> Repaired:
    """Apply the named repairs one after the other.

    Raises
    ------
    InvalidParameterError
        If a name is not one of `REPAIRS`.
    InvalidShapeError
        If a repair leaves no face.
    """
    for index, name in enumerate(names):
        if name not in REPAIRS:
            raise InvalidParameterError(f"repairs must be among {', '.join(REPAIRS)}; name {index} is {name!r}.")
    done = Repaired(mesh, (), np.arange(mesh.n_vertices))
    for name in names:
        step = REPAIRS[name](done.mesh)
        done = Repaired(step.mesh, done.report + step.report, done.source_vertices[step.source_vertices])
    return done
