"""Maps between shapes, as matrices that take functions on one to functions on the other, in low modes."""

from dataclasses import dataclass
from typing import SupportsIndex

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import as_array, frozen, real_numbers, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.spectral.signatures.heat import NULL
from eigenshape.spectral.spectrum import Spectrum

N_MODES = 20
COMMUTING = 0.1  # weight of commuting with the Laplacians against the pairs
LOST = 1e-3  # share of the constant function that the first mode may lack: approximate spectra lack some


@dataclass(frozen=True, eq=False)
class FunctionalMap:
    """A map between shapes, by what it does to functions (Ovsjanikov and others 2012).

    Functions are told by coefficients in φ_i √A, orthonormal in B/A with A the shape's area, so that size drops out:
    the matrix between a shape and a copy of any size is the identity, and constants stay what they are.

    Attributes
    ----------
    matrix : (k2, k1) float
        Takes coefficients on the source, in its k1 lowest modes, to those on the target, in its k2 lowest.
    source, target : Spectrum
        Of connected shapes without fixed boundary, from the lowest eigenvalue on.

    Raises
    ------
    InvalidParameterError
        If the matrix is not finite or has more rows or columns than there are modes, or a spectrum does not begin with
        one constant function.
    """

    matrix: Float[np.ndarray, "k2 k1"]
    source: Spectrum
    target: Spectrum

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
        object.__setattr__(self, "matrix", frozen(self.matrix))


def require_one_constant(spectrum: Spectrum, name: str) -> None:
    """Refuse a spectrum whose first mode is not constant, or not alone with the eigenvalue 0.

    Raises
    ------
    InvalidParameterError
        For parts of a spectrum, fixed boundaries, disconnected shapes, and fewer than two modes.
    """
    if len(spectrum.eigenvalues) < 2:
        raise InvalidParameterError(
            f"A map needs at least 2 modes of each shape; the {name} has 1. Solve for more."
        )
    if spectrum.eigenvalues[1] <= NULL * spectrum.eigenvalues[-1]:
        raise InvalidParameterError(
            f"Maps are between connected shapes; the {name} has eigenvalues {spectrum.eigenvalues[0]:.3g} and "
            f"{spectrum.eigenvalues[1]:.3g}, which are 0: it has two components or more. Keep its largest_component."
        )
    areas = point_areas(spectrum)
    lost = 1 - (spectrum.eigenvectors[:, 0] @ areas) ** 2 / areas.sum()
    if lost > LOST:
        raise InvalidParameterError(
            f"The first mode of a shape to be mapped must be constant; that of the {name} has {100 * (1 - lost):.3g} % "
            f"of the constant function. Solve from the lowest eigenvalue on, with no boundary fixed."
        )


def modes_of_both(source: Spectrum, target: Spectrum, n_modes: SupportsIndex) -> int:
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
    source: Spectrum, target: Spectrum, pairs: ArrayLike, *, n_modes: SupportsIndex = N_MODES
) -> FunctionalMap:
    """Find the map that takes points to their partners and commutes with the Laplacians as far as it can.

    Minimises Σ_p w_p |C a_p - b_p|² + μ Σ_ij (λ'_i - λ_j)² C_ij² row by row, with a_p and b_p the coefficients of unit
    masses at the points of pair p, w_p = 1/(|a_p| |b_p|), λ × area for λ, and constants kept (Ovsjanikov and others
    2012, 4). Few pairs do: the penalty holds what they leave open. Measured on nine pairs of poses of a horse, a cat
    and a lion (5,000 to 8,400 vertices, six pairs by hand), waves spread from the points instead of unit masses are no
    better, and heat is worse.

    The map is as good as nearly isometric shapes let it be; parts of shapes are out of its scope. Where all pairs are
    mirrored, as those of `match_patches` may be, so is the map.

    Parameters
    ----------
    source, target : Spectrum
        Of connected shapes, of any sizes; λ × area is without unit on surfaces.
    pairs : (p, 2) int
        A vertex of the source and its partner on the target; at least one pair, more where the shape is symmetric.
    n_modes : int
        Modes of each shape. 10 forgive pairs that are off, such as those of `match_patches`; 20 serve exact ones.
        `refine_map` takes it from there.

    Returns
    -------
    FunctionalMap

    Raises
    ------
    InvalidParameterError
        If there is no pair, one names no vertex, a spectrum has too few modes or does not begin with one constant
        function.
    """
    require_type(source, Spectrum, "source")
    require_type(target, Spectrum, "target")
    k = modes_of_both(source, target, n_modes)
    ends = _checked_pairs(pairs, len(source.eigenvectors), len(target.eigenvectors))
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


def _checked_pairs(pairs: ArrayLike, n_source: int, n_target: int) -> Int[np.ndarray, "p 2"]:
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
    """Carry functions from the source to the target: project on its modes, map, and expand in the target's.

    Parameters
    ----------
    mapping : FunctionalMap
    values : (n1,) or (n1, q) float
        On the source, in any unit. What its k1 modes do not hold is lost.

    Returns
    -------
    (n2,) or (n2, q) float
        On the target, in the same unit; constants stay what they are.

    Raises
    ------
    InvalidParameterError
        If there is not one finite row a vertex of the source.
    """
    require_type(mapping, FunctionalMap, "mapping")
    functions, n = (
        real_numbers(values, "Functions to be carried").astype(np.float64),
        len(mapping.source.eigenvectors),
    )
    if functions.ndim not in (1, 2) or len(functions) != n:
        raise InvalidParameterError(
            f"Functions to be carried must have {n} rows; the shape is {functions.shape}."
        )
    bad = np.flatnonzero(~np.isfinite(functions.reshape(n, -1)).all(axis=1))
    if bad.size:
        raise InvalidParameterError(
            f"Functions to be carried must be finite; row {bad[0]} is {functions[bad[0]]}."
        )
    k2, k1 = mapping.matrix.shape
    weighed = mapping.source.mass @ functions / point_areas(mapping.source).sum()
    coefficients = mapping.matrix @ (unit_modes(mapping.source, k1).T @ weighed)
    return np.asarray(unit_modes(mapping.target, k2) @ coefficients)


@one_blas_thread()
def compose_maps(first: FunctionalMap, second: FunctionalMap) -> FunctionalMap:
    """Carry by one map, then by another, in the modes that both have of the shape between.

    Parameters
    ----------
    first, second : FunctionalMap
        The target of the first is the source of the second.

    Returns
    -------
    FunctionalMap

    Raises
    ------
    InvalidParameterError
        If the shape between is not one and the same.
    """
    require_type(first, FunctionalMap, "first")
    require_type(second, FunctionalMap, "second")
    k = min(first.matrix.shape[0], second.matrix.shape[1])
    one, other = (spectrum.eigenvectors[:, :k] for spectrum in (first.target, second.source))
    if not np.array_equal(one, other):
        raise InvalidParameterError(
            f"Maps compose where the second begins at the shape at which the first ends; their modes there differ, of "
            f"{len(one)} and {len(other)} points."
        )
    return FunctionalMap(second.matrix[:, :k] @ first.matrix[:k], first.source, second.target)
