"""The logarithmic map of a surface, by short heat flow."""

from typing import Literal

import numpy as np
from jaxtyping import Complex, Float

from certeig.kit.arguments import require_choice
from certeig.kit.arrays import whole_number
from certeig.kit.typing import Integer
from eigenshape._corners import face_angles, in_length, side_ends
from eigenshape.calculus.places import require_one, vertex_number
from eigenshape.calculus.unfolding import flat_corners
from eigenshape.calculus.vector_heat import (
    MeshVectorHeat,
    VectorHeat,
    as_mesh_heat,
    as_rows,
    diffuse,
    edge_sums,
    integrate_along_edges,
    normalize,
    require_source_everywhere,
    scalar_impulse,
    side_vectors,
)
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.samples.surface_points import SurfacePoints, require_on

LogMethod = Literal["affine", "adaptive", "radial"]


def logarithmic_map(
    mesh: MeshLike | VectorHeat, source: Integer | SurfacePoints, *, method: LogMethod = "affine"
) -> Float[np.ndarray, "n 2"]:
    """Compute the logarithmic map at a vertex or point: polar coordinates of all vertices around it.

    The length of each result is the geodesic distance from the source, its angle the direction in
    which the shortest path leaves the source.

    Parameters
    ----------
    mesh : MeshLike or VectorHeat
        `prepare_vector_heat(mesh)` keeps the factors for further calls.
    source : int or SurfacePoints
        Vertex, or one point, such as `closest_points` finds.
    method : {"affine", "adaptive", "radial"}
        "affine": heat of affine coordinates in the frames of all vertices, the most accurate on
        the nearer half of a sphere. "adaptive": the same in one frame that is transported from the
        source, the most accurate where curvature changes much (both Soliman and Sharp, The affine
        heat method, 2025). "radial": the angle between a transported vector and a field that
        points away from the source, which is also integrated to distances (Sharp, Soliman, Crane
        2019, section 8). Beyond the cut locus only "radial" still gives the distance.

    Returns
    -------
    (n, 2) float
        Coordinates in the frame of the source, in length: of a vertex the row of
        `operators.tangent_frames`, of a point x along the first side of its face.
        The source is at 0 for "radial", and within rounding of it on flat regions for the others.

    Raises
    ------
    InvalidParameterError
        If the source is not a vertex or one point of this mesh, a component does not contain it, heat
        is too small for a float somewhere, or `method` is not one of the three.
    InvalidShapeError
        As in `prepare_vector_heat`.

    See Also
    --------
    transport_vectors : Conventions of frames.
    trace_geodesic : The inverse, the exponential map, of one vector.

    Examples
    --------
    On a plane these are the differences of coordinates, turned into the frame of the source:

    >>> import eigenshape as es
    >>> import numpy as np
    >>> square = es.shapes.grid(10, 10)
    >>> found = es.calculus.logarithmic_map(square, 60)
    >>> offsets = square.vertices - square.vertices[60]
    >>> exact = offsets @ es.operators.tangent_frames(square)[60].T
    >>> bool(np.allclose(found, exact))
    True
    """
    require_choice(method, LogMethod, "method")
    if isinstance(source, SurfacePoints):
        return _map_at(mesh, source, method)
    solver = as_mesh_heat(mesh)
    start = vertex_number(solver.n_points, source, "source")
    require_source_everywhere(solver, np.array([start]))
    weight = scalar_impulse(solver, start)
    impulse = np.zeros(solver.n_points, dtype=complex)
    impulse[start] = 1.0
    parallel = normalize(diffuse(solver, impulse))
    parallel[parallel == 0] = 1.0  # opposite to the source any direction will do
    if method == "radial":
        # The field that points away from the source, integrated to distances.
        radial = normalize(diffuse(solver, _outward_field(solver, start)))
        radial[start] = 0.0
        distance = integrate_along_edges(solver, edge_sums(solver, radial) / 2)
        found = radial / parallel * (distance - distance[start])
        return in_length(as_rows(found), solver.scale, 1)
    # Affine coordinates (z, w), in which an edge is a translation: heat takes (z, w) at j to
    # (z - w e, w) at i, with the edge e from i to j in the frame at i. So w is the heat of
    # functions, and z that with a source of translations. Each side counts from both of its ends.
    tails, heads = side_ends(solver.mesh.faces)
    at_tail, at_head, _, weights = side_vectors(solver)
    forth = -weights * weight[heads] * at_tail
    back = weights * weight[tails] * at_head
    if method == "adaptive":  # in the transported frame
        forth, back = forth / parallel[tails], back / parallel[heads]
    sources = np.zeros(solver.n_points, dtype=complex)
    np.add.at(sources, tails, forth)
    np.add.at(sources, heads, back)
    time = solver.time / solver.scale**2
    if method == "adaptive":
        moved = solver.scalar_heat.solve(time * as_rows(sources))
        found = (moved[:, 0] + 1j * moved[:, 1]) / weight
    else:
        found = diffuse(solver, time * sources) / weight / parallel
    return in_length(as_rows(found), solver.scale, 1)


