"""The proof that no eigenvalue of a spectrum is missing, and none is extra."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from certeig.certificate import Certificate
from certeig.kit.arrays import as_array
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.threads import map_in_threads
from certeig.kit.typing import ArrayLike
from certeig.solver.diagnosis import remedy_for
from certeig.solver.eigenpairs import Pairs
from certeig.solver.factor import Factor
from certeig.solver.inertia import count_again, count_beside
from certeig.solver.pencil import Pencil, column_chunks, gram_columns

# Eigenvalues closer than this, relative to the largest one, form a cluster.
RESOLUTION = 1e-6
# Extent, relative to the largest eigenvalue, beyond which a chain of close eigenvalues is no
# cluster and proves nothing.
WIDEST_CLUSTER = 1e-3
# Largest entry of |ΦᵀBΦ - I| with which eigenvectors count as orthonormal. Solvers
# correct what is above 1e-12; a large tolerance would let one eigenvector count twice.
ORTHONORMAL = 1e-8
# What residuals must prove of entries that are not computed,
FAR_ORTHONORMAL = 1e-10
# and columns before one whose entries are computed in any case: of up to so many pairs all are.
NEAR_COLUMNS = 512
# Largest residual, relative to the largest eigenvalue, of an eigenpair that counts as found.
LARGEST_RESIDUAL = 1e-5
# Second attempt to count below a cluster: this many times farther below it.
CLUSTER_STEP = 10.0


def certify_pairs(
    pencil: Pencil, eigenvalues: ArrayLike, eigenvectors: ArrayLike
) -> tuple[Certificate, float]:
    """Count the eigenvalues that given eigenpairs, in the user's units, should be the lowest of.

    Return the certificate in the user's units, which may be incomplete, and the last eigenvalue.

    Raises an InvalidParameterError if the arrays do not fit the pencil, or are not finite or not
    ascending, and a ConvergenceError if the columns are not B-orthonormal eigenvectors.
    """
    values = as_array(eigenvalues, "eigenvalues")
    vectors = as_array(eigenvectors, "eigenvectors")
    fits = values.ndim == 1 and values.size and vectors.shape == (pencil.n, len(values))
    if not fits:
        raise InvalidParameterError(
            f"eigenvalues and eigenvectors must have shapes (k,) and ({pencil.n}, k); "
            f"the shapes are {values.shape} and {vectors.shape}."
        )
    if not (np.isfinite(values).all() and np.isfinite(vectors).all()):
        raise InvalidParameterError("eigenvalues and eigenvectors must be finite; some are not.")
    drops = np.flatnonzero(np.diff(values) < 0)
    if drops.size:
        raise InvalidParameterError(
            f"eigenvalues must ascend; {drops[0] + 1} is {values[drops[0] + 1]} after {values[drops[0]]}."
        )
    own = pencil.places_in(values)
    vectors = np.ldexp(vectors, -pencil.vector_exponent)
    certificate = prove(pencil, Pairs(own, vectors, pencil.residual_norms(own, vectors)))
    return pencil.certificate_out(certificate), float(values[-1])


def prove(
    pencil: Pencil,
    pairs: Pairs,
    factor: Factor | None = None,
    following: Float[np.ndarray, " j"] | tuple[()] = (),
) -> Certificate:
    """Count the eigenvalues up to just above the last pair, or up to its cluster if more copies follow.

    A factor above all pairs that counts no more than these needs no other. One at any shift, which is
    spent, may save a trial: its rounding tells what to expect. So may values that follow the last
    pair: first the count is made halfway to the first of them. The certificate, in the pencil's
    units, may be incomplete: then `count` differs from `n_found`.

    Raises a ConvergenceError if the pairs are not B-orthonormal eigenvectors, or no factor is good
    enough to count by.
    """
    k, certificate = len(pairs.values), quality(pencil, pairs)
    if k == pencil.n:
        return certificate
    if factor and factor.count == k and (own := count_again(pencil, pairs, factor)):
        return with_count(certificate, pairs, own.shift, own.count)
    for value in following[:1]:
        step = (float(value) - float(pairs.values[-1])) / 2
        if step > certificate.resolution:
            factor = count_beside(pencil, pairs, k - 1, step, factor)
            if factor.count <= k:
                counted = with_count(certificate, pairs, factor.shift, factor.count)
                return replace(counted, resolution=certificate.resolution)
    above = count_beside(pencil, pairs, k - 1, certificate.resolution, factor)
    certificate = with_count(certificate, pairs, above.shift, above.count)
    if above.count <= k:
        return certificate

    # More copies follow. Count below the cluster: all further pairs are in it, none above it.
    jumps = np.flatnonzero(np.diff(pairs.values) > 2 * certificate.resolution)
    first = int(jumps[-1]) + 1 if jumps.size else 0
    below = count_beside(pencil, pairs, first, -certificate.resolution, above)
    if below.count > first:
        # Slack may have moved copies of the cluster below σ that are not among the pairs: count
        # again from farther below.
        farther = CLUSTER_STEP * (below.shift - float(pairs.values[first]))
        below = count_beside(pencil, pairs, first, farther, below)
    resolution = float(pairs.values[-1]) - below.shift
    if resolution > WIDEST_CLUSTER * _scale(pencil, pairs):
        raise ConvergenceError(
            f"Neighboring eigenvalues must differ by more than the rounding of the factor; the last {k - first} "
            f"of {k} do not. {pencil.advice.rounding}"
        )
    certificate = with_count(certificate, pairs, below.shift, below.count)
    return replace(certificate, resolution=resolution, n_split=above.count - k)


def distinct_from(pencil: Pencil, pairs: Pairs) -> float:
    """Return the distance from which two eigenvalues count as different."""
    return max(RESOLUTION * _scale(pencil, pairs), 4 * pairs.error_bound)


def quality(pencil: Pencil, pairs: Pairs) -> Certificate:
    """Return the certificate of pairs without a count, in the pencil's units; complete if these are all n.

    Raises a ConvergenceError if the pairs are not B-orthonormal eigenvectors.
    """
    resolution, orthonormality = distinct_from(pencil, pairs), require_orthonormal(pencil, pairs)
    relative = pairs.residuals / _scale(pencil, pairs)
    worst = int(relative.argmax())
    if not relative[worst] <= LARGEST_RESIDUAL:
        raise ConvergenceError(
            f"Every pair must satisfy Wφ = λBφ to {LARGEST_RESIDUAL:.0e} of the largest eigenvalue; pair {worst} is "
            f"off by {relative[worst]:.2e}. {pencil.advice.inaccurate} {remedy_for(pencil)}"
        )
    return Certificate(
        n_pairs=len(pairs.values),
        shift=np.inf,
        count=pencil.n,
        n_found=len(pairs.values),
        gap=(float(pairs.values[-1]), np.inf),
        resolution=resolution,
        orthonormality=orthonormality,
        max_residual=float(pairs.residuals.max()) / _user_scale(pencil, pairs),
        n_split=0,
        clusters=_clusters(pairs.values, resolution),
    )


def take_pairs(
    pencil: Pencil, pairs: Pairs, certificate: Certificate, start: int, stop: int
) -> tuple[Pairs, Certificate]:
    """Return the pairs start to stop - 1, and their certificate; the proof for all pairs includes them."""
    resolution = RESOLUTION * _scale(pencil, pairs)
    rest = pairs.values[stop:] - pairs.values[stop - 1]
    equal = int(np.count_nonzero(rest <= resolution))
    fewer = pairs.select(slice(start, stop))
    return fewer, replace(
        certificate,
        first=certificate.first + start,
        n_pairs=stop - start,
        n_split=equal + (certificate.n_split if equal == len(rest) else 0),
        clusters=_clusters(fewer.values, resolution),
    )


def with_count(certificate: Certificate, pairs: Pairs, shift: float, count: int) -> Certificate:
    """Return the certificate of pairs with the number of all eigenvalues below a shift."""
    n_found = int(np.count_nonzero(pairs.values < shift))
    low = float(pairs.values[n_found - 1]) + pairs.error_bound if n_found else -np.inf
    return replace(
        certificate,
        shift=shift,
        count=count,
        n_found=n_found,
        gap=(low, shift),
        resolution=float(np.abs(pairs.values - shift).min()),
    )


def _clusters(values: Float[np.ndarray, " k"], resolution: float) -> tuple[int, ...]:
    ends = np.flatnonzero(np.append(np.diff(values) > resolution, True))
    return tuple(np.diff(ends, prepend=-1).tolist())


def _scale(pencil: Pencil, pairs: Pairs) -> float:
    # level / n is far below the first positive eigenvalue of a surface; it is the scale if all
    # eigenvalues found are 0.
    return max(float(np.abs(pairs.values).max()), pencil.level / pencil.n)


def _user_scale(pencil: Pencil, pairs: Pairs) -> float:
    """Return the scale as the user sees it, from the user's zero."""
    origin = float(np.ldexp(pencil.origin, -pencil.value_exponent))
    return _scale(pencil, replace(pairs, values=pairs.values + origin))


