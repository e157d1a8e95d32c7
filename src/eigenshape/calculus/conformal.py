"""Maps that keep angles: of surfaces with boundary to the plane, and of genus 0 to the sphere."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.sparse.linalg import spsolve

from certeig.kit.arrays import EPS, real_numbers
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.progress import Progress, silent
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import require_finite_rows, step_number
from eigenshape._corners import at_points, scaled_corners, side_lengths, triangular_sides
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import row_dots, scale_to_unit, size_one, triangle_areas, unit_vectors
from eigenshape.calculus.linear_solver import LinearSolver, factor_definite
from eigenshape.calculus.vector_heat import as_rows
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_oriented, require_sound, require_two_faces
from eigenshape.geometry.topology import (
    boundary_edges,
    euler_characteristic,
    is_closed,
    vertex_components,
)
from eigenshape.operators.connection import as_real
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.robust import robust_laplacian

# Multiple of the mass that makes the conformal energy of a flat mesh definite, relative to the
# largest entries of both. It changes the map by as much.
SHIFT = 1e-10
# Inverse iteration stops where the map changes by this share of its size. The next energy is
# several times the lowest on discs, so 10 to 30 iterations are enough.
SETTLED, MOST_ITERATIONS = 1e-9, 300
# Step of the conformal flow to the sphere, for a surface of area 4π. With 0.5 a biped is round
# after 30 steps, with 0.02 after 150, and its angles are the same to 1 %.
FLOW_STEP = 0.5
# The flow has come to its end where the radii have not come nearer to each other for so many steps,
# by this share. On meshes they stay apart by the discretization error: 6 % of the radius with 162
# vertices, 1.5 % with 642.
PATIENCE, IMPROVEMENT = 10, 0.01
# Radii within this of each other count as a sphere, whose radius is 1.
ROUND = 0.3
# Rounds in which triangles that the flow turned over are turned back, each farther around them. A
# head of 10,540 faces needs two.
MOST_ROUNDS = 8
# Height of a triangle on the unit sphere, below which rounding decides how it lies.
ROUNDING = 4 * EPS


def flatten_conformally(mesh: MeshLike) -> Float[np.ndarray, "n 2"]:
    """Map a surface with boundary to the plane with as little change of angles as possible.

    Spectral conformal parameterization (Mullen, Tong, Alliez and Desbrun 2008): the complex
    coordinates z minimize the conformal energy ½ Σ w_ij |z_i - z_j|² - area(z), which is 0 for a
    conformal map, at a given Σ |z|² over the boundary, by inverse iteration on one factor. No
    points are pinned. Least-squares conformal maps (Lévy and others 2002) minimize the same energy
    with two pinned points, on which the result depends.

    Parameters
    ----------
    mesh : MeshLike
        Connected and consistently oriented, with a boundary. A disc gives a map without folds on
        most meshes; that of a surface with handles covers parts of the plane several times.

    Returns
    -------
    (n, 2) float
        In length: the area is that of the surface, and the mean over the boundary is 0.

    Raises
    ------
    InvalidShapeError
        If the mesh is not connected, has no boundary, has faces without area or repeated, or
        neighboring faces have opposite orientations, or more than two share an edge.
    ConvergenceError
        If the iteration does not settle, or faces are too thin for its equations to be solved.

    See Also
    --------
    es.calculus.angle_distortion : How far a map is from conformal.

    Examples
    --------
    A piece of a cylinder is unrolled without distortion:

    >>> import eigenshape as es
    >>> import numpy as np
    >>> sheet = es.shapes.grid(8, 4)
    >>> x, y, _ = sheet.vertices.T
    >>> roof = es.TriangleMesh(np.column_stack([np.cos(x), y, np.sin(x)]), sheet.faces)
    >>> plane = es.calculus.flatten_conformally(roof)
    >>> es.calculus.angle_distortion(roof, plane).max().round(2).item()
    1.0
    """
    mesh = as_mesh(mesh)
    require_sound(mesh)
    require_two_faces(mesh)
    require_oriented(mesh)
    rim = boundary_edges(mesh)
    n_components, _ = vertex_components(mesh)
    if not len(rim) or n_components > 1:
        raise InvalidShapeError(
            "A surface must be connected and have a boundary to be flattened; this one has "
            f"{n_components} components and {len(rim)} boundary edges. Cut a closed surface open, "
            "or use map_to_sphere."
        )
    points, scale = scale_to_unit(mesh.vertices)
    unit = TriangleMesh(points, mesh.faces)
    laplacian = cotangent_laplacian(unit)
    # The Hermitian M with zᴴMz the signed area of z, from the boundary edges:
    # Im(conj(z_tail) z_head) / 2 for each.
    quarter = np.full(len(rim), -0.25j)
    half = sp.csr_array((quarter, rim.T), shape=laplacian.mass.shape)
    energy = as_real(laplacian.stiffness - 2 * (half + half.conj().T))
    mass = sp.kron(laplacian.mass, sp.eye_array(2))
    shift = SHIFT * energy.diagonal().max() / mass.diagonal().max()
    solver = _factor(energy + shift * mass)
    on_rim = np.zeros(mesh.n_vertices)
    on_rim[rim] = 1.0

    # The lowest energy is double, since a rotation of the plane does not change it: any vector of
    # its eigenspace is a solution, and a single one converges to one.
    found = np.random.default_rng(0).standard_normal(2 * mesh.n_vertices).view(complex)
    for _ in range(MOST_ITERATIONS):
        before = found
        found = solver.solve((on_rim * found).view(float)).view(complex)
        found = found - (on_rim @ found) / on_rim.sum()
        found /= np.sqrt(on_rim @ np.abs(found) ** 2)
        # Rotated back onto the last one, where the solution may have turned.
        turn = np.vdot(found * on_rim, before)
        found *= turn / abs(turn)
        if np.sqrt(on_rim @ np.abs(found - before) ** 2) < SETTLED:
            break
    else:
        raise ConvergenceError(
            f"The conformal map must settle within {MOST_ITERATIONS} iterations; it still changes "
            f"by {np.sqrt(on_rim @ np.abs(found - before) ** 2):.1e}. "
            'Try repair(mesh, ["collapse_needles"]).'
        )
    plane = as_rows(found)
    corners = plane[mesh.faces]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    signed = ((one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2).sum()
    return plane * (np.sqrt(face_areas(unit).sum() / abs(signed)) * scale)


def map_to_sphere(
    mesh: MeshLike,
    *,
    n_steps: Integer = 500,
    progress: Progress | None = None,
) -> Float[np.ndarray, "n 3"]:
    """Map a closed surface of genus 0 to the unit sphere with little change of angles.

    Conformalized mean curvature flow until the surface is round (Kazhdan, Solomon and Ben-Chen
    2012), then division by the radius. The flow takes the Laplacian of intrinsic Delaunay
    triangles, whose weights are positive. A triangle that is turned over nevertheless is turned back
    by a harmonic map of its neighborhood (Floater 2003). Parts that stick out
    become very small: a limb by exp(-length/radius), for the legs of a camel to 1e-13. The map is
    nearly conformal where the sphere's triangles stay well shaped.

    Parameters
    ----------
    mesh : MeshLike
        Closed, connected, consistently oriented, of genus 0.
    n_steps : int
        Largest number of steps of the flow.
    progress : callable, optional
        Called as progress(fraction_done, message) after each step. The number of steps is not known
        beforehand: the fraction is that of `n_steps`, and jumps to 1 at the end.

    Returns
    -------
    (n, 3) float
        Unit vectors, with the orientation of the surface; no triangle is turned over, up to
        rounding: one of height below 1e-15 may be.

    Raises
    ------
    InvalidShapeError
        If the mesh is not closed, connected and of genus 0, faces have no area or are repeated, or
        neighboring faces have opposite orientations, or more than two share an edge.
    ConvergenceError
        If the surface does not become round, triangles are turned over on the sphere or collapse
        there, or faces are too thin for the equations of the flow to be solved.

    See Also
    --------
    es.calculus.angle_distortion : How far a map is from conformal.
    es.calculus.mean_curvature_flow : The flow.

    Examples
    --------
    >>> import eigenshape as es
    >>> import numpy as np
    >>> ball = es.icosphere(2)
    >>> egg = es.TriangleMesh(ball.vertices * [1.0, 1.0, 1.5], ball.faces)
    >>> sphere = es.calculus.map_to_sphere(egg)
    >>> np.linalg.norm(sphere, axis=1).round(12).max().item()
    1.0
    """
    mesh = as_mesh(mesh)
    most = step_number(n_steps)
    require_sound(mesh)
    require_two_faces(mesh)
    require_oriented(mesh)
    euler, (n_components, _) = euler_characteristic(mesh), vertex_components(mesh)
    if not is_closed(mesh) or n_components > 1 or euler != 2:
        raise InvalidShapeError(
            "Only a closed connected surface of genus 0 maps to the sphere; this one "
            f"{'is closed' if is_closed(mesh) else 'has a boundary'}, has {n_components} "
            f"components and Euler characteristic {euler} (a sphere has 2)."
        )
    points, _ = scale_to_unit(mesh.vertices)
    stiffness = robust_laplacian(TriangleMesh(points, mesh.faces), mollify=0.0).stiffness
    sphere, least, n_idle = points, np.inf, 0
    report_progress = progress or silent
    for number in range(most):
        report_progress(number / most, f"step {number + 1}, radii differ by {least:.2g}")
        areas = triangle_areas(points[mesh.faces])
        weights = at_points(mesh, areas / 3)
        # Moved to the center and scaled to area 4π, so that the limit is the unit sphere.
        factor = 4 * np.pi / areas.sum()
        points = (points - weights @ points / weights.sum()) * np.sqrt(factor)
        radii = np.linalg.norm(points, axis=1)
        spread = float(np.ptp(radii))
        n_idle = 0 if spread < (1 - IMPROVEMENT) * least else n_idle + 1
        if spread < least:
            sphere, least = points / radii[:, None], spread
        if n_idle == PATIENCE:
            break
        mass = sp.diags_array(weights * factor)
        points = _factor(mass + FLOW_STEP * stiffness).solve(mass @ points)
    report_progress(1.0, "round")
    if least > ROUND:
        raise ConvergenceError(
            f"The flow must make the surface round within {most} steps; the radii of its vertices "
            f"still differ by {least:.2g} of the radius. Pass a larger n_steps, or use a finer "
            "mesh."
        )
    sides = side_lengths(sphere[mesh.faces]).max(axis=1)
    pointlike = np.flatnonzero(sides <= ROUNDING)
    if pointlike.size:
        raise ConvergenceError(
            "Where angles are kept, the ends of long limbs become smaller than rounding on the "
            f"sphere; {pointlike.size} of {mesh.n_faces} triangles become points, the first is face "
            f"{pointlike[0]}. Cut these limbs off."
        )
    turned = _turned_faces(mesh, sphere)
    for n_rings in range(MOST_ROUNDS if turned.size else 0):
        sphere = _relax_around(mesh, sphere, turned, n_rings)
        turned = _turned_faces(mesh, sphere)
        if not turned.size:
            break
    if turned.size:
        raise ConvergenceError(
            "A map to the sphere must not turn triangles over; it turns "
            f"{turned.size} of {mesh.n_faces}, the first is face {turned[0]}. Use a finer mesh "
            "where limbs are thin."
        )
    return sphere


def _turned_faces(mesh: TriangleMesh, sphere: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, " t"]:
    """Return the faces that lie the other way than most."""
    a, b, c = sphere[mesh.faces].transpose(1, 0, 2)
    heights = row_dots(a, np.cross(b - a, c - a))
    if np.median(heights) < 0:  # a surface that faces inward
        heights = -heights
    # Places on the sphere are rounded by about 1e-16, which decides how triangles lie whose height
    # is less.
    sides = side_lengths(sphere[mesh.faces]).max(axis=1)
    return np.flatnonzero(heights < -ROUNDING * sides)


def _relax_around(
    mesh: TriangleMesh,
    sphere: Float[np.ndarray, "n 3"],
    faces: Int[np.ndarray, " t"],
    n_rings: int,
) -> Float[np.ndarray, "n 3"]:
    """Move the vertices of some faces, and rings around them, to means of their neighbors.

    The means are weighted by mean value coordinates (Floater 2003): they are positive on the
    triangles of the mesh itself, where the flow has those of intrinsic triangles.
    """
    points, n = size_one(mesh.vertices)[0], mesh.n_vertices
    rows, columns, weights = [], [], []
    for turn in range(3):
        i, j, k = np.roll(mesh.faces, turn, axis=1).T
        one, two = points[j] - points[i], points[k] - points[i]
        lengths = np.linalg.norm([one, two], axis=2)
        area = np.linalg.norm(np.cross(one, two), axis=1)
        half_angle = area / (lengths.prod(axis=0) + row_dots(one, two))  # its tangent
        rows += [i, i]
        columns += [j, k]
        weights += [half_angle / lengths[0], half_angle / lengths[1]]
    indices = (np.concatenate(rows), np.concatenate(columns))
    means = sp.csr_array((np.concatenate(weights), indices), shape=(n, n))
    means = sp.diags_array(1 / means.sum(axis=1)) @ means
    is_free = np.zeros(n, dtype=bool)
    is_free[mesh.faces[faces]] = True
    for _ in range(n_rings):
        is_free |= means @ is_free > 0
    if is_free.all():
        return sphere  # no vertex would hold the others in place
    free, fixed = np.flatnonzero(is_free), np.flatnonzero(~is_free)
    inner = sp.eye_array(len(free)) - means[free][:, free]
    moved = spsolve(inner.tocsc(), means[free][:, fixed] @ sphere[fixed])
    relaxed = sphere.copy()
    relaxed[free] = unit_vectors(moved)
    return relaxed


def angle_distortion(mesh: MeshLike, positions: ArrayLike) -> Float[np.ndarray, " f"]:
    """Compute how far a map is from conformal on each face: the ratio of its two stretches.

    The larger singular value of the linear map of a face over the smaller one, the
    quasi-conformal dilatation; 1 where angles stay.

    Parameters
    ----------
    mesh : MeshLike
    positions : (n, 2) or (n, 3) float
        Where the vertices are mapped.

    Returns
    -------
    (f,) float
        At least 1; infinite where a face collapses.

    Raises
    ------
    InvalidShapeError
        If a face of the mesh has no area.
    InvalidParameterError
        If `positions` has another shape or a number is not finite.

    Examples
    --------
    >>> import eigenshape as es
    >>> square = es.shapes.grid(1, 1)
    >>> es.calculus.angle_distortion(square, square.vertices * [3, 1, 1]).round(12).tolist()
    [3.0, 3.0]
    """
    mesh = as_mesh(mesh)
    require_sound(mesh)
    places = real_numbers(positions, "positions").astype(np.float64)
    if places.ndim != 2 or len(places) != mesh.n_vertices or places.shape[1] not in (2, 3):
        raise InvalidParameterError(
            f"positions must hold one place per vertex, shape ({mesh.n_vertices}, 2) or "
            f"({mesh.n_vertices}, 3); the shape is {places.shape}."
        )
    require_finite_rows(places, "positions", "vertex")
    _, before = triangular_sides(scaled_corners(mesh)[0])
    _, after = triangular_sides(places[mesh.faces])
    stretches = np.linalg.svd(after @ np.linalg.inv(before), compute_uv=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = stretches[:, 0] / stretches[:, 1]
    return np.where(stretches[:, 1] > 0, ratios, np.inf)


def _factor(matrix: sp.csr_array) -> LinearSolver:
    """Factor the equations of a map, which are definite but for rounding."""
    try:
        return factor_definite(matrix)
    except InvalidParameterError as err:
        raise ConvergenceError(
            "The equations of a conformal map must be definite up to rounding; faces are too thin "
            'for that. Try repair(mesh, ["collapse_needles"]).'
        ) from err
