"""The proof that no eigenvalue of a shape's spectrum is missing."""

from dataclasses import dataclass

import certeig


@dataclass(frozen=True)
class Certificate(certeig.Certificate):
    """The proof that a spectrum contains all eigenvalues, with none missing and none extra.

    `certeig.Certificate` says how it is proved.

    Attributes
    ----------
    n_pairs : int
        Number of certified eigenpairs k.
    first : int
        Index of the first of them among all eigenvalues, 0 for the lowest.
    floor : float
        Lower end of the count, in 1/length²; -inf if all eigenvalues below σ are counted.
    shift : float
        σ, in 1/length²; infinite if all n eigenvalues were computed, or nothing was counted.
    count : int or None
        Number of eigenvalues between `floor` and σ, by inertia; None if they were not counted
        (approximate method).
    n_found : int
        Number of eigenpairs found there. It equals `count`, or the spectrum is refused.
    gap : (float, float)
        An interval around σ, in 1/length², without eigenvalues.
    resolution : float
        Eigenvalues closer than this, in 1/length², count as equal.
    orthonormality : float
        Largest entry of |ΦᵀBΦ - I|, or a bound of it.
    max_residual : float
        Largest of `Spectrum.residuals`, relative to the largest eigenvalue found.
    n_split : int
        Number of eigenvalues equal to the k-th (to `resolution`) that are not among the k.
    clusters : tuple of int
        Sizes of the clusters of eigenvalues, in ascending order of eigenvalues.
    n_deflated : int
        0 if a factor of the operator itself was counted. Otherwise a factor of a sparser operator
        below it was, outside the space of this many eigenvectors.
    fallbacks : tuple of str
        Methods that were tried first and failed, each with its error; empty as a rule.
    estimate : float or None
        Approximate method: estimated error of the eigenvalues, relative to the largest.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(3)), 6)
    >>> proof = spectrum.certificate
    >>> proof.complete, proof.n_pairs, proof.n_split
    (True, 6, 3)

    The last two of the six eigenvalues belong to a cluster of five, of which three were left out.
    """

    estimate: float | None = None

    unit = "1/length²"
    subject = "the operator"

    def _what(self) -> str:
        if self.count is not None:
            return super()._what()
        return (
            f"These are approximations, {self.n_pairs} of them: by what the last round of refinement changed, each "
            f"is off an eigenvalue by about {self.estimate or 0.0:.1e} of the largest, and for certain by at most "
            f"{self.max_residual:.1e}. The eigenvectors are orthonormal to {self.orthonormality:.1e}. Whether one "
            f"is missing was not counted; the certified method of solve_spectrum proves that none is."
        )