def _map_at(
    mesh: MeshLike | VectorHeat, place: SurfacePoints, method: LogMethod
) -> Float[np.ndarray, "n 2"]:
    """Average the maps at the corners of a face, moved and turned to a point of it.

    That is exact in a plane, and on a curved surface up to the square of the size of the face.
    """
    solver = as_mesh_heat(mesh)
    require_one(place, "source")
    if not isinstance(mesh, VectorHeat):  # which has no coordinates to compare with
        require_on(as_mesh(mesh), place, "source")
    n_faces = solver.mesh.n_faces
    face = whole_number(place.simplices[0], "The face of source", 0, n_faces - 1)
    flat = flat_corners(solver.mesh.vertices[solver.mesh.faces[face]])
    offsets = flat - place.weights[0] @ flat
    found = np.zeros(solver.n_points, dtype=complex)
    for corner, vertex in enumerate(solver.mesh.faces[face]):
        way = np.angle(flat[(corner + 1) % 3] - flat[corner])
        turn = np.exp(1j * (way - solver.directions.at_tail[3 * face + corner]))
        rows = logarithmic_map(solver, vertex, method=method) / solver.scale
        own = turn * (rows[:, 0] + 1j * rows[:, 1]) + offsets[corner]
        found += place.weights[0, corner] * own
    return in_length(as_rows(found), solver.scale, 1)


def _outward_field(solver: MeshVectorHeat, start: int) -> Complex[np.ndarray, " n"]:
    """Integrate the unit field that points away from a vertex against the hat functions around it.

    The integrals over each face are exact (Sharp, Soliman, Crane 2019, appendix A).
    """
    mesh, directions = solver.mesh, solver.directions
    faces, corners = np.nonzero(mesh.faces == start)
    side = 3 * faces + corners
    following, last = 3 * faces + (corners + 1) % 3, 3 * faces + (corners + 2) % 3
    angles = face_angles(mesh).ravel()
    theta = angles[side]
    # Twice the area over the sides of the face is its height over each.
    points = mesh.vertices[mesh.faces]
    lengths = np.linalg.norm(np.roll(points, -1, axis=1) - points, axis=2).ravel()
    double_area = lengths[side] * lengths[last] * np.sin(theta)
    field = np.zeros(mesh.n_vertices, dtype=complex)

    along, across = -theta * np.sin(theta), theta * np.cos(theta) - np.sin(theta)
    heads, tails = mesh.faces.ravel()[following], mesh.faces.ravel()[last]
    to_start = np.exp(1j * directions.at_head[side])
    np.add.at(field, heads, (along + 1j * across) * lengths[last] / (2 * double_area) * to_start)
    to_start = np.exp(1j * directions.at_tail[last])
    np.add.at(field, tails, (along - 1j * across) * lengths[side] / (2 * double_area) * to_start)

    alpha = np.pi / 2 - angles[following]
    along = -(theta * np.cos(alpha) + np.cos(alpha - theta) * np.sin(theta)) / 2
    across = -(np.cos(alpha) - np.cos(alpha - 2 * theta) + 2 * theta * np.sin(alpha)) / 4
    outward = (along + 1j * across) * np.exp(1j * directions.at_tail[side])
    field[start] = (outward * lengths[following] / double_area).sum()
    return field
