"""Maps by eigenmodes: fits where a map is known on a part of a shape, and how good they are."""

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import real_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import point_functions, vertex_values
from eigenshape._vectors import size_one
from eigenshape.spectral.spectrum import Spectrum

# Least eigenvalue of ΦᵀDΦ, relative to the largest, at which weighted points still tell modes apart.
TOLD_APART = 1e-10
# Variance of a reconstruction, as a share of its square, below which it counts as constant.
CONSTANT = 1e-12


@one_blas_thread()
def fit_modes(
    values: ArrayLike, spectrum: Spectrum, weights: ArrayLike
) -> Float[np.ndarray, "k ..."]:
    """Fit maps by eigenmodes where some points count less than others, or not at all.

    Minimizes Σ_i w_i b_i (x_i - Σ_j c_j φ_j(i))², with b the row sums of the mass. With a weight of
    0 on points without data, such as a medial wall, the rest determines the coefficients.

    Parameters
    ----------
    values : (n,) or (n, q) float
        One or q maps. Where the weight is 0 they are ignored, and may be NaN.
    spectrum : Spectrum
        k eigenpairs on n points.
    weights : (n,) float or bool
        At least 0; True and False count as 1 and 0.

    Returns
    -------
    (k,) or (k, q) float
        Coefficients, which `es.spectral.reconstruct` takes.

    Raises
    ------
    InvalidParameterError
        If `values` does not hold one number per point, finite where the weight is not 0; a weight
        is negative or not finite; or the points with weight do not tell the k modes apart.

    See Also
    --------
    es.spectral.project : Coefficients of maps that are known everywhere.
    accuracy_curve : How good fits by 1, 2, ..., k modes are.

    Examples
    --------
    A function is known on the upper three quarters of a sphere:

    >>> import numpy as np, eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 9)
    >>> height = np.where(mesh.vertices[:, 2] > -0.5, mesh.vertices[:, 2], np.nan)
    >>> found = es.modes.fit_modes(height, spectrum, ~np.isnan(height))
    >>> whole = es.spectral.reconstruct(found, spectrum)
    >>> bool(abs(whole - mesh.vertices[:, 2]).max() < 0.02)
    True
    """
    require_type(spectrum, Spectrum, "spectrum")
    shares = _point_weights(weights, spectrum)
    maps = _known_maps(values, shares)
    triangle, right = _normal_equations(maps, spectrum, shares)
    return np.asarray(sl.solve_triangular(triangle, right, trans="T", lower=True))


