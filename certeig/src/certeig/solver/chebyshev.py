"""Chebyshev filters: a polynomial of an operator in place of its inverse, where factors are large.

They begin with the largest eigenvalue of the operator, which takes products with it alone.
"""

from collections.abc import Callable

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arrays import record
from certeig.kit.errors import ConvergenceError
from certeig.solver.pencil import Pencil, column_chunks
from certeig.sparse.basis import Block, SparseRows, multiply, sparse_rows

Column = Float[np.ndarray, " n"]

# Steps of Lanczos: enough for a bound that is a few per cent too high.
LANCZOS_STEPS = 12
# Length of a residual, beside columns of length 1, below which the space is invariant.
INVARIANT = 1e-10


def largest_ritz_value(multiply: Callable[[Column], Column], n: int) -> tuple[float, float, float]:
    """Return the largest Ritz value of twelve steps of Lanczos, the length of the last residual, and a share of it.

    The Ritz value plus the length is seldom below the largest eigenvalue (Zhou and others 2006).
    The share is that of the last column in the Ritz vector: share times length is its residual.
    """
    column = np.random.default_rng(0).standard_normal(n)
    column /= np.linalg.norm(column)
    before, rest, diagonal, beside = np.zeros_like(column), 0.0, [], []
    for _ in range(LANCZOS_STEPS):
        image = multiply(column) - rest * before
        diagonal.append(float(column @ image))
        image -= diagonal[-1] * column
        rest = float(np.linalg.norm(image))
        beside.append(rest)
        if rest < INVARIANT:
            break
        before, column = column, image / rest
    values, vectors = sl.eigh_tridiagonal(diagonal, beside[:-1])
    return float(values[-1]), rest, abs(float(vectors[-1, -1]))


# What a filter gains between its first damped eigenvalue and 0 is about cosh of this. A higher one
# needs fewer vectors and more products: 4 to 6 products a vector are best where a tenth of the
# spectrum is not damped (measured).
REACH = 2.2
# Degrees of a filter.
LOWEST_DEGREE, HIGHEST_DEGREE = 2, 60
# What the estimate of the largest eigenvalue is raised by.
RAISED = 1.01


@record
class ChebyshevFilter:
    """T_m(z(A)) for A = B^-½ W B^-½ with B diagonal, on u = B^½ φ, in the plain inner product.

    z takes the eigenvalues that are to be damped to [-1, 1], where the polynomial T_m is at most 1;
    lower ones are beyond 1, where it grows like cosh(m arcosh z) (Zhou, Saad, Tiago and Chelikowsky
    2006).

    Attributes
    ----------
    pencil : Pencil
    order : (n,) int
        The point of each row: points that are near each other in it share what is in the cache.
    roots : (n, 1) float
        B^½, by points.
    matrix : SparseRows
        2 z(A).
    degree : int
        m.
    damped : (float, float)
        The eigenvalues of the pencil that are damped.
    """

    pencil: Pencil
    order: Int[np.ndarray, " n"]
    roots: Float[np.ndarray, "n 1"]
    matrix: SparseRows
    degree: int
    damped: tuple[float, float]

    @property
    def size(self) -> float:
        """The lower end of what is damped, since eigenvalues up to about half of it are wanted."""
        return self.damped[0] / 2

    def image(self, block: Block) -> Block:
        """Return the polynomial's image of each slot, by the recurrence T_{j+1} = 2 z T_j - T_{j-1}."""
        images = np.empty_like(block)
        scratch = np.empty_like(block[0])
        for slot, image in zip(block, images, strict=True):
            # Of T_1, T_2, ... each takes the place of the one two before; the last is the image.
            odd, even = (image, scratch) if self.degree % 2 else (scratch, image)
            multiply(self.matrix, slot, odd, factor=0.5)
            multiply(self.matrix, odd, even, before=slot)
            before, latest = odd, even
            for _ in range(self.degree - 2):
                multiply(self.matrix, latest, before, before=before)
                before, latest = latest, before
        return images

    def weigh(self, block: Block) -> Block:
        """Return the block: the inner product is the plain one."""
        return block

    def enter(self, vectors: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Return u for φ, in the order of the rows."""
        return (vectors * self.roots)[self.order]

    def leave(self, vectors: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Return φ for u, in the order of the points, in its place."""
        rows = np.argsort(self.order)
        for columns in column_chunks(vectors.shape[1]):
            vectors[:, columns] = vectors[rows, columns] / self.roots
        return vectors

    def values(
        self, thetas: Float[np.ndarray, " m"]
    ) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
        """Return λ for θ = T_m(z(λ)) > 1, and |dλ/dθ|; both infinite for other θ, which several λ share."""
        low, high = self.damped
        values, slopes = np.full_like(thetas, np.inf), np.full_like(thetas, np.inf)
        beyond = thetas > 1
        angles = np.arccosh(thetas[beyond]) / self.degree
        half = (high - low) / 2
        values[beyond] = low - half * (np.cosh(angles) - 1)
        slopes[beyond] = half * np.sinh(angles) / (self.degree * np.sinh(self.degree * angles))
        return values, slopes


def chebyshev_filter(pencil: Pencil, order: Int[np.ndarray, " n"], low: float) -> ChebyshevFilter:
    """Return a filter that damps the eigenvalues from `low` on; B is diagonal.

    Raises a ConvergenceError if that is less than half of the spectrum.
    """
    roots = np.sqrt(pencil.mass_diagonal)
    scaled = sp.csr_array(pencil.stiffness[order][:, order])
    scaled.sort_indices()
    inverse = 1 / roots[order]
    scaled.data *= np.repeat(inverse, np.diff(scaled.indptr)) * inverse[scaled.indices]
    # A little less than the largest eigenvalue does no harm.
    value, rest, share = largest_ritz_value(lambda column: scaled @ column, pencil.n)
    high = RAISED * (value + share * rest)
    if not 0 < low < high / 2:
        raise ConvergenceError(
            f"A filter must damp most of the spectrum; it is to begin at {low / high:.2g} of it."
        )
    degree = round(REACH / np.sqrt(low / high))
    scaled.data *= -4 / (high - low)
    scaled.setdiag(scaled.diagonal() + 2 * (high + low) / (high - low))
    return ChebyshevFilter(
        pencil=pencil,
        order=order,
        roots=roots[:, None],
        matrix=sparse_rows(scaled),
        degree=min(max(degree, LOWEST_DEGREE), HIGHEST_DEGREE),
        damped=(low, high),
    )
