"""Comparison of the spectra of two shapes: what changes, by how much, and which changes are proved."""

import numpy as np
from jaxtyping import Bool, Float

from certeig.kit.arguments import require_each
from certeig.kit.arrays import ReadOnly, finite_values, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.requirements import require_describable
from eigenshape.operators.cotangent import surface_laplacian
from eigenshape.spectral.bounds.brackets import Brackets
from eigenshape.spectral.requirements import require_lowest
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import NULL, Spectrum


@record
class SpectrumComparison(ReadOnly):
    """The k lowest eigenvalues of two shapes, compared by number.

    Attributes
    ----------
    one, two : (k,) float
        Eigenvalues, ascending, in 1/length².
    intervals_one, intervals_two : (k, 2) float
        Intervals that contain the exact eigenvalues: those of the operator, by the residuals, or
        those of the shape, by brackets.
    relative : (k,) float
        |two - one| / one; 0 if both are 0 to rounding, infinite if one of them is.
    zero : (k,) bool
        Whether both are 0 to rounding.
    bracketed : bool
        Whether the intervals are brackets.

    See Also
    --------
    es.spectral.compare_spectra : Compare two spectra.

    Examples
    --------
    At twice the size, positive eigenvalues are a quarter:

    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> large = es.TriangleMesh(2 * ball.vertices, ball.faces)
    >>> one, two = (es.solve_spectrum(es.cotangent_laplacian(mesh), 4) for mesh in (ball, large))
    >>> es.spectral.compare_spectra(one, two).relative.round(6)
    array([0.  , 0.75, 0.75, 0.75])
    """

    one: Float[np.ndarray, " k"]
    two: Float[np.ndarray, " k"]
    intervals_one: Float[np.ndarray, "k 2"]
    intervals_two: Float[np.ndarray, "k 2"]
    relative: Float[np.ndarray, " k"]
    zero: Bool[np.ndarray, " k"]
    bracketed: bool

    @property
    def proved_changes(self) -> Bool[np.ndarray, " k"]:
        """Mask (k,) of the changes that are proved: the two intervals do not overlap."""
        (low_one, high_one), (low_two, high_two) = self.intervals_one.T, self.intervals_two.T
        return (high_one < low_two) | (high_two < low_one)

    @property
    def index_distance(self) -> float:
        """Largest |λ_i - ω_i|, in 1/length² (thesis, theorem 3.1.5)."""
        return float(np.abs(self.one - self.two).max())

    @property
    def hausdorff(self) -> float:
        """Hausdorff distance of the two sets, as far as they are known, in 1/length² (thesis, theorem 3.1.4)."""
        return spectral_hausdorff_distance(self.one, self.two)

    @property
    def mean_relative(self) -> float:
        """Mean relative change of the eigenvalues that are not 0 in both; 0 where there is none."""
        return float(self._changes().mean())

    @property
    def median_relative(self) -> float:
        """Median relative change of the eigenvalues that are not 0 in both; 0 where there is none."""
        return float(np.median(self._changes()))

    def _changes(self) -> Float[np.ndarray, " j"]:
        return np.zeros(1) if self.zero.all() else self.relative[~self.zero]

    def explain(self) -> str:
        """Return a text that says how far apart the spectra are, and which changes are proved."""
        k, n_proved = len(self.one), int(self.proved_changes.sum())
        worst = int(np.abs(self.one - self.two).argmax())
        bars = "brackets of the shapes'" if self.bracketed else "error bars of the operators'"
        return (
            f"Of the {k} lowest eigenvalues, number {worst} changes most, from {self.one[worst]:.6g} to "
            f"{self.two[worst]:.6g} (1/length²). They change by {self.median_relative:.3g} of themselves in the median "
            f"and {self.mean_relative:.3g} in the mean, and the sets are {self.hausdorff:.3g} apart (Hausdorff). "
            f"{n_proved} of the {k} changes are proved: the {bars} eigenvalues do not overlap."
        )