@one_blas_thread()
def accuracy_curve(
    values: ArrayLike, spectrum: Spectrum, *, weights: ArrayLike | None = None
) -> Float[np.ndarray, "k ..."]:
    """Compute how well maps are reconstructed by the first 1, 2, ..., k eigenmodes.

    The accuracy is the correlation of a map with its reconstruction (Pang and others 2023), in the
    inner product of the mass: each point counts as much as its area. A reconstruction that is
    constant has accuracy 0. All k fits come from one factor, since the least-squares equations of
    the first modes are a part of those of all.

    Parameters
    ----------
    values : (n,) or (n, q) float
        One or q maps.
    spectrum : Spectrum
        k eigenpairs on n points, from the lowest on.
    weights : (n,) float or bool, optional
        As in `fit_modes`: where the weight is 0 a map may be NaN.

    Returns
    -------
    (k,) or (k, q) float
        Entry j is the accuracy with j + 1 modes, from -1 to 1; NaN for a map that is constant.

    Raises
    ------
    InvalidParameterError
        As in `fit_modes`.

    See Also
    --------
    es.spectral.project, es.spectral.reconstruct, fit_modes : The fits themselves.

    Examples
    --------
    The height of a sphere is a sum of the modes 1 to 3:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(4)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 9)
    >>> es.modes.accuracy_curve(mesh.vertices[:, 2], spectrum)[[0, 3, 8]].round(3).tolist()
    [0.0, 1.0, 1.0]
    """
    require_type(spectrum, Spectrum, "spectrum")
    modes, mass = spectrum.eigenvectors, spectrum.mass
    ones = np.ones(len(modes))
    if weights is None:
        maps = size_one_maps(point_functions(values, "values", len(modes)))[0]
        # In the mass, modes are orthonormal: what follows with a factor of 1.
        shares = mass @ ones
        weighted = mass @ maps
        inner, of_ones = modes.T @ weighted, modes.T @ shares
    else:
        shares = _point_weights(weights, spectrum)
        maps = size_one_maps(_known_maps(values, shares))[0]
        weighted = (shares * maps.T).T
        triangle, inner = _normal_equations(maps, spectrum, shares)
        of_ones = sl.solve_triangular(triangle, modes.T @ shares, lower=True)
    # The fit x_j by j modes is a projection, so <x_j, x> = <x_j, x_j> = the sum of j squares.
    total = shares.sum()
    squares = np.cumsum(inner**2, axis=0)
    mean_of_fit = np.cumsum((of_ones * inner.T).T, axis=0) / total
    mean = shares @ maps / total
    shared = squares - total * mean_of_fit * mean
    spread = squares - total * mean_of_fit**2
    centered = maps - mean
    weighted_centered = mass @ centered if weights is None else (shares * centered.T).T
    own = np.sum(centered * weighted_centered, axis=0)
    varies = spread > CONSTANT * squares
    own = np.where(own > CONSTANT * np.sum(maps * weighted, axis=0), own, np.nan)
    root = np.sqrt(np.where(varies, spread, 1.0) * own)
    return np.where(varies, shared, 0.0 * own) / root


def size_one_maps(
    maps: Float[np.ndarray, "n ..."],
) -> tuple[Float[np.ndarray, "n ..."], Int[np.ndarray, "..."]]:
    """Return maps divided by powers of two, so that squares do not overflow, and the exponents."""
    exponents = np.frexp(np.abs(maps).max(axis=0, keepdims=True))[1]
    return np.ldexp(maps, -exponents), exponents


def _point_weights(weights: ArrayLike, spectrum: Spectrum) -> Float[np.ndarray, " n"]:
    """Return w_i b_i."""
    mass = spectrum.mass.sum(axis=1)
    given = vertex_values(weights, "weights", len(mass))
    bad = np.flatnonzero(given < 0)
    if bad.size:
        raise InvalidParameterError(
            f"weights must not be negative; entry {bad[0]} is {given[bad[0]]} ({bad.size} such)."
        )
    return np.asarray(size_one(given)[0] * mass)  # only their ratios count


def _known_maps(values: ArrayLike, shares: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n ..."]:
    """Return maps with 0 where the weight is 0."""
    maps = np.array(real_numbers(values, "values"), dtype=np.float64)
    if maps.shape[:1] == shares.shape:
        maps[shares == 0] = 0.0
    return point_functions(maps, "values", len(shares))


def _normal_equations(
    maps: Float[np.ndarray, "n ..."], spectrum: Spectrum, shares: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, "k k"], Float[np.ndarray, "k ..."]]:
    """Return L of ΦᵀDΦ = L Lᵀ, and L⁻¹ΦᵀD x."""
    modes = spectrum.eigenvectors
    gram = modes.T @ (shares[:, None] * modes)
    least, *_, largest = np.linalg.eigvalsh(gram)[[0, -1]]
    if not least > TOLD_APART * largest:
        raise InvalidParameterError(
            f"The points with a weight must tell {len(gram)} modes apart; the least eigenvalue of "
            f"ΦᵀDΦ is {least:.1e}, the largest {largest:.1e}. Give weight to more points, or "
            "compute fewer modes."
        )
    triangle = sl.cholesky(gram, lower=True)
    return triangle, sl.solve_triangular(triangle, modes.T @ (shares * maps.T).T, lower=True)
