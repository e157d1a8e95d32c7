"""The operator scaled to its own units, so that solvers are independent of the user's."""

from dataclasses import replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.sparse.csgraph import connected_components

from certeig.advice import Advice
from certeig.certificate import Certificate
from certeig.kit.arrays import EPS, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import map_in_threads
from certeig.solver.residual_loops import add_sums
from certeig.sparse.basis import sparse_rows
from certeig.sparse.elimination import Elimination, analyze_pattern
from certeig.sparse.symmetric_factor import FactorMemory, SymmetricFactor, factor_memory

# Columns that are processed together: enough for fast products, with little memory.
COLUMNS_AT_ONCE = 64
# Largest ratio of two diagonal entries: squares of vectors must not overflow.
WIDEST_RANGE = 1e140
# If trace W / trace B exceeds the median of W_ii/B_ii by this factor, the median is the pencil's
# level: a few points must not set the unit of all tolerances.
LARGEST_LEVEL_RATIO = 1e11
# What an entry of the pattern of a shift belongs to, as bits of a code.
DIAGONAL, IN_STIFFNESS, IN_MASS = 1, 2, 4
ADVICE = Advice()


@record
class ShiftPattern:
    """W and B in the union of their patterns, ready to factor W - σB for any σ.

    Attributes
    ----------
    elimination : Elimination
        Symbolic analysis of the union of both patterns.
    stiffness, mass : (e,) float
        The entries of W and B in this pattern, with zeros.
    diagonal : (n,) int
        The places of the diagonal entries.
    memory : FactorMemory
        For the factors of all shifts.
    """

    elimination: Elimination
    stiffness: Float[np.ndarray, " e"]
    mass: Float[np.ndarray, " e"]
    diagonal: Int[np.ndarray, " n"]
    memory: FactorMemory


