"""The proof that no eigenvalue of a spectrum is missing."""

from dataclasses import dataclass

import numpy as np

from certeig.kit.text import Shown


@dataclass(frozen=True)
class Certificate(Shown):
    """The proof that a spectrum contains all eigenvalues, with none missing and none extra.

    By Sylvester's law of inertia, the number of negative pivots of a factor of W - σB is the number
    of eigenvalues below σ. If as many B-orthonormal eigenvectors were found, and their error
    intervals end below σ, none is missing and none is extra. If the k-th eigenvalue is multiple (to
    `resolution`) and more copies follow, σ is below all copies, and the pairs found at the level of
    the k-th eigenvalue are the rest of the k. For an interval far up in the spectrum a second
    factor counts below its lower end, and the difference of the counts must have been found.

    A matrix with many entries a row is bounded from below by a sparser one, whose eigenvalues
    are counted outside the space of the eigenvectors that were found.

    Attributes
    ----------
    n_pairs : int
        Number of certified eigenpairs k.
    first : int
        Index of the first of them among all eigenvalues, 0 for the lowest: the number of
        eigenvalues below it.
    floor : float
        Lower end of the count; -inf if all eigenvalues below σ are counted.
    shift : float
        σ; infinite if all n eigenvalues were computed, or nothing was counted.
    count : int or None
        Number of eigenvalues between `floor` and σ, by inertia; None if they were not counted.
    n_found : int
        Number of eigenpairs found there. It equals `count`, or the spectrum is refused.
    gap : (float, float)
        An interval around σ, without eigenvalues: its upper part by the count, its
        lower part by the error intervals of the eigenvalues.
    resolution : float
        Eigenvalues closer than this count as equal: the rounding of the factor and of the
        eigenvectors, and at least 1e-6 of the largest eigenvalue. If eigenvalues begin below zero
        or far above it, the largest is measured from where they begin.
    orthonormality : float
        Largest entry of |ΦᵀBΦ - I|, or a bound of it: entries of pairs that are more than 512 apart
        are not computed where residuals prove that they are below 1e-10.
    max_residual : float
        Largest of `Spectrum.residuals`, relative to the largest eigenvalue found.
    n_split : int
        Number of eigenvalues equal to the k-th (to `resolution`) that are not among the k. If it is
        not 0, the k-th eigenvector is one of many choices inside a truncated eigenspace.
    clusters : tuple of int
        Sizes of the clusters of eigenvalues, in ascending order of eigenvalues. Within a cluster
        neighbors are equal to 1e-6 of the largest eigenvalue, or to the rounding of the vectors.
    n_deflated : int
        0 if a factor of the pencil itself was counted. Otherwise a factor of a sparser one
        below it was, outside the space of this many eigenvectors.
    fallbacks : tuple of str
        Methods that were tried first and failed, each with its error; empty as a rule.

    Values are in the unit of the eigenvalues.

    Examples
    --------
    A ring of 50 equal masses and springs, whose eigenvalues but the first come in pairs:

    >>> import certeig
    >>> from scipy.sparse import diags_array
    >>> ring = diags_array([2.0, -1.0, -1.0, -1.0, -1.0], offsets=[0, 1, -1, 49, -49], shape=(50, 50))
    >>> proof = certeig.eigenpairs(ring, k=4).certificate
    >>> proof.complete, proof.n_pairs, proof.n_split
    (True, 4, 1)

    The last of the four eigenvalues belongs to a cluster of two, of which one was left out.
    """

    # Packages that know where pencils come from set these in a class of their own.
    unit = ""  # of the eigenvalues, for people
    subject = "the pencil"

    n_pairs: int
    shift: float
    count: int | None
    n_found: int
    gap: tuple[float, float]
    resolution: float
    orthonormality: float
    max_residual: float
    n_split: int
    clusters: tuple[int, ...] = ()
    first: int = 0
    floor: float = -np.inf
    n_deflated: int = 0
    fallbacks: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether all eigenvalues that were counted were found."""
        return self.count == self.n_found

    @property
    def n_missing(self) -> int:
        """Number of eigenvalues counted and not found; 0 if nothing was counted."""
        return 0 if self.count is None else self.count - self.n_found

    def explain(self) -> str:
        """Return a text that says what is proved, and how."""
        tried = f"Tried before, in vain: {' '.join(self.fallbacks)}" if self.fallbacks else ""
        return " ".join(filter(None, [self._what(), tried]))

    @property
    def units(self) -> str:
        """The unit in parentheses, after a space, or nothing."""
        return f" ({self.unit})" if self.unit else ""

    def _what(self) -> str:
        if not self.complete:
            return (
                f"This set of {self.n_pairs} eigenvalues is not proved: {self.count} lie below "
                f"{self.shift:.6g}{self.units}, and {self.n_found} were found there."
            )
        what = f"{self._these()} of {self.subject}: none is missing and none is extra."
        return " ".join([what, self._how(), self._split()]).strip()

    def _these(self) -> str:
        if self.first:
            return f"These are the eigenvalues from number {self.first} to {self.first + self.n_pairs - 1}"
        return (
            "This is the lowest eigenvalue"
            if self.n_pairs == 1
            else f"These are the {self.n_pairs} lowest eigenvalues"
        )

    def _how(self) -> str:
        quality = (
            f"The eigenvectors are orthonormal to {self.orthonormality:.1e}, and each eigenvalue is off by at most "
            f"{self.max_residual:.1e} of the largest."
        )
        if np.isinf(self.shift):
            return f"They are all that a matrix with {self.count} rows has. {quality}{self._clusters()}"
        if np.isfinite(self.floor):
            return (
                f"Factors of W - σB at σ = {self.floor:.6g} and {self.shift:.6g}{self.units} differ by {self.count} in "
                f"their negative pivots, so {self.count} eigenvalues lie between, and {self.n_found} were found there. "
                f"{quality}{self._clusters()}"
            )
        if self.n_deflated:
            return (
                f"Outside the space of {self.n_deflated} eigenvectors {self.subject} is not below a sparser one, whose "
                f"factor has no eigenvalue there up to σ = {self.shift:.6g}{self.units}. So {self.count} eigenvalues "
                f"lie below σ, and {self.n_found} were found there. {quality}{self._clusters()}"
            )
        n = self.count
        counted = (
            "1 negative pivot, so 1 eigenvalue lies below σ, and 1 was found there"
            if n == 1
            else f"{n} negative pivots, so {n} eigenvalues lie below σ, and {self.n_found} were found there"
        )
        factor = f"A factor of W - σB at σ = {self.shift:.6g}{self.units}"
        return f"{factor} has {counted}. {quality}{self._clusters()}"

    def _clusters(self) -> str:
        largest = max(self.clusters, default=1)
        if largest == 1:
            return ""
        return (
            f" Neighbors closer than {self.resolution:.1e}{self.units} count as equal here: there are "
            f"{len(self.clusters)} different ones, and the largest cluster has {largest}."
        )

    def _split(self) -> str:
        if self.n_split == 0:
            return ""
        whole = self.n_found, self.n_pairs + self.n_split
        after = f", {self.unit}" if self.unit else ""
        cut = self.n_pairs - self.n_found
        last = "The last one belongs" if cut == 1 else f"The last {cut} belong"
        return (
            f"{last} to a cluster of {whole[1] - whole[0]} eigenvalues "
            f"(neighbors closer than {self.resolution:.1e}{after}) of which {self.n_split} were not asked for, so "
            f"which eigenvectors stand for it is one choice among many; {_whole_clusters(*whole)} keeps it whole."
        )


def _whole_clusters(before: int, after: int) -> str:
    return f"k = {before} or k = {after}" if before else f"k = {after}"
