"""A model of connections between places, by the geometry of the surface alone."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import as_array, positive_values, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.memory import require_memory
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape.spectral.spectrum import Spectrum


@one_blas_thread()
def geometric_connectome(
    spectrum: Spectrum,
    *,
    length_scale: float = 9.53,
    n_modes: Integer = 108,
    labels: ArrayLike | None = None,
) -> Float[np.ndarray, "p p"]:
    """Model the strength of connections by the Green's function of damped waves.

    The weight of two places is Σ_j φ_j(x) φ_j(y) / (1 + r²λ_j) over the lowest modes (Normand and
    others 2025), 0 where that is negative and from a place to itself, divided by the largest weight.
    Modes are orthonormal in the mass here, so that places of any area have equal rights; a
    pseudo-inverse in the plain inner product, as in neuromodes, gives other weights where triangles
    are of different sizes.

    Parameters
    ----------
    spectrum : Spectrum
        At least `n_modes` pairs on n points.
    length_scale : float
        r, in the unit of the coordinates: the default is that of human cortex in mm.
    n_modes : int
    labels : (n,) int, optional
        Parcel of each point, from 0; points with -1 belong to none. Modes are averaged over parcels
        by area first, so the weights are those of parcels.

    Returns
    -------
    (n, n) or (parcels, parcels) float
        Symmetric, 0 to 1.

    Raises
    ------
    InvalidParameterError
        If there are fewer modes, a label is less than -1 or missing, the scale is not positive, or
        the matrix does not fit into memory.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 30)
    >>> weights = es.modes.geometric_connectome(spectrum, length_scale=0.5, n_modes=30)
    >>> weights.shape, weights.max().item(), bool((weights == weights.T).all())
    ((162, 162), 1.0, True)
    """
    require_type(spectrum, Spectrum, "spectrum")
    count = whole_number(n_modes, "n_modes", 1, len(spectrum.eigenvalues))
    (scale,) = positive_values(length_scale, "length_scale")
    modes = spectrum.eigenvectors[:, :count]
    if labels is not None:
        modes = _parcel_means(modes, spectrum.mass.sum(axis=1), labels)
    n = len(modes)
    require_memory("A connectome", f"{n} places", {"weights": 16.0 * n * n}, "Pass labels.")
    halves = modes / np.sqrt(1 + scale**2 * spectrum.eigenvalues[:count])
    weights = np.maximum(halves @ halves.T, 0.0)
    np.fill_diagonal(weights, 0.0)
    largest = weights.max()
    return np.asarray(weights / largest if largest > 0 else weights)


def _parcel_means(
    modes: Float[np.ndarray, "n k"], areas: Float[np.ndarray, " n"], labels: ArrayLike
) -> Float[np.ndarray, "p k"]:
    """Return the means of modes over parcels, by area."""
    parcels = as_array(labels, "labels")
    if parcels.shape != areas.shape or parcels.dtype.kind not in "iu":
        raise InvalidParameterError(
            f"labels must hold one whole number per point, shape {areas.shape}; the shape is {parcels.shape} and "
            f"the type {parcels.dtype}."
        )
    named = parcels >= 0
    sizes = np.bincount(parcels[named], areas[named])
    bad = np.flatnonzero(sizes == 0)
    if bad.size or not sizes.size or parcels.min() < -1:
        fact = f"label {bad[0]} has no points" if bad.size else f"the least is {parcels.min()}"
        raise InvalidParameterError(f"labels must be 0, 1, 2, ..., or -1 for none; {fact}.")
    columns = [np.bincount(parcels[named], (areas * mode)[named]) for mode in modes.T]
    return np.column_stack(columns) / sizes[:, None]