def compare_spectra(
    one: Spectrum, two: Spectrum, *, brackets: tuple[Brackets, Brackets] | None = None
) -> SpectrumComparison:
    """Compare the lowest eigenvalues of two shapes, as many as both have (thesis 3.1, 3.4).

    Parameters
    ----------
    one, two : Spectrum
        From the lowest eigenvalue on. To ignore size, scale both shapes to the same area.
    brackets : (Brackets, Brackets), optional
        Brackets of the two shapes. Changes are then proved for the shapes, not only for the
        operators.

    Returns
    -------
    SpectrumComparison

    Raises
    ------
    InvalidParameterError
        If a spectrum does not begin with the lowest eigenvalue, or there are fewer brackets than
        eigenvalues.

    Examples
    --------
    >>> import eigenshape as es
    >>> one, two = (
    ...     es.solve_spectrum(es.cotangent_laplacian(mesh), 4)
    ...     for mesh in (es.icosphere(2), es.TriangleMesh(2 * es.icosphere(2).vertices, es.icosphere(2).faces))
    ... )
    >>> found = es.spectral.compare_spectra(one, two)
    >>> found.relative.round(6).tolist()  # a quarter, as 1/length²
    [0.0, 0.75, 0.75, 0.75]
    >>> found.proved_changes.tolist()
    [False, True, True, True]
    """
    require_lowest(one, "one")
    require_lowest(two, "two")
    k = min(len(one.eigenvalues), len(two.eigenvalues))
    if brackets is not None:
        require_each(brackets, Brackets, "brackets")
    first, second = (
        known_eigenvalues(spectrum, name, given, k)
        for spectrum, name, given in zip(
            (one, two), ("one", "two"), (None, None) if brackets is None else brackets, strict=True
        )
    )
    return SpectrumComparison(
        one=first.values,
        two=second.values,
        intervals_one=first.intervals,
        intervals_two=second.intervals,
        relative=first.change_to(second),
        zero=first.zero & second.zero,
        bracketed=first.bracketed,
    )


@record
class KnownEigenvalues:
    """The lowest eigenvalues of one shape, and what is known of them.

    Attributes
    ----------
    values : (k,) float
    zero : (k,) bool
        Whether each is 0 to rounding.
    intervals : (k, 2) or (0, 2) float
        Intervals that contain the exact eigenvalues; none where they are not known.
    bracketed : bool
        Whether the intervals are brackets.
    """

    values: Float[np.ndarray, " k"]
    zero: Bool[np.ndarray, " k"]
    intervals: Float[np.ndarray, "_ 2"]
    bracketed: bool

    def change_to(self, other: "KnownEigenvalues") -> Float[np.ndarray, " j"]:
        """Return |two - one| / one as far as both are known: of two zeros 0, of one alone infinite."""
        k = min(len(self.values), len(other.values))
        zeros = self.zero[:k], other.zero[:k]
        either, both = zeros[0] | zeros[1], zeros[0] & zeros[1]
        one, two = self.values[:k], other.values[:k]
        change = np.abs(two - one) / np.where(either, 1.0, one)
        return np.where(either, np.where(both, 0.0, np.inf), change)


def known_eigenvalues(
    spectrum: Spectrum | ArrayLike,
    name: str,
    brackets: Brackets | None,
    k: int | None = None,
) -> KnownEigenvalues:
    """Return what is known of the lowest k eigenvalues: by residuals of a spectrum, or by brackets.

    Raises an InvalidParameterError if the spectrum does not begin with the lowest, a value is not
    finite, or there are fewer brackets than eigenvalues.
    """
    intervals = np.empty((0, 2))
    if isinstance(spectrum, Spectrum):
        require_lowest(spectrum, name)
        values, residuals = spectrum.eigenvalues[:k], spectrum.residuals[:k]
        # From 0 on where a value is 0 to rounding
        lower = np.where(count_as_zero(values), 0.0, np.maximum(values - residuals, 0.0))
        intervals, zero = np.column_stack([lower, values + residuals]), lower <= 0
    else:
        values = finite_values(spectrum, name)
        zero = count_as_zero(values)
    if brackets is not None:
        n = len(values)
        if len(brackets.upper) < n:
            raise InvalidParameterError(
                f"There must be a bracket for each eigenvalue that is compared; there are {n} eigenvalues, and "
                f"{len(brackets.upper)} brackets of {name}."
            )
        intervals = np.column_stack([brackets.lower[:n], brackets.upper[:n]])
    return KnownEigenvalues(values, zero, intervals, brackets is not None)