def require_orthonormal(pencil: Pencil, pairs: Pairs) -> float:
    """Return a bound of the entries of |ΦᵀBΦ - I|; raise a ConvergenceError if one is not small.

    Entries of pairs that are near each other are computed. Others are bounded by their residuals
    wherever that bound is small, so that the work grows with the number of pairs and not with its
    square: with Wφ_i = λ_i Bφ_i + r_i, (λ_j - λ_i) φ_iᵀBφ_j = φ_jᵀr_i - φ_iᵀr_j, and φ_jᵀr_i is at
    most the residual of i, where both vectors have the length 1.
    """

    def largest(columns: slice) -> tuple[float, int, int]:
        # Of the rows far before these columns, the first ones whose bound is small are left out.
        far = max(columns.start - NEAR_COLUMNS, 0)
        gaps = pairs.values[columns].min() - pairs.values[:far]
        sums = pairs.residuals[columns].max() + pairs.residuals[:far]
        # The lengths of vectors are 1 up to ORTHONORMAL, which the other entries show.
        bounds = np.divide(1.01 * sums, gaps, out=np.full(far, np.inf), where=gaps > 0)
        first = int(np.argmax(np.append(bounds > FAR_ORTHONORMAL, True)))
        bound = float(bounds[:first].max(initial=0.0))

        off = np.abs(gram_columns(pencil, pairs.vectors, columns, first))
        row, column = np.unravel_index(int(off.argmax()), off.shape)
        return max(float(off[row, column]), bound), first + int(row), columns.start + int(column)

    found = map_in_threads(largest, column_chunks(len(pairs.values)))
    for worst, row, column in found:
        if not worst <= ORTHONORMAL:
            raise ConvergenceError(
                f"Eigenvectors must be B-orthonormal to {ORTHONORMAL:.0e}; columns {row} and {column} are off by "
                f"{worst:.2e}."
            )
    return max((worst for worst, _, _ in found), default=0.0)
