"""Eigenmodes of one shape turned to those of another."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape.spectral.comparison.eigenspaces import (
    SEPARATED,
    corresponding_points,
    orthonormal,
    principal_angles,
    separated_groups,
)
from eigenshape.spectral.requirements import require_lowest
from eigenshape.spectral.spectrum import Spectrum

# Angle between a direction of a group and the reference, beyond which the direction is as much of
# other modes as of its own group: half a right angle.
LOST = np.pi / 4


@record
class ModeAlignment(ReadOnly):
    """Modes of a shape, turned within groups towards those of a reference.

    Attributes
    ----------
    modes : (n, k) float
        Orthonormal in the mass of the shape. Within a group they span what the eigenvectors span.
    turns : (k, k) float
        Orthogonal: modes = eigenvectors · turns. Zero between groups.
    starts, stops : (g,) int
        Group j consists of the modes number starts[j] to stops[j] - 1.
    angles : (k,) float
        Principal angles between the spaces of each group, ascending within the group, in radians, 0
        to π/2.

    See Also
    --------
    align_modes : Align the modes of a spectrum.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 9)
    >>> es.modes.align_modes(spectrum, spectrum).stops.tolist()
    [1, 4, 9]
    """

    modes: Float[np.ndarray, "n k"]
    turns: Float[np.ndarray, "k k"]
    starts: Int[np.ndarray, " g"]
    stops: Int[np.ndarray, " g"]
    angles: Float[np.ndarray, " k"]

    @property
    def lost(self) -> Int[np.ndarray, " h"]:
        """Groups that the reference does not have: an angle above 45° lies between the spaces."""
        worst = np.array([self.angles[stop - 1] for stop in self.stops])
        return np.flatnonzero(worst > LOST)

    def explain(self) -> str:
        """Return a text that says how far spaces turn, and which modes cannot be told apart."""
        sizes = self.stops - self.starts
        n_joint = int(sizes[sizes > 1].sum())
        text = (
            f"{len(self.angles)} modes in {len(sizes)} groups turn by {np.degrees(np.median(self.angles)):.3g}° in "
            f"the median and by at most {np.degrees(self.angles.max()):.3g}°. "
        )
        if n_joint:
            text += f"{n_joint} modes lie in groups whose eigenvalues are too close to tell one from another. "
        if len(self.lost):
            start, last = self.starts[self.lost[0]], self.stops[self.lost[0]] - 1
            modes = f"mode {start}" if start == last else f"modes {start} to {last}"
            text += f"{len(self.lost)} groups are not those of the reference; the first is {modes}."
        return text.rstrip()


@one_blas_thread()
def align_modes(
    spectrum: Spectrum,
    reference: Spectrum,
    *,
    points: ArrayLike | None = None,
    ratio: float = SEPARATED,
) -> ModeAlignment:
    """Turn the modes of a shape towards those of a reference, group by group.

    A sign of an eigenvector means nothing, and neither does a basis where eigenvalues are equal or
    close. In each group the orthogonal matrix R = U Vᵀ, with U Σ Vᵀ = ΦᵀBΨ for the modes Ψ of the
    reference at the points of the shape, brings Φ R closest to Ψ (Procrustes; Schönemann 1966).
    arccos Σ are the principal angles between the two spaces (Björck and Golub 1973). Groups end
    where `es.spectral.separated_groups` of both spectra do.

    Parameters
    ----------
    spectrum, reference : Spectrum
        From the lowest eigenvalue on. The first k modes that both have are aligned.
    points : (n,) int, optional
        The point of the reference that corresponds to each point of the shape. The default is the
        point of the same number.
    ratio : float
        As in `es.spectral.separated_groups`.

    Returns
    -------
    ModeAlignment

    Raises
    ------
    InvalidParameterError
        If a spectrum does not begin with the lowest eigenvalue, the points do not fit, or the modes
        of the reference are dependent at these points.

    See Also
    --------
    es.spectral.eigenspace_angles : Bounds of the angles, with the operator.
    es.functional_map : A map between modes that need not keep groups.

    Examples
    --------
    The modes of a torus after one of two equal signs was changed:

    >>> import dataclasses, numpy as np, eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.shapes.torus(24, 12)), 10)
    >>> turned = dataclasses.replace(spectrum, eigenvectors=-spectrum.eigenvectors)
    >>> found = es.modes.align_modes(turned, spectrum)
    >>> bool(abs(found.modes - spectrum.eigenvectors).max() < 1e-9)
    True
    """
    for name, each in (("spectrum", spectrum), ("reference", reference)):
        require_lowest(each, name)
    partners = corresponding_points(points, spectrum, reference, ("spectrum", "reference"))
    k = min(len(spectrum.eigenvalues), len(reference.eigenvalues))
    stops = sorted(
        set.intersection(
            *(
                {group.stop for group in separated_groups(each.eigenvalues[:k], ratio=ratio)}
                for each in (spectrum, reference)
            )
        )
    )
    starts = [0, *stops[:-1]]
    modes, turns, angles = np.empty((len(partners), k)), np.zeros((k, k)), np.empty(k)
    for start, stop in zip(starts, stops, strict=True):
        own = spectrum.eigenvectors[:, start:stop]
        other = reference.eigenvectors[partners, start:stop]
        left, _, right = np.linalg.svd(own.T @ (spectrum.mass @ other))
        turns[start:stop, start:stop] = left @ right
        modes[:, start:stop] = own @ turns[start:stop, start:stop]
        # Modes of another mass or sampling are not orthonormal here, as cosines need them.
        name = f"Eigenvectors {start} to {stop - 1} of reference"
        basis = orthonormal(other, spectrum.mass, name)
        angles[start:stop] = principal_angles(own, basis, spectrum.mass)
    return ModeAlignment(modes, turns, np.array(starts), np.array(stops), angles)