@record
class Pencil:
    """The problem W φ = λ B φ, scaled by powers of two, which change no digit.

    Attributes
    ----------
    stiffness, mass : (n, n) sparse
        W and B with largest diagonal entries between 1 and 4.
    mass_diagonal : (n,) float
        D, the diagonal of `mass`.
    mass_floor : float
        A proven c in (0, 1] with B ≥ c D as quadratic forms; 1 where B is diagonal.
    labels : (n,) int
        The connected part of W and B that each point belongs to, numbered by their first points.
    level : float
        trace W / trace B: about the mean of the eigenvalues, and the unit of every tolerance. For
        several parts it is the harmonic mean, since small parts have few of the low eigenvalues. If
        a few points make it far larger than the median of W_ii/B_ii, it is that median.
    value_exponent, vector_exponent : int
        Eigenvalues are 2**value_exponent times larger in the user's units, and vectors
        2**vector_exponent times.
    origin : float
        What is added to eigenvalues then: the solver works from zero upward, so W is W - origin·B
        of the user where that has eigenvalues below zero or far above it.
    saturation : float
        s of an operator whose eigenvalues are about level (1 - e^{-sx}) where others have level·x,
        as those of Gaussian kernels are; 0 for others.
    advice : Advice
        What messages say.
    """

    stiffness: sp.csc_array
    mass: sp.csc_array
    mass_diagonal: Float[np.ndarray, " n"]
    mass_floor: float
    labels: Int[np.ndarray, " n"]
    level: float
    value_exponent: int
    vector_exponent: int
    origin: float = 0.0
    saturation: float = 0.0
    advice: Advice = ADVICE

    @classmethod
    def scaled(
        cls,
        stiffness: sp.sparray,
        mass: sp.sparray,
        *,
        known_floor: float = 0.0,
        saturation: float = 0.0,
        origin: float = 0.0,
        advice: Advice = ADVICE,
    ) -> "Pencil":
        """Scale W and B by powers of two, and find a lower bound of B.

        `known_floor` is a c with B ≥ c diag(B) that is known from how B was made, or 0. `origin` is the
        value by which the user's eigenvalues are larger than those of W and B.

        Raises an InvalidParameterError if B is not positive definite, or entries on a diagonal lie too
        far apart for floats.
        """
        _require_range(advice.stiffness, stiffness.diagonal())
        _require_range(advice.mass, mass.diagonal())
        pencil = _pencil(stiffness, mass, known_floor=known_floor, advice=advice)
        return replace(pencil, saturation=saturation, origin=origin)

    @classmethod
    def unscaled(cls, stiffness: sp.sparray, mass: sp.sparray, advice: Advice) -> "Pencil":
        """Make a pencil without scaling, for entries that are already of moderate size.

        Raises an InvalidParameterError if B is not positive definite.
        """
        return _pencil(stiffness, mass, scaled=False, advice=advice)

    @property
    def n(self) -> int:
        """Number of points."""
        return len(self.mass_diagonal)

    @cached_property
    def shift_pattern(self) -> ShiftPattern:
        """W and B in one pattern, analyzed once for the factors at all shifts."""
        return _shift_pattern(self.stiffness, self.mass)

    def weigh(self, vectors: Float[np.ndarray, "n b"]) -> Float[np.ndarray, "n b"]:
        """Multiply by B."""
        if self.mass_floor == 1.0:
            return self.mass_diagonal[:, None] * vectors
        return self.mass @ vectors

    def values_out(self, values: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Return differences of eigenvalues in the user's units."""
        return np.ldexp(values, self.value_exponent)

    def place_out(self, value: float) -> float:
        """Return an eigenvalue in the user's units, from the user's zero."""
        return float(np.ldexp(value, self.value_exponent)) + self.origin

    def places_out(self, values: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Return eigenvalues in the user's units, from the user's zero."""
        return np.ldexp(values, self.value_exponent) + self.origin

    def places_in(self, values: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Return eigenvalues, given as the user has them, in the pencil's units."""
        return np.ldexp(values - self.origin, -self.value_exponent)

    def certificate_out(self, certificate: Certificate) -> Certificate:
        """Return the certificate with every value in the user's units."""
        shift, floor, low, high = self.places_out(
            np.array([certificate.shift, certificate.floor, *certificate.gap])
        ).tolist()
        resolution = float(np.ldexp(certificate.resolution, self.value_exponent))
        return replace(
            certificate, shift=shift, floor=floor, gap=(low, high), resolution=resolution
        )

    def residual_norms(
        self, values: Float[np.ndarray, " k"], vectors: Float[np.ndarray, "n k"]
    ) -> Float[np.ndarray, " k"]:
        """Bound the distance of each value to an eigenvalue.

        |λ - eigenvalue| ≤ ‖Wφ - λBφ‖ / ‖φ‖ with the norms of B⁻¹ and B (Parlett 1998, theorem 15.9.1); B⁻¹ ≤ (cD)⁻¹.
        """
        _, lengths, squares = _sums(self, vectors, values)
        return np.sqrt(squares / self.mass_floor / lengths)

    def to_user_vectors(self, vectors: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Convert vectors in place to the user's units and the signs of `Spectrum`.

        The result is read-only.
        """
        vectors = np.ascontiguousarray(vectors)
        signs = np.ones(vectors.shape[1])

        def choose_signs(columns: slice) -> None:
            part = vectors[:, columns]
            sizes = np.abs(part)
            leading = np.argmax(sizes >= (1 - 1e-6) * sizes.max(axis=0), axis=0)
            signs[columns] = np.where(part[leading, np.arange(part.shape[1])] < 0, -1.0, 1.0)

        map_in_threads(choose_signs, column_chunks(vectors.shape[1]))
        vectors *= np.ldexp(signs, self.vector_exponent)
        vectors.flags.writeable = False
        return vectors


def part_pencil(whole: Pencil, stiffness: sp.sparray, mass: sp.sparray) -> Pencil:
    """Return the pencil of one part, given by its W and B, scaled to its own units."""
    part = _pencil(stiffness, mass, known_floor=whole.mass_floor, advice=whole.advice)
    return replace(
        part,
        saturation=whole.saturation,
        origin=whole.origin,
        value_exponent=whole.value_exponent + part.value_exponent,
        vector_exponent=whole.vector_exponent + part.vector_exponent,
    )


def _pencil(
    stiffness: sp.sparray,
    mass: sp.sparray,
    *,
    scaled: bool = True,
    known_floor: float = 0.0,
    advice: Advice,
) -> Pencil:
    up_w, up_b = (_exponent(stiffness), _exponent(mass)) if scaled else (0, 0)
    up_b -= up_b % 2  # an even power, so that its square root is a power of two as well
    stiffness, mass = _scale(stiffness, -up_w), _scale(mass, -up_b)
    diagonal = mass.diagonal()
    mass_floor = _mass_floor(mass, diagonal, known_floor, advice)
    pattern = stiffness if mass_floor == 1.0 else abs(stiffness) + abs(mass)
    labels = connected_components(pattern.T, directed=False)[1].astype(np.int64)  # by rows
    return Pencil(
        stiffness=stiffness,
        mass=mass,
        mass_diagonal=diagonal,
        mass_floor=mass_floor,
        labels=labels,
        level=_level(stiffness.diagonal(), diagonal, labels),
        value_exponent=up_w - up_b,
        vector_exponent=-(up_b // 2),
        advice=advice,
    )


def _require_range(name: str, diagonal: Float[np.ndarray, " n"]) -> None:
    sizes = np.where(diagonal == 0, np.nan, np.abs(diagonal))
    if np.isnan(sizes).all():
        return
    low, high = int(np.nanargmin(sizes)), int(np.nanargmax(sizes))
    if sizes[high] / WIDEST_RANGE > sizes[low]:
        raise InvalidParameterError(
            f"Entries on the diagonal of {name} must lie within a factor of {WIDEST_RANGE:.0e}; entry {high} is "
            f"{diagonal[high]:.3g} and entry {low} is {diagonal[low]:.3g}."
        )


def _level(
    stiffness: Float[np.ndarray, " n"], mass: Float[np.ndarray, " n"], labels: Int[np.ndarray, " n"]
) -> float:
    mean = float(stiffness.sum() / mass.sum())
    if labels.any() and mean > 0:
        # The level that predicts the number of low eigenvalues of all parts (Weyl's law).
        levels = np.bincount(labels, stiffness) / np.bincount(labels, mass)
        counts, stiff = np.bincount(labels), levels > 0
        mean = float(counts[stiff].sum() / (counts[stiff] / levels[stiff]).sum())
    ratios = (stiffness / mass)[stiffness > 0]
    if mean <= 0 or not ratios.size:
        return 1.0
    median = float(np.median(ratios))
    return mean if mean < median * LARGEST_LEVEL_RATIO else median


def _exponent(matrix: sp.sparray) -> int:
    largest = float(np.abs(matrix.data).max(initial=0.0))
    return int(np.frexp(largest)[1]) - 1 if largest > 0 else 0


def _scale(matrix: sp.sparray, exponent: int) -> sp.csc_array:
    # The rows of a symmetric matrix serve as columns. Short indices take half of the memory.
    columns = sp.csc_array(matrix.T if matrix.format == "csr" else matrix)
    short = sp.get_index_dtype(maxval=columns.nnz)
    copy = not columns.has_canonical_format  # or else nothing below changes the indices
    places = (each.astype(short, copy=copy) for each in (columns.indices, columns.indptr))
    data = np.ldexp(columns.data.astype(np.float64), exponent)
    scaled = sp.csc_array((data, *places), shape=columns.shape)
    scaled.sum_duplicates()
    return scaled


def _shift_pattern(stiffness: sp.csc_array, mass: sp.csc_array) -> ShiftPattern:
    # The sum of codes has an entry wherever W, B or the diagonal has one, and says which have.
    union = sp.eye_array(stiffness.shape[0], dtype=np.int8, format="csc")  # DIAGONAL is 1
    for code, matrix in ((IN_STIFFNESS, stiffness), (IN_MASS, mass)):
        codes = np.full(matrix.nnz, code, np.int8), matrix.indices, matrix.indptr
        union = union + sp.csc_array(codes, shape=matrix.shape)
    union.sort_indices()
    elimination = analyze_pattern(union)
    return ShiftPattern(
        elimination=elimination,
        stiffness=_scatter(stiffness, union.data & IN_STIFFNESS),
        mass=_scatter(mass, union.data & IN_MASS),
        diagonal=np.flatnonzero(union.data & DIAGONAL),
        memory=factor_memory(elimination),
    )


def _scatter(matrix: sp.csc_array, places: Int[np.ndarray, " e"]) -> Float[np.ndarray, " e"]:
    """Return the entries of a matrix at the places that are not 0, and zeros at the others."""
    if matrix.nnz == len(places):
        return matrix.data
    data = np.zeros(len(places))
    data[places != 0] = matrix.data
    return data


def _mass_floor(
    mass: sp.csc_array, diagonal: Float[np.ndarray, " n"], known: float, advice: Advice
) -> float:
    if mass.count_nonzero() == np.count_nonzero(diagonal):
        return 1.0
    # Linear elements have c = 1/2. The first of these that holds is used; those of badly scaled
    # bases are small, and farther apart.
    floors = 0.49 * 0.5 ** np.concatenate([np.arange(12), np.arange(14, 33, 3)])
    if known >= floors[-1]:
        return float(floors[floors <= known].max())
    # B - cD is positive definite exactly when all its pivots are positive.
    pattern = _shift_pattern(mass, sp.csc_array(sp.diags_array(diagonal)))
    for floor in floors.tolist():
        lower = SymmetricFactor.of_entries(
            pattern.elimination, pattern.stiffness - floor * pattern.mass, pattern.memory
        )
        if lower and (lower.pivots > 0).all():
            return floor
    place = int(np.argmax(lower.pivots <= 0)) if lower else 0
    where = (
        f", {lower.pivots[place]:.3g} at {advice.row} {pattern.elimination.order[place]}"
        if lower
        else ""
    )
    raise InvalidParameterError(
        f"{advice.mass} must be positive definite; B - {floor:.1e} diag(B) has a pivot that is not positive{where}."
    )


def largest_bound(pencil: Pencil) -> float:
    """Bound the eigenvalues from above, by W ≤ diag(Σ_j |W_ij|) and B ≥ c D."""
    ratios = abs(pencil.stiffness).sum(axis=1) / pencil.mass_diagonal
    return float(ratios.max()) * (1 + 1e-9) / pencil.mass_floor


def rayleigh_residuals(
    pencil: Pencil, vectors: Float[np.ndarray, "n k"], near: Float[np.ndarray, " k"] | None = None
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Return Rayleigh quotients of the columns and their error bounds (`Pencil.residual_norms`).

    Numbers near the quotients, where B is diagonal, save half of the products.
    """
    values, lengths, squares = _sums(pencil, vectors, near)
    if near is not None:
        # ‖Wφ - λBφ‖² = ‖Wφ - νBφ‖² - (λ - ν)² ‖Bφ‖² for ν near the quotient λ, in the norm of B⁻¹.
        squares = np.maximum(squares - (values - near) ** 2 * lengths, EPS * squares)
    return values, np.sqrt(squares / pencil.mass_floor / lengths)


def _sums(
    pencil: Pencil, vectors: Float[np.ndarray, "n k"], values: Float[np.ndarray, " k"] | None
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Return φᵀWφ / φᵀBφ, φᵀBφ, and Σ (Wφ - λBφ)² / D of each column, λ as given or that quotient."""
    sums = np.empty((3, vectors.shape[1]))
    stiffness, mass = sparse_rows(pencil.stiffness), sparse_rows(pencil.mass)

    def measure(columns: slice) -> None:
        part = np.ascontiguousarray(vectors[:, columns])
        k = part.shape[1]
        scratch = np.empty((2, k)), np.zeros((3, k))
        weights, own = pencil.mass_diagonal, np.zeros((3, k))
        if values is None:
            unused = np.zeros(k)
            add_sums(stiffness, mass, part, unused, weights, False, *scratch, own)
            given, own = own[0] / own[1], np.zeros((3, k))
        else:
            given = values[columns]
        add_sums(stiffness, mass, part, given, weights, True, *scratch, own)
        sums[:, columns] = own

    map_in_threads(measure, column_chunks(vectors.shape[1]))
    return sums[0] / sums[1], sums[1], sums[2]


def gram_columns(
    pencil: Pencil, vectors: Float[np.ndarray, "n k"], columns: slice, first: int = 0
) -> Float[np.ndarray, "j c"]:
    """Return ΦᵀBΦ - I in some columns, and in the rows from `first` to the last of these columns."""
    weighed = pencil.weigh(vectors[:, columns])
    rows = np.flatnonzero(weighed.any(axis=1))  # few where vectors live on parts
    before = vectors[:, first : columns.stop]
    every = len(rows) == pencil.n
    off = before.T @ weighed if every else before[rows].T @ weighed[rows]
    own = np.arange(off.shape[1])
    off[columns.start - first + own, own] -= 1
    return off


def column_chunks(k: int) -> list[slice]:
    """Split k columns into slices, so that intermediate results stay small."""
    return [slice(start, min(start + COLUMNS_AT_ONCE, k)) for start in range(0, k, COLUMNS_AT_ONCE)]