def count_as_zero(values: Float[np.ndarray, " k"]) -> Bool[np.ndarray, " k"]:
    """Return which of these eigenvalues are 0 beside the last."""
    return values <= NULL * values[-1]


def spectral_hausdorff_distance(one: ArrayLike, two: ArrayLike) -> float:
    """Compute the Hausdorff distance of two sets of eigenvalues (thesis, theorem 3.1.4).

    max(max_λ dist(λ, Ω), max_ω dist(ω, Λ)), restricted to what two truncated spectra determine. An
    eigenvalue above the last known one of the other set is left out, because its nearest neighbor
    may be unknown. For all others the distance is exact: unknown eigenvalues of the other set are
    at or above its last known one, and so no nearer than that. Raises an error
    if a value is not finite, or a set is empty.
    """
    first, second = np.sort(finite_values(one, "one")), np.sort(finite_values(two, "two"))
    return max(_farthest(first, second), _farthest(second, first))


def _farthest(values: Float[np.ndarray, " k"], others: Float[np.ndarray, " j"]) -> float:
    known = values[values <= others[-1]]
    above = np.searchsorted(others, known)
    below = np.maximum(above - 1, 0)
    distances = np.minimum(np.abs(others[above] - known), np.abs(known - others[below]))
    return float(distances.max(initial=0.0))


# Eigenvalues; 10 to 50 found no more on the tuning half of experiments/ch5_retrieval.
N_VALUES = 20


def shape_dna(mesh: MeshLike, n_values: Integer | None = None) -> Float[np.ndarray, " k"]:
    """Describe a shape by the lowest eigenvalues of its cotangent Laplacian, without the first.

    Entry i is A λ_i / i, with A the area, so that the size of the shape does not matter. Of the
    normalizations in the paper this one keeps the first eigenvalue as a number of its own; a
    division by it would spread its error over all others. The division by the rank i is the
    authors' later advice: by Weyl's law A λ_i / i tends to 4π, and without it the highest, least
    certain eigenvalues would dominate the Euclidean distance, by which shapes are compared.

    Here i counts from 1 at the first eigenvalue above 0. LaPy's `reweight_ev` counts from 1 at the
    first of its list, which `compute_shapedna` begins with the eigenvalue 0, so it divides this λ_i
    by i + 1. Its entries are i / (i + 1) of these: half of the first one.

    Parameters
    ----------
    mesh : MeshLike
        Closed or open, with n vertices and any number of components; a boundary is free.
    n_values : int, optional
        1 to n - 1; by default 20, or n - 1 if that is less.

    Returns
    -------
    (n_values,) float
        Without unit.

    Raises
    ------
    InvalidShapeError
        If a face has no area or occurs twice, a vertex has no face, or the mesh is a soup (faces
        lie edge on edge without sharing vertices).
    InvalidParameterError
        If `n_values` is out of range.

    See Also
    --------
    compare_spectra : All eigenvalues of two spectra, side by side.

    References
    ----------
    M. Reuter, F.-E. Wolter, N. Peinecke: Laplace-Beltrami spectra as "Shape-DNA" of surfaces and
    solids. Computer-Aided Design 38, 2006.

    Examples
    --------
    The unit sphere has area 4π and eigenvalues 2, 2, 2, 6, ...

    >>> import eigenshape as es
    >>> es.spectral.shape_dna(es.icosphere(4), n_values=3).round(0)
    array([25., 13.,  8.])
    """
    mesh = as_mesh(mesh)
    most = mesh.n_vertices - 1
    count = min(N_VALUES, most) if n_values is None else whole_number(n_values, "n_values", 1, most)
    require_describable(mesh)
    laplacian = surface_laplacian(mesh)
    values = solve_spectrum(laplacian, count + 1).eigenvalues[1:]
    return values * float(laplacian.mass.sum()) / np.arange(1, count + 1)
