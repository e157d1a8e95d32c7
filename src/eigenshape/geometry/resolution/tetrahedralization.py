"""Tetrahedra inside a closed surface."""

from threading import Lock

import numpy as np

from eigenshape._arrays import positive_number
from eigenshape._errors import InvalidShapeError
from eigenshape._extras import import_extra
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.crossings import self_intersections
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.orientation import orient_closed_outward
from eigenshape.geometry.requirements import require_oriented, require_sound
from eigenshape.geometry.simplices import simplex_volumes, size_one
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import boundary_edges, non_manifold_edges

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
        its faces must look into it.
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
        If the surface has a boundary, an edge with more than two faces, faces that cross or have no
        area, or the tetrahedra do not fill what it encloses.
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
    crowded, open_edges = non_manifold_edges(mesh), boundary_edges(mesh)
    if len(crowded) or len(open_edges):
        fault = "more than two faces" if len(crowded) else "one face"
        edge = (crowded if len(crowded) else open_edges)[0]
        raise InvalidShapeError(
            "Each edge of a surface to be filled must have two faces; edge "
            f"({edge[0]}, {edge[1]}) has {fault} ({len(crowded)} edges with more, "
            f'{len(open_edges)} with one). Try repair(mesh, ["auto", "fill_holes"]), or '
            "--repair auto,fill_holes on the command line."
        )
    require_oriented(mesh)
    crossing = self_intersections(mesh)
    if len(crossing):
        one, two = crossing[0]
        raise InvalidShapeError(
            f"Faces of a surface to be filled must not cross; faces {one} and {two} do "
            f"({len(crossing)} pairs). No repair here moves vertices; smooth or remesh it where it "
            "was made."
        )
    netgen = import_extra("netgen.meshing", "'eigenshape[tetrahedralize]'")
    surface = orient_closed_outward(mesh)
    points, scale = size_one(surface.vertices)
    center = points.mean(axis=0)
    with ONE_MESHER:
        solid = netgen.Mesh(dim=3)
        solid.AddPoints(np.ascontiguousarray(points - center))
        side = solid.Add(netgen.FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
        solid.AddElements(dim=2, index=side, data=surface.faces.astype(np.int32), base=0)
        solid.GenerateVolumeMesh(maxh=WITHOUT_LIMIT if longest is None else longest / scale)
        inside = np.array(solid.Coordinates())[mesh.n_vertices :]
        # Older versions of Netgen have room for the nodes of elements of higher order behind.
        corners = solid.Elements3D().NumPy()["nodes"][:, :4].astype(np.int64) - 1
    points = np.concatenate([surface.vertices, (inside + center) * scale])
    found = SimplicialMesh(points, corners) if len(corners) else None
    filled = 0.0 if found is None else float(simplex_volumes(found).sum())
    volume = enclosed_volume(surface)
    if found is None or abs(filled - volume) > 1e-6 * volume:
        raise InvalidShapeError(
            f"Tetrahedra must fill what the surface encloses, {volume:g}; Netgen filled {filled:g}. "
            "Faces of a cavity must look into it, and pieces must not lie in each other otherwise. "
            'Try repair(mesh, ["largest_component"]), or --repair largest_component on the command '
            "line."
        )
    return found
