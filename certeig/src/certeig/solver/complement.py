"""The proof that no eigenvalue is missing by a sparser operator below the given one, where factors of that are large.

If W ≥ W₀ as quadratic forms, then outside the space of enough vectors, in which W is known, W ≥ W₀
has no eigenvalue below σ: these are the intermediate problems of Aronszajn (Weinstein and Stenger
1972). What W₀ has there is counted by inertia, with one factor of W₀ and one solve for each vector.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from certeig.certificate import Certificate
from certeig.kit.errors import ConvergenceError
from certeig.solver.certify import distinct_from, quality, with_count
from certeig.solver.eigenpairs import Pairs
from certeig.solver.factor import Factor
from certeig.solver.pencil import Pencil

# Entries below this share of the largest ones beside the diagonal, in their row and their column,
# are left out: of a Gaussian kernel those beyond 2 widths, 75 % of them.
SMALL_ENTRIES = 0.02
# Rounding of a sum of entries of a row, relative.
SUM_ROUNDING = 1e-12
# Rounding of the form on the other pairs, relative to σ, a millionth of what they must differ by.
FORM_ROUNDING = 1e-12


def sparser_below(pencil: Pencil) -> Pencil:
    """Return the pencil of W₀ ≤ W without the small entries, in the units of the given one.

    An entry that is left out is at least -|w_ij| (x_i² + x_j²) of the quadratic form, so |w_ij| is
    taken from both entries of the diagonal. Those of a kernel are negative: W₀ is its truncation.
    """
    entries = pencil.stiffness.tocoo()
    rows, columns = entries.row, entries.col
    sizes, beside = np.abs(entries.data), rows != columns
    largest = np.zeros(pencil.n)
    np.maximum.at(largest, rows[beside], sizes[beside])
    small = beside & (sizes < SMALL_ENTRIES * np.sqrt(largest[rows] * largest[columns]))
    lost = np.bincount(rows[small], sizes[small], minlength=pencil.n) * (1 + SUM_ROUNDING)
    kept = sp.csc_array(
        (entries.data[~small], (rows[~small], columns[~small])), shape=entries.shape
    )
    kept.setdiag(kept.diagonal() - lost)
    return replace(pencil, stiffness=kept)


def prove_outside(pencil: Pencil, pairs: Pairs, k: int, below: Factor) -> tuple[Pairs, Certificate]:
    """Return the first k pairs, with the rest of the cluster of the k-th, and a certificate, complete or not.

    Raises a ConvergenceError if the pairs are not B-orthonormal eigenvectors, or not precise enough
    for a proof, or the cluster has no end among them.

    Parameters
    ----------
    pencil : Pencil
        B is diagonal.
    pairs : Pairs
        More than k, so many that W₀ has few other eigenvalues below γ. Those above the cluster need
        not be precise.
    k : int
    below : Factor
        Of W₀ - γB with γ above the cluster.
    """
    width = 2 * distinct_from(pencil, pairs.select(slice(k)))
    ends = np.flatnonzero(np.diff(pairs.values[k - 1 :]) > width)
    found = pairs.select(slice(k + int(ends[0]))) if ends.size else pairs
    certificate = quality(pencil, found)
    shift = float(found.values[-1]) + certificate.resolution
    missing = _most_missing(pencil, pairs, len(found.values), shift, below) if ends.size else None
    if missing is None:
        raise ConvergenceError(
            f"A proof by a sparser operator needs pairs above a gap and precise ones; of {len(pairs.values)} pairs "
            f"{len(found.values)} end at {pencil.place_out(shift):.6g}{pencil.advice.units}."
        )
    certificate = with_count(certificate, found, shift, len(found.values) + missing)
    return found, replace(certificate, n_deflated=len(pairs.values))


def _most_missing(
    pencil: Pencil, pairs: Pairs, n_found: int, shift: float, below: Factor
) -> int | None:
    """Bound the number of eigenvalues below σ beside those of the first pairs; None where rounding hides it.

    Let y be B-orthogonal to all pairs V, and U the pairs above σ. Then (Ua + y)ᵀ(W - σB)(Ua + y)
    is at least aᵀ(UᵀWU - σUᵀBU)a + 2aᵀRᵀy + yᵀ(W₀ - σB)y, with R = WU - BUΘ. That is positive
    where W₀ has no eigenvalue below γ among the y and R is small; otherwise W has at most as many
    eigenvalues more as W₀ has there.
    """
    weighed = pencil.weigh(pairs.vectors)
    solved = below.solve(weighed)
    # On the y, W₀ - γB has as many negative eigenvalues as everywhere, less those of
    # VᵀB (W₀ - γB)⁻¹ BV (Haynsworth 1968). Rounding changes W₀ - γB by E, |xᵀEx| ≤ Σ r_i x_i².
    loss = below.rounding()
    projected = weighed.T @ solved
    on_pairs = np.linalg.eigvalsh((projected + projected.T) / 2)
    error = 2 * float(np.einsum("ij,i,ij->", solved, loss, solved))
    if not np.abs(on_pairs).min() > error:
        return None

    # The form is least at y = -B⁻¹Ra / (γ - σ).
    others, of_others = pairs.vectors[:, n_found:], weighed[:, n_found:]
    images = pencil.stiffness @ others
    rests = images - of_others * pairs.values[n_found:]
    margin = below.shift - float((loss / pencil.mass_diagonal).max()) - shift
    form = others.T @ images - shift * (others.T @ of_others)
    form -= rests.T @ (rests / pencil.mass_diagonal[:, None]) / margin
    least = np.linalg.eigvalsh((form + form.T) / 2)[0]
    if not (margin > 0 and least > FORM_ROUNDING * shift):
        return None
    return below.count - int(np.count_nonzero(on_pairs < 0))
