"""Parallel transport and scalar extension by short heat flow."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Complex, Float, Int

from certeig.kit.arrays import ReadOnly, finite_values, positive_number, real_numbers, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress, silent
from certeig.kit.typing import ArrayLike
from certeig.sparse.symmetric_factor import SymmetricFactor
from eigenshape._arrays import require_finite_rows, require_sources
from eigenshape._corners import in_length, side_ends
from eigenshape._vectors import scale_to_unit, size_one
from eigenshape.calculus.heat_distance import require_heat
from eigenshape.calculus.linear_solver import (
    GroundedFactor,
    factorize_definite,
    factorize_grounded,
)
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import edge_lengths
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.connection import connection_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.directions import Directions, half_cotangents, vertex_directions
from eigenshape.operators.robust import robust_laplacian

Field = Complex[np.ndarray, " n"]


@record
class VectorHeat(ReadOnly):
    """A surface that is ready for transport by heat: three factors, used for all sources.

    `prepare_vector_heat` makes it. All lengths inside are divided by `scale`.

    Attributes
    ----------
    time : float
        Time t of the heat, in length².
    scale : float
        A power of two, the size of the coordinates, in length.
    components : (n,) int
        Connected component of each vertex.
    scalar_heat, vector_heat : SymmetricFactor
        Factors of B + tW for functions and for tangent vectors.
    poisson : GroundedFactor
        Factor of W with one vertex of each component fixed.

    Examples
    --------
    Prepare a surface once, then transport vectors from several vertices:

    >>> import eigenshape as es
    >>> solver = es.calculus.prepare_vector_heat(es.icosphere(2))
    >>> solver.n_points
    162
    >>> for source in (0, 50):
    ...     print(es.calculus.transport_vectors(solver, [source], [[1.0, 0.0]]).shape)
    (162, 2)
    (162, 2)
    """

    time: float
    scale: float
    components: Int[np.ndarray, " n"]
    scalar_heat: SymmetricFactor
    vector_heat: SymmetricFactor
    poisson: GroundedFactor

    @property
    def n_points(self) -> int:
        """Number of vertices n."""
        return len(self.components)

    def __repr__(self) -> str:
        return f"VectorHeat({self.n_points} points, time={self.time:.4g})"


@record
class MeshVectorHeat(VectorHeat):
    """A mesh that is ready: the mesh, scaled, and the angles of its sides in their tangent planes."""

    mesh: TriangleMesh
    directions: Directions

    __repr__ = VectorHeat.__repr__


def prepare_vector_heat(
    mesh: MeshLike | PointCloud, *, time_factor: float = 1.0, progress: Progress | None = None
) -> VectorHeat:
    """Factor the equations of transport by heat, to be used for any number of sources.

    Parameters
    ----------
    mesh : MeshLike or PointCloud
        A manifold, with or without boundary, with consistently oriented faces; or points of a surface
        in R³.
    time_factor : float
        The heat flows for the time t = time_factor × h², with the mean edge length h; of a point
        cloud that of `robust_laplacian`.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    VectorHeat

    Raises
    ------
    InvalidShapeError
        As in `connection_laplacian`, or if triangles are so thin that the equations cannot be
        factored.
    InvalidParameterError
        If `time_factor` is not positive and finite.

    See Also
    --------
    extend_scalar, transport_vectors, logarithmic_map : What it is for.

    Examples
    --------
    >>> import eigenshape as es
    >>> solver = es.calculus.prepare_vector_heat(es.icosphere(2))
    >>> es.calculus.logarithmic_map(solver, 0).shape
    (162, 2)
    """
    factor = positive_number(time_factor, "time_factor")
    report_progress = progress or silent
    report_progress(0.0, "operators")
    if isinstance(mesh, PointCloud):
        points, scale = size_one(mesh.points)
        cloud = PointCloud(points, dim=mesh.dim)
        scalar, connection = robust_laplacian(cloud), connection_laplacian(cloud)
        one, two = sp.triu(scalar.stiffness, 1).nonzero()
        lengths = np.linalg.norm(points[one] - points[two], axis=1)
    else:
        mesh = as_mesh(mesh)
        points, scale = scale_to_unit(mesh.vertices)
        unit = TriangleMesh(points, mesh.faces)
        scalar, connection = cotangent_laplacian(unit), connection_laplacian(unit)
        lengths = edge_lengths(unit)
    time = factor * float(lengths.mean()) ** 2
    # Shares of the time on a sphere of 50,000 vertices.
    report_progress(0.3, "factors for functions")
    scalar_heat = factorize_definite(scalar.mass + time * scalar.stiffness)
    poisson = factorize_grounded(scalar.stiffness)
    report_progress(0.6, "factor for vectors")
    vector_heat = factorize_definite(connection.mass + time * connection.stiffness)
    report_progress(1.0, "prepared")
    length_squared = float(in_length(np.array([time]), scale, 2)[0])
    prepared = (length_squared, scale, poisson.components, scalar_heat, vector_heat, poisson)
    if isinstance(mesh, PointCloud):
        return VectorHeat(*prepared)
    return MeshVectorHeat(*prepared, unit, vertex_directions(unit))


def extend_scalar(
    mesh: MeshLike | PointCloud | VectorHeat, sources: ArrayLike, values: ArrayLike
) -> Float[np.ndarray, " n"]:
    """Extend values at some vertices to all vertices, each taking that of the nearest source.

    The quotient of two heat flows: that of the values, and that of ones at the sources (Sharp,
    Soliman, Crane 2019, section 4). Between sources the result changes smoothly over about an edge
    length, and lies between the least and the largest value on a Delaunay mesh.

    Parameters
    ----------
    mesh : MeshLike, PointCloud or VectorHeat
        `prepare_vector_heat(mesh)` keeps the factors for further calls.
    sources : (k,) int
        Vertices.
    values : (k,) float
        In any unit.

    Returns
    -------
    (n,) float
        In the unit of the values.

    Raises
    ------
    InvalidParameterError
        If there is no source, a source is not a vertex, `values` has another length or is not
        finite, a component has no source, or heat is too small for a float somewhere.
    InvalidShapeError
        As in `prepare_vector_heat`.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> extended = es.calculus.extend_scalar(ball, [0, 3], [1.0, 5.0])
    >>> bool(extended.min() > 0.99 and extended.max() < 5.01)
    True
    """
    solver = as_vector_heat(mesh)
    wanted = require_sources(sources, solver.n_points)
    given = finite_values(values, "values")
    if len(given) != len(wanted):
        raise InvalidParameterError(
            f"values must hold one number per source; there are {len(given)} values and "
            f"{len(wanted)} sources."
        )
    require_source_everywhere(solver, wanted)
    impulses = np.zeros((solver.n_points, 2))
    np.add.at(impulses, wanted, np.column_stack([given, np.ones(len(given))]))
    flowed = solver.scalar_heat.solve(impulses)
    require_heat(flowed[:, 1:])
    return flowed[:, 0] / flowed[:, 1]


def transport_vectors(
    mesh: MeshLike | PointCloud | VectorHeat, sources: ArrayLike, vectors: ArrayLike
) -> Float[np.ndarray, "n 2"]:
    """Transport tangent vectors from some vertices to all, along shortest paths.

    The vector heat method (Sharp, Soliman, Crane 2019): directions flow by the connection
    Laplacian, lengths by `extend_scalar`. From several sources each vertex takes the vector of the
    nearest one, blended over about an edge length.

    Vectors are given by two coordinates in the frame of their vertex, `operators.tangent_frames`:
    x along the first edge of the vertex, y a quarter turn further, counter-clockwise seen from
    outside. The frame depends on the order of faces. In space the vectors are
    ``np.einsum("nk,nkd->nd", vectors, frames)``.

    Parameters
    ----------
    mesh : MeshLike, PointCloud or VectorHeat
        `prepare_vector_heat(mesh)` keeps the factors for further calls.
    sources : (k,) int
        Vertices.
    vectors : (k, 2) float
        Tangent vectors at the sources, in any unit.

    Returns
    -------
    (n, 2) float
        Tangent vector at each vertex, in the unit of `vectors`. Zero where vectors from all sides
        cancel exactly.

    Raises
    ------
    InvalidParameterError
        If there is no source, a source is not a vertex, `vectors` has another shape or is not
        finite, a component has no source, or heat is too small for a float somewhere.
    InvalidShapeError
        As in `prepare_vector_heat`.

    Examples
    --------
    On a plane, transported vectors are parallel:

    >>> import eigenshape as es
    >>> import numpy as np
    >>> square = es.shapes.grid(5, 5)
    >>> field = es.calculus.transport_vectors(square, [14], [[1.0, 0.0]])
    >>> in_space = np.einsum("nk,nkd->nd", field, es.operators.tangent_frames(square))
    >>> bool(np.allclose(in_space, in_space[14]))
    True
    """
    solver = as_vector_heat(mesh)
    wanted = require_sources(sources, solver.n_points)
    rows = real_numbers(vectors, "vectors").astype(np.float64)
    if rows.shape != (len(wanted), 2):
        raise InvalidParameterError(
            f"vectors must hold two coordinates per source, shape ({len(wanted)}, 2); the shape is "
            f"{rows.shape}. Vectors in space have the coordinates tangent_frames(mesh)[i] @ vector."
        )
    require_finite_rows(rows, "vectors", "source")
    given = rows[:, 0] + 1j * rows[:, 1]
    require_source_everywhere(solver, wanted)
    lengths = np.abs(given)
    impulses = np.zeros(solver.n_points, dtype=complex)
    np.add.at(impulses, wanted, given / np.where(lengths > 0, lengths, 1.0))
    if len(wanted) == 1:
        scalar_impulse(solver, int(wanted[0]))  # raises an error where no heat arrives
        lengths = np.full(solver.n_points, lengths[0])
    else:
        lengths = extend_scalar(solver, wanted, lengths)
    found = normalize(diffuse(solver, impulses))
    return as_rows(found * lengths)


def as_vector_heat(mesh: MeshLike | PointCloud | VectorHeat) -> VectorHeat:
    """Prepare a surface with the usual options, unless it is prepared."""
    return mesh if isinstance(mesh, VectorHeat) else prepare_vector_heat(mesh)


def as_mesh_heat(mesh: MeshLike | VectorHeat) -> MeshVectorHeat:
    """Prepare a mesh, unless it is prepared; raise InvalidParameterError if it is a point cloud."""
    solver = as_vector_heat(mesh if isinstance(mesh, VectorHeat) else as_mesh(mesh))
    if not isinstance(solver, MeshVectorHeat):
        raise InvalidParameterError(
            "mesh must have faces; this VectorHeat is that of a point cloud. Use transport_vectors or "
            "extend_scalar."
        )
    return solver


def as_rows(field: Field) -> Float[np.ndarray, "n 2"]:
    """Return complex numbers as vectors of two coordinates."""
    return np.column_stack([field.real, field.imag])


def require_source_everywhere(solver: VectorHeat, sources: Int[np.ndarray, " k"]) -> None:
    """Raise an error if a component has no source: nothing flows there."""
    reached = np.isin(solver.components, solver.components[sources])
    if not reached.all():
        vertex = int(np.argmin(reached))
        raise InvalidParameterError(
            f"Every component must have a source; that of vertex {vertex} has none "
            f"({np.count_nonzero(~reached)} such vertices). Add one there, or pass the component "
            "by itself."
        )


def diffuse(solver: VectorHeat, field: Field) -> Field:
    """Solve (B + tW) x = field for tangent vectors."""
    solution = solver.vector_heat.solve(as_rows(field).reshape(-1, 1))[:, 0]
    return solution[::2] + 1j * solution[1::2]


def normalize(field: Field) -> Field:
    """Return vectors of length 1, and 0 for 0."""
    # Far away vectors are as short as 1e-300, whose squares underflow.
    largest = np.maximum(np.abs(field.real), np.abs(field.imag))
    # The parts are divided by themselves, because complex division forms 1 / largest.
    size = np.where(largest > 0, largest, 1.0)
    field = field.real / size + 1j * (field.imag / size)
    lengths = np.abs(field)
    return field / np.where(lengths > 0, lengths, 1.0)


def side_vectors(solver: MeshVectorHeat) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return of each side: itself as a vector at its tail and at its head; its turn; its weight.

    The turn takes a vector from the tail to the head. Weights are half of one cotangent.
    """
    tails, heads = side_ends(solver.mesh.faces)
    points = solver.mesh.vertices
    lengths = np.linalg.norm(points[heads] - points[tails], axis=1)
    at_tail = lengths * np.exp(1j * solver.directions.at_tail)
    at_head = -lengths * np.exp(1j * solver.directions.at_head)
    turns = np.exp(1j * (solver.directions.at_head + np.pi - solver.directions.at_tail))
    return at_tail, at_head, turns, half_cotangents(solver.mesh)


