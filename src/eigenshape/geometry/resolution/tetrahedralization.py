"""Tetrahedra inside a closed surface."""

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

import numpy as np

from certeig.kit.arrays import positive_number
from eigenshape._arrays import number_places
from eigenshape._errors import InvalidShapeError
from eigenshape._extras import import_extra
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.crossings import self_intersections
from eigenshape.geometry.distances.nesting import Pieces, find_pieces
from eigenshape.geometry.face_turns import face_turns, turn_faces
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_oriented, require_sound
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import edge_table

WITHOUT_LIMIT = 1e10  # Netgen's own; the surface has size 1
ONE_MESHER = Lock()  # Netgen keeps what it is doing in global variables


def tetrahedralize(mesh: MeshLike, side_length: float | None = None) -> SimplicialMesh:
    """Fill a closed surface with tetrahedra.

    All triangles of the surface stay as they are, and points are added inside alone: point i is
    vertex i, so values on vertices and their numbers hold for the volume, too. Computed by `Netgen
    <https://ngsolve.org>`_, deterministically.

    Parameters
    ----------
    mesh : MeshLike
        Closed, without crossings, of one piece or more. A piece inside another one is a cavity, and
        its faces must look into it; a piece inside a cavity is filled again. Pieces may touch where
        they share vertices.
    side_length : float, optional
        Largest length of sides to aim at inside, in the unit of coordinates. By default, sides
        grow from those of the surface inward.

    Returns
    -------
    SimplicialMesh
        The n vertices, then the points inside.

    Raises
    ------
    InvalidParameterError
        If `side_length` is not positive.
    InvalidShapeError
        If the surface has a boundary, an edge with more than two faces of a piece, two vertices at
        one place, faces that cross, have no area or look to the wrong side, or the tetrahedra do not
        fill what it encloses.
    MissingExtraError
        If Netgen is not installed.

    See Also
    --------
    boundary_surface : The way back.
    decimate : A surface of fewer triangles, of which there are fewer tetrahedra.

    Notes
    -----
    How many tetrahedra there are depends on the triangles. A surface of 10,000 vertices gives about
    50,000, in 15 s of one core.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.geometry.tetrahedralize(es.icosphere(1))
    >>> ball.dim
    3
    >>> es.solve_spectrum(es.cotangent_laplacian(ball), 5).certificate.complete
    True
    """
    mesh = as_mesh(mesh)
    longest = None if side_length is None else positive_number(side_length, "side_length")
    require_sound(mesh)
    require_oriented(mesh)
    pieces = find_pieces(mesh, face_turns(mesh))
    _require_closed(mesh, pieces)
    crossing = self_intersections(mesh)
    if len(crossing):
        one, two = crossing[0]
        raise InvalidShapeError(
            f"Faces of a surface to be filled must not cross; faces {one} and {two} do "
            f"({len(crossing)} pairs). No repair here moves vertices; smooth or remesh it where it "
            "was made."
        )
    # Where two vertices are at one place, Netgen may end the process.
    places = number_places(mesh.vertices)
    doubles = np.delete(np.arange(mesh.n_vertices), np.unique(places, return_index=True)[1])
    if doubles.size:
        one, two = np.flatnonzero(places == places[doubles[0]])[:2]
        raise InvalidShapeError(
            f"Vertices of a surface to be filled must differ; {one} and {two} are both at "
            f"{mesh.vertices[two].tolist()} ({len(doubles)} such). "
            'Try repair(mesh, ["weld"]), or --repair weld on the command line.'
        )
    turned = (pieces.sides * (-1) ** pieces.depths < 0)[pieces.of_faces]
    if turned.any() and not turned.all():
        raise InvalidShapeError(
            "Faces of a surface to be filled must look out of the solid, those of a cavity into the "
            f"cavity; face {np.argmax(turned)} does not ({np.count_nonzero(turned)} such). "
            'Try repair(mesh, ["orient"]), or --repair orient on the command line.'
        )
    surface = turn_faces(mesh, turned)
    netgen = import_extra("netgen.meshing", "'eigenshape[tetrahedralize]'")
    points, scale = size_one(surface.vertices)
    center = points.mean(axis=0)
    with ONE_MESHER, _output_among_errors():
        solid = netgen.Mesh(dim=3)
        solid.AddPoints(np.ascontiguousarray(points - center))
        side = solid.Add(netgen.FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
        solid.AddElements(dim=2, index=side, data=surface.faces.astype(np.int32), base=0)
        solid.GenerateVolumeMesh(maxh=WITHOUT_LIMIT if longest is None else longest / scale)
        inside = np.array(solid.Coordinates())[mesh.n_vertices :]
        # Older versions of Netgen have room for the nodes of elements of higher order behind.
        corners = solid.Elements3D().NumPy()["nodes"][:, :4].astype(np.int64) - 1
    points = np.concatenate([surface.vertices, (inside + center) * scale])
    volume, filled = enclosed_volume(surface), 0.0
    if len(corners):
        found = SimplicialMesh(points, corners)
        filled = float(simplex_volumes(found).sum())
        # Where the triangles at an odd number of tetrahedra are those of the surface, the
        # tetrahedra cover each point of the solid an odd number of times, and each point of a
        # cavity and outside an even number of times. With the volume of the solid that is once
        # and never.
        if _is_bounded_by(found, surface) and abs(filled - volume) <= 1e-6 * volume:
            return found
    raise InvalidShapeError(
        f"Tetrahedra must fill what the surface encloses, {volume:g}, and nothing else; "
        f"Netgen filled {filled:g}. No repair here moves vertices; smooth or remesh it where it was made."
    )


@contextmanager
def _output_among_errors() -> Iterator[None]:
    """Let what Netgen prints come out of the standard error, so that a program's output is its own.

    The descriptor is that of the process: what other threads print meanwhile comes out there, too,
    and nothing is lost.
    """
    try:
        output = os.dup(1)
        os.fstat(2)
    except OSError:  # a process without one of them
        yield
        return
    library = ctypes.CDLL(None) if os.name == "posix" else ctypes.cdll.msvcrt
    try:
        library.fflush(None)  # what was printed before
        os.dup2(2, 1)
        yield
    finally:
        library.fflush(None)
        os.dup2(output, 1)
        os.close(output)


def _require_closed(mesh: TriangleMesh, pieces: Pieces) -> None:
    """Raise an error if an edge does not have two faces of each piece that it belongs to."""
    if pieces.closed.all():
        return
    table = edge_table(mesh)
    edges = np.unique(table.face_edges[~pieces.closed[pieces.of_faces]])
    edges = edges[table.n_faces[edges] != 2]
    worst = edges[table.n_faces[edges].argmax()]
    remedy = (
        'Try repair(mesh, ["auto", "fill_holes"]), or --repair auto,fill_holes on the command line.'
    )
    if table.n_faces[worst] > 2:
        remedy = "No repair here tells which of them to remove; do so where the surface was made."
    raise InvalidShapeError(
        "Each edge of a surface to be filled must have two faces of each piece; edge "
        f"{table.edges[worst].tolist()} has {table.n_faces[worst]} ({len(edges)} such). {remedy}"
    )


def _is_bounded_by(solid: SimplicialMesh, surface: TriangleMesh) -> bool:
    """Tell whether the triangles at an odd number of tetrahedra are those of the surface."""
    table = facet_table(solid)
    odd = table.facets[table.n_simplices % 2 == 1]
    return np.array_equal(odd, np.unique(np.sort(surface.faces, axis=1), axis=0))
