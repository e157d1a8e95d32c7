"""Signed geodesic distance to oriented curves on a surface, by heat."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import whole_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape.calculus.vector_heat import (
    VectorHeat,
    as_mesh_heat,
    diffuse,
    edge_sums,
    integrate_along_edges,
    normalize,
)
from eigenshape.geometry.conversion import MeshLike
from eigenshape.geometry.simplices import in_length
from eigenshape.operators.tufted import side_ends


def signed_heat_distance(
    mesh: MeshLike | VectorHeat, curves: Sequence[ArrayLike]
) -> Float[np.ndarray, " n"]:
    """Compute the signed geodesic distance to oriented curves by the signed heat method.

    The normals of the curves flow for a short time by the connection Laplacian. Heat transports
    them along shortest paths, so the normalized field X is close to the gradient of the signed
    distance, which follows from the Poisson equation Δφ = div X (Feng and Crane 2024). The
    published method keeps vectors at edges; here they are at vertices, and the factors are those
    of `transport_vectors`. The error is of the order of the edge length, mostly at corners of the
    curves, where a vertex takes the mean of two normals: there it is two to three times that of the
    published method.

    The sign is positive on the right of a curve and negative on its left, for one who walks along
    it on the outside of the surface. So inside a loop that runs counter-clockwise it is negative.
    A curve need not be closed. Beyond its ends the sign changes along its continuation: to a
    straight segment in a plane, the result is the distance to the whole line, and a loop with a
    small gap has nearly the distance of the loop.

    Parameters
    ----------
    mesh : MeshLike or VectorHeat
        `prepare_vector_heat(mesh)` keeps the factors for further calls, and has the options.
    curves : list of (k,) int
        Vertices along each curve; each two that follow are the ends of an edge. A curve is closed
        if its last vertex is its first. Pass several curves of one component turned consistently,
        such that a point is on the same side of all.

    Returns
    -------
    (n,) float
        Signed distance of each vertex, in length. The mean along the curves of each component is 0;
        components without a curve are infinitely far.

    Raises
    ------
    InvalidParameterError
        If there is no curve, a curve is not a list of at least two vertices, or two of its vertices
        that follow are not the ends of an edge; if curves run along the same edges to and fro, so
        that their normals cancel; or if heat from them is too small for a float somewhere.
    InvalidShapeError
        As in `prepare_vector_heat`.

    See Also
    --------
    heat_distances : Distance without a sign.
    eigenshape.geometry.signed_distance : The distance in space to a closed surface.

    Examples
    --------
    To a line through the middle of a square, run from below to above:

    >>> import eigenshape as es
    >>> square = es.shapes.grid(4, 4)
    >>> line = (square.vertices[:, 0] == 0.5).nonzero()[0]
    >>> distance = es.calculus.signed_heat_distance(square, [line])
    >>> bool(abs(distance - (square.vertices[:, 0] - 0.5)).max() < 1e-12)
    True
    """
    solver = as_mesh_heat(mesh)
    n, directions, faces = solver.n_points, solver.directions, solver.mesh.faces
    if not len(curves):
        raise InvalidParameterError("There must be at least one curve; there is none.")
    paths = []
    for number, curve in enumerate(curves):
        if np.ndim(curve) == 0:
            raise InvalidParameterError(
                f"curves must be a list of curves, each a list of vertices; curve {number} is "
                f"{curve!r}. Pass a single curve as [curve]."
            )
        vertices = whole_numbers(curve, f"A vertex of curve {number}", 0, n - 1)
        if len(vertices) < 2:
            raise InvalidParameterError(
                f"A curve must have at least two vertices; curve {number} has {len(vertices)}. "
                "The distance to a point has no sign: see heat_distances."
            )
        paths.append(vertices)
    starts = np.concatenate([path[:-1] for path in paths])
    ends = np.concatenate([path[1:] for path in paths])
    # The direction of each edge at its start, and the direction back at its end. An edge may run
    # along a side of a face or against it.
    tails, heads = side_ends(faces)
    keys = np.concatenate([tails * n + heads, heads * n + tails])
    there = np.concatenate([directions.at_tail, directions.at_head])
    back = np.concatenate([directions.at_head, directions.at_tail])
    known, first = np.unique(keys, return_index=True)
    wanted = starts * n + ends
    place = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
    bad = np.flatnonzero(known[place] != wanted)
    if bad.size:
        raise InvalidParameterError(
            "Two vertices that follow on a curve must be the ends of an edge; "
            f"{starts[bad[0]]} and {ends[bad[0]]} are not ({bad.size} such). "
            "es.calculus.geodesic_path finds ways between vertices that are not neighbors."
        )
    outward, backward = np.exp(1j * there[first[place]]), np.exp(1j * back[first[place]])
    points = solver.mesh.vertices
    lengths = np.linalg.norm(points[ends] - points[starts], axis=1)
    # A quarter turn to the right from the way ahead; half of each edge counts at each of its ends.
    normals = np.zeros(n, dtype=complex)
    np.add.at(normals, starts, -1j * outward * lengths / 2)
    np.add.at(normals, ends, 1j * backward * lengths / 2)
    reached = np.isin(solver.components, solver.components[starts])
    field = diffuse(solver, normals)
    # Where fronts meet, vectors may cancel at a vertex or along a line, but not on a whole face.
    cold = np.flatnonzero(reached[faces[:, 0]] & (field[faces] == 0).all(axis=1))
    if cold.size:
        raise InvalidParameterError(
            "Normals of the curves must reach every face of their components; at face "
            f"{cold[0]} they cancel, or are too small for a float ({cold.size} such). Run along "
            "each edge once, or choose a larger time_factor of prepare_vector_heat."
        )
    # Vectors are added before they are normalized: where fronts meet, they nearly cancel and their
    # direction is rounding, which the longer vector at the other end of the edge outweighs.
    distance = integrate_along_edges(solver, normalize(edge_sums(solver, field)))

    n_components = int(solver.components.max()) + 1
    along = np.bincount(solver.components[starts], lengths, minlength=n_components)
    middles = lengths * (distance[starts] + distance[ends]) / 2
    sums = np.bincount(solver.components[starts], middles, minlength=n_components)
    means = sums / np.where(along > 0, along, 1.0)
    shifted = distance - means[solver.components]
    return in_length(np.where(reached, shifted, np.inf), solver.scale, 1)
