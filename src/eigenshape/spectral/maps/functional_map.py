"""Functional maps: maps between shapes as small matrices that act on functions in low modes."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import ReadOnly, as_array, freeze, real_numbers, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._text import html_repr, short_repr
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike, Integer
from eigenshape.spectral.spectrum import Spectrum, count_zero_modes

N_MODES = 20  # of each shape by default, for exact pairs; inexact ones need fewer
# Weight of the commutativity penalty relative to the pairs. A larger weight draws the map towards
# the identity of the spectra, a smaller one lets a few pairs determine many entries.
COMMUTING = 0.1
# Share of the constant function that the first mode may lack. The eigenvectors of the approximate
# solver lack some of it; with a fixed boundary or in an interval most of it is missing.
LOST = 1e-3


@dataclass(frozen=True, eq=False)
class FunctionalMap(ReadOnly):
    """A map between shapes, given by its action on functions (Ovsjanikov and others 2012).

    Functions are represented by coefficients in φ_i √A, orthonormal in B/A with A the area of the
    shape, so that size drops out: the matrix between a shape and a scaled copy is the identity, and
    constant functions are preserved.

    Attributes
    ----------
    matrix : (k2, k1) float
        Maps coefficients in the k1 lowest modes of the source to coefficients in the k2 lowest
        modes of the target.
    source, target : Spectrum
        Of connected shapes without fixed boundary, from the lowest eigenvalue on.

    Raises
    ------
    InvalidParameterError
        If the matrix is not finite or has more rows or columns than there are modes, or a spectrum
        does not begin with one constant function.

    See Also
    --------
    functional_map : Compute a map from pairs of points.

    Examples
    --------
    The identity of a shape:

    >>> import eigenshape as es
    >>> from numpy import eye
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.shapes.torus(24, 12)), 8)
    >>> mapping = es.spectral.FunctionalMap(eye(5), spectrum, spectrum)
    >>> es.spectral.point_map(mapping).shape
    (288,)
    """

    matrix: Float[np.ndarray, "k2 k1"]
    source: Spectrum
    target: Spectrum

    __repr__ = short_repr
    _repr_html_ = html_repr

    def __post_init__(self) -> None:
        require_one_constant(self.source, "source")
        require_one_constant(self.target, "target")
        most = len(self.target.eigenvalues), len(self.source.eigenvalues)
        if self.matrix.ndim != 2 or not all(
            1 <= k <= n for k, n in zip(self.matrix.shape, most, strict=True)
        ):
            raise InvalidParameterError(
                f"A functional map must have a row for each mode of the target and a column for each of the source, at "
                f"most {most}; its shape is {self.matrix.shape}."
            )
        bad = np.argwhere(~np.isfinite(self.matrix))
        if len(bad):
            raise InvalidParameterError(
                f"The matrix of a map must be finite; entry {bad[0].tolist()} is not."
            )
        object.__setattr__(self, "matrix", freeze(self.matrix))


def require_one_constant(spectrum: Spectrum, name: str) -> None:
    """Raise an error unless the first mode of a spectrum is constant and the only one of eigenvalue 0.

    Raises
    ------
    InvalidParameterError
        For intervals of a spectrum, fixed boundaries, disconnected shapes, and fewer than two
        modes.
    """
    if len(spectrum.eigenvalues) < 2:
        raise InvalidParameterError(
            f"A map needs at least 2 modes of each shape; the {name} has 1. Solve for more."
        )
    if count_zero_modes(spectrum) > 1:
        raise InvalidParameterError(
            f"Shapes to be mapped must be connected; the {name} has the eigenvalues {spectrum.eigenvalues[0]:.3g} and "
            f"{spectrum.eigenvalues[1]:.3g}, which count as 0, so it has several components. "
            f"Use es.geometry.largest_component."
        )
    areas = point_areas(spectrum)
    lost = 1 - (spectrum.eigenvectors[:, 0] @ areas) ** 2 / areas.sum()
    if lost > LOST:
        raise InvalidParameterError(
            f"The first mode of a shape to be mapped must be constant; that of the {name} holds "
            f"{100 * (1 - lost):.3g} % of the constant function. "
            f"Solve from the lowest eigenvalue on, with no boundary fixed."
        )


def modes_of_both(source: Spectrum, target: Spectrum, n_modes: Integer) -> int:
    """Return a number of modes that both shapes have.

    Raises
    ------
    InvalidParameterError
        If one has fewer, or its spectrum does not begin with one constant function.
    """
    for spectrum, name in ((source, "source"), (target, "target")):
        require_one_constant(spectrum, name)
    return whole_number(
        n_modes, "n_modes", 2, min(len(source.eigenvalues), len(target.eigenvalues))
    )


def point_areas(spectrum: Spectrum) -> Float[np.ndarray, " n"]:
    """Return the area around each point, the row sums of B."""
    return np.asarray(spectrum.mass.sum(axis=1)).ravel()


def unit_modes(spectrum: Spectrum, k: int) -> Float[np.ndarray, "n k"]:
    """Return the k lowest modes of the shape scaled to area 1: φ_i √A."""
    return spectrum.eigenvectors[:, :k] * np.sqrt(point_areas(spectrum).sum())


@one_blas_thread()
def functional_map(
    source: Spectrum, target: Spectrum, pairs: ArrayLike, *, n_modes: Integer = N_MODES
) -> FunctionalMap:
    """Compute a functional map between two shapes from a few pairs of corresponding points.

    Minimizes Σ_p w_p |C a_p - b_p|² + μ Σ_ij (λ'_i - λ_j)² C_ij² over maps C that keep constants,
    with a_p and b_p the coefficients of unit masses at the points of pair p, w_p = 1/(|a_p| |b_p|),
    and λ × area for λ (Ovsjanikov and others 2012, section 4). A few pairs are enough: the
    commutativity penalty determines the rest. In a comparison on nine pairs of poses of a horse, a
    cat and a lion (5,000 to 8,400 vertices, six pairs chosen by hand), wave functions at the points
    instead of unit masses were no better, and heat was worse.

    The shapes should be nearly isometric; maps of parts of shapes are not supported. If all pairs
    are mirrored, as those of `es.retrieval.match_patches` may be, the map is mirrored too.

    Parameters
    ----------
    source, target : Spectrum
        Of connected shapes of any size.
    pairs : (p, 2) int
        A vertex of the source and the corresponding vertex of the target in each row; at least one
        pair, and more if the shape is symmetric.
    n_modes : int
        Number of modes of each shape. Use 10 for inexact pairs, such as those of `match_patches`,
        and 20 for exact ones. `refine_map` extends the map to more modes.

    Returns
    -------
    FunctionalMap

    Raises
    ------
    InvalidParameterError
        If there is no pair, a pair names no vertex, or a spectrum has too few modes or does not
        begin with one constant function.

    See Also
    --------
    es.spectral.refine_map : Extend a map to more modes.
    es.spectral.point_map : Convert a map to corresponding vertices.
    es.spectral.transfer_function : Transfer functions by a map.

    Examples
    --------
    A shape and a larger copy of it, with three pairs:

    >>> import eigenshape as es
    >>> mesh = es.make_creature("quadruped", n_vertices=500)
    >>> copy = es.TriangleMesh(3 * mesh.vertices, mesh.faces)
    >>> source, target = (es.solve_spectrum(es.cotangent_laplacian(m), 20) for m in (mesh, copy))
    >>> pairs = [[0, 0], [100, 100], [200, 200]]
    >>> mapping = es.functional_map(source, target, pairs, n_modes=8)
    >>> mapping.matrix.shape
    (8, 8)
    >>> refined = es.spectral.refine_map(mapping, 20)
    >>> partners = es.spectral.point_map(refined)
    >>> bool((partners == range(len(mesh.vertices))).mean() > 0.9)
    True
    """
    require_type(source, Spectrum, "source")
    require_type(target, Spectrum, "target")
    k = modes_of_both(source, target, n_modes)
    ends = _as_pairs(pairs, len(source.eigenvectors), len(target.eigenvectors))
    ours, theirs = unit_modes(source, k)[ends[:, 0]], unit_modes(target, k)[ends[:, 1]]
    weights = (np.linalg.norm(ours, axis=1) * np.linalg.norm(theirs, axis=1))[:, None] ** -0.5
    return FunctionalMap(
        _least_squares(weights * ours, weights * theirs, _commutators(source, target, k)),
        source,
        target,
    )


def _commutators(source: Spectrum, target: Spectrum, k: int) -> Float[np.ndarray, "k k"]:
    """Return λ'_i - λ_j, relative to the largest eigenvalue."""
    ours, theirs = (
        spectrum.eigenvalues[:k] * point_areas(spectrum).sum() for spectrum in (source, target)
    )
    return (theirs[:, None] - ours) / max(ours[-1], theirs[-1])


def _least_squares(
    ours: Float[np.ndarray, "p k"],
    theirs: Float[np.ndarray, "p k"],
    commutators: Float[np.ndarray, "k k"],
) -> Float[np.ndarray, "k k"]:
    """Solve for each row of the map with its first column that of the identity."""
    matrix = np.eye(len(commutators))
    scale = np.sqrt(COMMUTING * np.sum(ours**2) / len(commutators))
    for i, row in enumerate(commutators):
        wanted = theirs[:, i] - matrix[i, 0] * ours[:, 0]
        system = np.concatenate([ours[:, 1:], scale * np.diag(row[1:])])
        matrix[i, 1:] = sl.lstsq(system, np.concatenate([wanted, np.zeros(len(row) - 1)]))[0]
    return matrix


def _as_pairs(pairs: ArrayLike, n_source: int, n_target: int) -> Int[np.ndarray, "p 2"]:
    rows = as_array(pairs, "pairs")
    if rows.ndim != 2 or rows.shape[1] != 2 or not len(rows) or rows.dtype.kind not in "iu":
        raise InvalidParameterError(
            f"pairs must be whole numbers in shape (p, 2), at least one row; the shape is {rows.shape} and the type "
            f"{rows.dtype}."
        )
    bad = np.flatnonzero(((rows < 0) | (rows >= [n_source, n_target])).any(axis=1))
    if bad.size:
        raise InvalidParameterError(
            f"pairs must name vertices 0..{n_source - 1} of the source and 0..{n_target - 1} of the target; pair "
            f"{bad[0]} is {rows[bad[0]].tolist()}."
        )
    return rows.astype(np.int64)


@one_blas_thread()
def transfer_function(mapping: FunctionalMap, values: ArrayLike) -> Float[np.ndarray, "n2 ..."]:
    """Transfer functions from the source of a functional map to its target.

    The function is projected on the modes of the source, mapped, and expanded in those of the
    target.

    Parameters
    ----------
    mapping : FunctionalMap
    values : (n1,) or (n1, q) float
        Functions on the source, in any unit. Components outside its k1 modes are lost.

    Returns
    -------
    (n2,) or (n2, q) float
        Functions on the target, in the same unit. Constant functions are preserved.

    Raises
    ------
    InvalidParameterError
        If `values` does not have one finite row for each vertex of the source.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.torus(24, 12)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 8)
    >>> identity = es.functional_map(spectrum, spectrum, [[0, 0], [50, 50]], n_modes=6)
    >>> smooth = es.spectral.transfer_function(identity, mesh.vertices)
    >>> smooth.shape
    (288, 3)
    """
    require_type(mapping, FunctionalMap, "mapping")
    functions = real_numbers(values, "values").astype(np.float64)
    n = len(mapping.source.eigenvectors)
    if functions.ndim not in (1, 2) or len(functions) != n:
        raise InvalidParameterError(
            f"values must have one row for each of {n} vertices of the source; the shape is {functions.shape}."
        )
    bad = np.flatnonzero(~np.isfinite(functions.reshape(n, -1)).all(axis=1))
    if bad.size:
        raise InvalidParameterError(f"values must be finite; row {bad[0]} is {functions[bad[0]]}.")
    k2, k1 = mapping.matrix.shape
    weighed = mapping.source.mass @ functions / point_areas(mapping.source).sum()
    coefficients = mapping.matrix @ (unit_modes(mapping.source, k1).T @ weighed)
    return np.asarray(unit_modes(mapping.target, k2) @ coefficients)


@one_blas_thread()
def compose_maps(first: FunctionalMap, second: FunctionalMap) -> FunctionalMap:
    """Compose two functional maps, in the modes that both have of the shape between them.

    Parameters
    ----------
    first, second : FunctionalMap
        The target of `first` must be the source of `second`.

    Returns
    -------
    FunctionalMap
        From the source of `first` to the target of `second`.

    Raises
    ------
    InvalidParameterError
        If the target of `first` differs from the source of `second`.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.shapes.torus(24, 12)), 8)
    >>> one = es.functional_map(spectrum, spectrum, [[0, 0], [50, 50]], n_modes=6)
    >>> es.spectral.compose_maps(one, one).matrix.shape
    (6, 6)
    """
    require_type(first, FunctionalMap, "first")
    require_type(second, FunctionalMap, "second")
    k = min(first.matrix.shape[0], second.matrix.shape[1])
    one, other = (spectrum.eigenvectors[:, :k] for spectrum in (first.target, second.source))
    if not np.array_equal(one, other):
        raise InvalidParameterError(
            f"The target of the first map must be the source of the second; their modes differ, on {len(one)} and "
            f"{len(other)} points."
        )
    return FunctionalMap(second.matrix[:, :k] @ first.matrix[:k], first.source, second.target)
