"""The operator in units of its own, so that a solve never sees the user's."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.sparse.linalg import splu

from eigenshape._errors import InvalidParameterError
from eigenshape.operators.laplacian import Laplacian

SYMMETRIC_MODE = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
COLUMNS_AT_ONCE = 64


@dataclass(frozen=True, eq=False)
class Pencil:
    """W φ = λ B φ scaled by powers of two, which change no digit.

    Attributes
    ----------
    stiffness, mass : (n, n) sparse
        W and B with largest diagonal entries between 1 and 4.
    mass_diagonal : (n,) float
        D, the diagonal of `mass`.
    mass_floor : float
        A proven c in (0, 1] with B ≥ c D as quadratic forms; 1 where B is diagonal.
    level : float
        trace W / trace B: the mean of the eigenvalues up to the shape of B, and the unit for every tolerance.
    value_exponent, vector_exponent : int
        An eigenvalue is 2**value_exponent times larger in the user's units, a vector 2**vector_exponent times.
    """

    stiffness: sp.csc_array
    mass: sp.csc_array
    mass_diagonal: Float[np.ndarray, " n"]
    mass_floor: float
    level: float
    value_exponent: int
    vector_exponent: int

    @property
    def n(self) -> int:
        """Number of points."""
        return len(self.mass_diagonal)

    def weigh(self, vectors: Float[np.ndarray, "n b"]) -> Float[np.ndarray, "n b"]:
        """Multiply by B."""
        if self.mass_floor == 1.0:
            return self.mass_diagonal[:, None] * vectors
        return self.mass @ vectors

    def values_out(self, values: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Return eigenvalues in the user's units."""
        return np.ldexp(values, self.value_exponent)

    def vectors_out(self, vectors: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Return B-normalised vectors in the user's units."""
        return np.ldexp(vectors, self.vector_exponent)


def normalise(laplacian: Laplacian) -> Pencil:
    """Scale W and B by powers of two, and find a lower bound of B.

    Raises
    ------
    InvalidParameterError
        If B is not positive definite.
    """
    up_w, up_b = _exponent(laplacian.stiffness), _exponent(laplacian.mass)
    up_b -= up_b % 2  # an even power, so that its square root is a power of two as well
    stiffness = _scaled(laplacian.stiffness, -up_w)
    mass = _scaled(laplacian.mass, -up_b)
    diagonal = mass.diagonal()
    trace = float(stiffness.diagonal().sum())
    return Pencil(
        stiffness=stiffness,
        mass=mass,
        mass_diagonal=diagonal,
        mass_floor=_mass_floor(mass, diagonal),
        level=trace / float(diagonal.sum()) if trace > 0 else 1.0,
        value_exponent=up_w - up_b,
        vector_exponent=-(up_b // 2),
    )


def _exponent(matrix: sp.csr_array) -> int:
    largest = float(np.abs(matrix.data).max(initial=0.0))
    return int(np.frexp(largest)[1]) - 1 if largest > 0 else 0


def _scaled(matrix: sp.csr_array, exponent: int) -> sp.csc_array:
    scaled = sp.csc_array(matrix, dtype=np.float64, copy=True)
    scaled.data = np.ldexp(scaled.data, exponent)
    scaled.sum_duplicates()
    return scaled


def _mass_floor(mass: sp.csc_array, diagonal: Float[np.ndarray, " n"]) -> float:
    # B - cD is positive definite exactly when all its pivots are positive. Linear elements have c = 1/2.
    if (mass - sp.diags_array(diagonal)).count_nonzero() == 0:
        return 1.0
    for halvings in range(12):
        floor = 0.49 * 0.5**halvings
        if _positive_definite(mass - floor * sp.diags_array(diagonal)):
            return floor
    raise InvalidParameterError(
        f"mass must be positive definite; B - {floor:.1e} diag(B) has a pivot that is not positive."
    )


def _positive_definite(matrix: sp.sparray) -> bool:
    try:
        factor = splu(sp.csc_array(matrix), **SYMMETRIC_MODE)
    except RuntimeError:  # SuperLU's word for a pivot of exactly zero
        return False
    return bool(np.array_equal(factor.perm_r, factor.perm_c) and (factor.U.diagonal() > 0).all())


def rayleigh_residuals(
    pencil: Pencil, vectors: Float[np.ndarray, "n k"]
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Return Rayleigh quotients of the columns, and the bounds that `residual_norms` has for them."""
    values = np.empty(vectors.shape[1])
    for columns in _column_chunks(vectors.shape[1]):
        part = vectors[:, columns]
        weighed = pencil.weigh(part)
        values[columns] = _column_dots(part, pencil.stiffness @ part) / _column_dots(part, weighed)
    return values, residual_norms(pencil, values, vectors)


def residual_norms(
    pencil: Pencil, values: Float[np.ndarray, " k"], vectors: Float[np.ndarray, "n k"]
) -> Float[np.ndarray, " k"]:
    """Bound the distance of each value to an eigenvalue.

    |λ - eigenvalue| ≤ ‖Wφ - λBφ‖ / ‖φ‖ with the norms of B⁻¹ and B (Parlett 1998, theorem 15.9.1); B⁻¹ ≤ (cD)⁻¹.
    """
    norms = np.empty(len(values))
    for columns in _column_chunks(len(values)):
        part = vectors[:, columns]
        weighed = pencil.weigh(part)
        rest = pencil.stiffness @ part - weighed * values[columns]
        squares = _column_dots(rest, rest / pencil.mass_diagonal[:, None]) / pencil.mass_floor
        norms[columns] = np.sqrt(squares / _column_dots(part, weighed))
    return norms


def _column_chunks(k: int) -> list[slice]:
    return [slice(start, min(start + COLUMNS_AT_ONCE, k)) for start in range(0, k, COLUMNS_AT_ONCE)]


def _column_dots(left: Float[np.ndarray, "n b"], right: Float[np.ndarray, "n b"]) -> Float[np.ndarray, " b"]:
    return np.einsum("ij,ij->j", left, right)