def scalar_impulse(solver: VectorHeat, start: int) -> Float[np.ndarray, " n"]:
    """Return the heat of one source, which must reach every vertex."""
    impulse = np.zeros((solver.n_points, 1))
    impulse[start] = 1.0
    heat = solver.scalar_heat.solve(impulse)
    require_heat(heat)
    return heat[:, 0]


def edge_sums(solver: MeshVectorHeat, field: Field) -> Complex[np.ndarray, " h"]:
    """Add the vectors at both ends of each side, in the frame of its tail."""
    tails, heads = side_ends(solver.mesh.faces)
    _, _, turns, _ = side_vectors(solver)
    return field[tails] + field[heads] * np.conj(turns)


def integrate_along_edges(
    solver: MeshVectorHeat, vectors: Complex[np.ndarray, " h"]
) -> Float[np.ndarray, " n"]:
    """Return the function whose gradient is nearest to a field, up to a constant per component.

    The field is given on each side, in the frame of its tail. Its divergence at a vertex is the
    flux through the dual edges around it.
    """
    tails, heads = side_ends(solver.mesh.faces)
    at_tail, _, _, weights = side_vectors(solver)
    flux = weights * (np.conj(vectors) * at_tail).real
    divergence = np.bincount(heads, flux, minlength=solver.n_points)
    divergence -= np.bincount(tails, flux, minlength=solver.n_points)
    return solver.poisson.solve(divergence[:, None])[:, 0]
