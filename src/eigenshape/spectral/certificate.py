"""The proof that no eigenvalue of a shape's spectrum is missing."""

from dataclasses import dataclass

import certeig


@dataclass(frozen=True)
class Certificate(certeig.Certificate):
    """The proof that a spectrum contains all eigenvalues, with none missing and none extra.

    Values are in 1/length². See `certeig.Certificate` for the other attributes.

    Attributes
    ----------
    count : int or None
        Number of eigenvalues between `floor` and `shift`, by inertia; None if they were not counted
        (approximate method).
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
