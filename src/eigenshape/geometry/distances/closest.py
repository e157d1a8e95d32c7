"""Nearest points on a surface, winding numbers around points, and distances in space."""

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows
from eigenshape._corners import in_length
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.closest_loops import nearest_faces, windings
from eigenshape.geometry.distances.crossing_loops import box_tree, curve_places, face_boxes
from eigenshape.geometry.distances.nesting import find_pieces
from eigenshape.geometry.face_turns import face_turns
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.requirements import require_oriented
from eigenshape.geometry.samples.surface_points import SurfacePoints, place_points
from eigenshape.geometry.topology import is_closed

# Points may be this many sizes of the mesh away: products of three distances stay below 1e200, and
# floats end at 1e308.
FARTHEST_SIZES = 1e50
# Winding numbers above this are inside: those of a closed surface are 1 there and 0 outside, and a
# small hole changes them by little.
INSIDE = 0.5


def closest_points(mesh: MeshLike, points: ArrayLike) -> SurfacePoints:
    """Find the point of a surface that is nearest to each of some points in space.

    The distances are exact up to rounding: boxes around faces are searched, and in each face the
    foot of the perpendicular or the nearest point of its border is taken.

    Parameters
    ----------
    mesh : MeshLike
        Of any topology and orientation; faces may have no area.
    points : (p, 3) float

    Returns
    -------
    SurfacePoints
        The nearest points, their faces and their weights there. Of several that are equally near it
        is one of them.

    Raises
    ------
    InvalidShapeError
        If `points` is not a table of three finite coordinates a row.
    InvalidParameterError
        If a point is more than 1e50 sizes of the mesh away.

    See Also
    --------
    signed_distance : The distances themselves, with a sign.

    Examples
    --------
    >>> import eigenshape as es
    >>> found = es.geometry.closest_points(es.shapes.grid(1, 1), [[0.25, 0.5, 3.0], [2.0, 0.5, 0.0]])
    >>> found.points.tolist()
    [[0.25, 0.5, 0.0], [1.0, 0.5, 0.0]]
    """
    mesh = as_mesh(mesh)
    corners, places, _ = _scale_both(mesh, points)
    return _search(mesh, corners, places)[0]


def winding_numbers(mesh: MeshLike, points: ArrayLike) -> Float[np.ndarray, " p"]:
    """Compute how often a surface winds around each of some points in space.

    The generalized winding number (Jacobson, Kavan, Sorkine-Hornung 2013): the sum of the signed
    solid angles of all faces, over 4π. A closed surface whose faces look outward has 1 inside and 0
    outside; where two such overlap it is 2. A surface with holes has values between, close to
    these away from the holes.

    All faces count for each point: 10⁸ pairs of point and face take some seconds.

    Parameters
    ----------
    mesh : MeshLike
        Of any topology; a face that is turned over counts negative.
    points : (p, 3) float

    Returns
    -------
    (p,) float
        Without unit. On the surface it is one of the values of both sides.

    Raises
    ------
    InvalidShapeError, InvalidParameterError
        As in `closest_points`.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.winding_numbers(es.icosphere(1), [[0, 0, 0], [2, 0, 0]]).round(12).tolist()
    [1.0, 0.0]
    """
    mesh = as_mesh(mesh)
    corners, places, _ = _scale_both(mesh, points)
    return windings(places, corners) + 0.0  # no -0.0


def signed_distance(mesh: MeshLike, points: ArrayLike) -> Float[np.ndarray, " p"]:
    """Compute the distance in space from points to a surface, negative inside it.

    The distance to the nearest point of the surface is exact up to rounding, as in
    `closest_points`. A point is inside if the surface winds around it, by the generalized winding
    number above 1/2 (Jacobson, Kavan, Sorkine-Hornung 2013), and if it lies in the box around the
    surface. That needs no normals, so edges, corners and needles do no harm. Small holes are closed
    as by a film; pieces may overlap, and then count as their union.

    Parameters
    ----------
    mesh : MeshLike
        Consistently oriented, faces looking outward; closed, or with holes. A piece inside another
        that looks inward bounds a cavity.
    points : (p, 3) float

    Returns
    -------
    (p,) float
        In length: negative inside, positive outside, 0 on the surface.

    Raises
    ------
    InvalidShapeError
        If two neighboring faces are turned against each other, or faces look inward, or as in
        `closest_points`.
    InvalidParameterError
        If a point is more than 1e50 sizes of the mesh away.

    See Also
    --------
    closest_points : Where the nearest points are.
    eigenshape.calculus.signed_heat_distance : Signed distance along a surface to curves.

    Examples
    --------
    >>> import eigenshape as es
    >>> cube = es.geometry.boundary_surface(es.shapes.box(1, 1, 1))
    >>> es.geometry.signed_distance(cube, [[0.5, 0.5, 0.75], [2.0, 0.5, 0.5]]).tolist()
    [-0.25, 1.0]
    """
    mesh = as_mesh(mesh)
    corners, places, scale = _scale_both(mesh, points)
    # A closed piece, or an open mesh as a whole, must not look inward.
    require_oriented(mesh)
    pieces = find_pieces(mesh, face_turns(mesh))
    solid_inward = (pieces.sides < 0) & (pieces.depths % 2 == 0)
    inward = solid_inward[pieces.of_faces]
    if inward.any():
        raise InvalidShapeError(
            "Faces must look outward, or inside and outside change places; face "
            f"{np.argmax(inward)} looks inward ({np.count_nonzero(inward)} such). "
            'Try repair(mesh, ["orient"]).'
        )
    if not is_closed(mesh) and orient_outward(mesh) is not mesh:
        raise InvalidShapeError(
            "Faces must look outward, or inside and outside change places; those of the convex "
            "hull look inward. Try orient_outward(mesh)."
        )
    _, distances = _search(mesh, corners, places)
    lowest, highest = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    boxed = ((places > lowest) & (places < highest)).all(axis=1) & (distances > 0)
    inside = np.flatnonzero(boxed)[windings(places[boxed], corners) > INSIDE]
    distances[inside] *= -1
    return in_length(distances, scale, 1)


def _scale_both(
    mesh: TriangleMesh, points: ArrayLike
) -> tuple[Float[np.ndarray, "f 3 3"], Float[np.ndarray, "p 3"], float]:
    """Return corners and points relative to the middle of the mesh, in units of its size, and it."""
    places = finite_rows(points, "points", 3)
    corners = mesh.vertices[mesh.faces]
    middle = corners.min(axis=(0, 1)) / 2 + corners.max(axis=(0, 1)) / 2
    corners, scale = size_one(corners - middle)
    with np.errstate(over="ignore"):
        scaled = (places - middle) / scale
    far = np.flatnonzero((np.abs(scaled) > FARTHEST_SIZES).any(axis=1))
    if far.size:
        raise InvalidParameterError(
            f"Points must lie within {FARTHEST_SIZES:.0e} sizes of the mesh; point {far[0]} is at "
            f"{places[far[0]].tolist()} ({far.size} such). Seen from there the mesh is a point."
        )
    return corners, scaled, scale


def _search(
    mesh: TriangleMesh, corners: Float[np.ndarray, "f 3 3"], places: Float[np.ndarray, "p 3"]
) -> tuple[SurfacePoints, Float[np.ndarray, " p"]]:
    """Return the nearest points and the scaled distances to them."""
    boxes = face_boxes(corners.reshape(-1, 3))
    order = np.argsort(curve_places(boxes), kind="stable")
    found, weights, squares = nearest_faces(places, corners[order], *box_tree(boxes[order]))
    return place_points(mesh, order[found], weights), np.sqrt(squares)
