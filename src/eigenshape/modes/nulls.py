"""Random maps with the power of a given one on every scale: eigenmodes rotated within groups."""

from typing import Literal

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_choice, require_type
from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.memory import require_memory
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import point_functions
from eigenshape.modes.fits import size_one_maps
from eigenshape.spectral.requirements import require_lowest
from eigenshape.spectral.spectrum import Spectrum
from eigenshape.spectral.tools.filters import project

Residual = Literal["none", "add", "permute"]
Resample = Literal["none", "exact", "affine"]


@one_blas_thread()
def rotation_nulls(
    values: ArrayLike,
    spectrum: Spectrum,
    n_nulls: Integer = 1000,
    *,
    rng: np.random.Generator,
    residual: Residual = "none",
    resample: Resample = "none",
) -> Float[np.ndarray, "n nulls ..."]:
    """Draw random maps with the spatial autocorrelation of a map (eigenstrapping).

    Koussis and others (2025): modes fall into groups of 1, 3, 5, ... as the harmonics of a sphere
    do. In each group the coefficients c of the map, weighted by the roots of the eigenvalues, are
    rotated at random: c' = Λ^{-1/2} Q Λ^{1/2} c, with Q uniform in SO(2l + 1). So the energy
    Σ λ c² of each group is that of the map. The constant mode stays.

    Q itself is never made. A rotated vector is uniform on a sphere; rotated vectors of q maps are a
    uniform frame of at most q columns, which costs q columns of random numbers instead of 2l + 1.

    Parameters
    ----------
    values : (n,) or (n, q) float
        One map, or q maps, to which the same rotations are applied.
    spectrum : Spectrum
        From the lowest eigenvalue on, of a connected shape. The first l² modes are used, with the
        largest l for which there are as many: 400 of 420.
    n_nulls : int
    rng : numpy.random.Generator
    residual : {"none", "add", "permute"}
        What the modes leave of the map is left out, added, or added in random order.
    resample : {"none", "exact", "affine"}
        Whether a null is given the values of the map in its own order of ranks, or the mean and
        standard deviation of the map in the mass.

    Returns
    -------
    (n, n_nulls) or (n, n_nulls, q) float
        In the unit of the values.

    Raises
    ------
    InvalidParameterError
        If `values` does not hold one finite number per point; the spectrum does not begin with the
        lowest eigenvalue, has fewer than 4 modes, or is of several components; an option is none of
        the three; or the nulls do not fit into memory.

    Examples
    --------
    Is a map correlated with the height by more than chance? Here it is.

    >>> import numpy as np, eigenshape as es
    >>> mesh = es.make_creature("quadruped", n_vertices=700)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 49)
    >>> height = mesh.vertices[:, 1]
    >>> noise = np.random.default_rng(0).normal(size=len(height))
    >>> nulls = es.modes.rotation_nulls(height, spectrum, 99, rng=np.random.default_rng(1))
    >>> measured = np.corrcoef(height, height + 0.1 * noise)[0, 1]
    >>> by_chance = np.corrcoef(nulls.T, height + 0.1 * noise)[-1, :-1]
    >>> n_as_large = np.count_nonzero(abs(by_chance) >= measured)
    >>> (1 + int(n_as_large)) / (1 + 99)  # the p-value
    0.01
    """
    require_lowest(spectrum, "spectrum")
    require_type(rng, np.random.Generator, "rng")
    count = whole_number(n_nulls, "n_nulls", 1)
    require_choice(residual, Residual, "residual")
    require_choice(resample, Resample, "resample")
    n = len(spectrum.eigenvectors)
    maps = point_functions(values, "values", n)
    columns, exponents = size_one_maps(maps.reshape(n, -1))
    degrees = int(len(spectrum.eigenvalues) ** 0.5)
    if degrees < 2:
        raise InvalidParameterError(
            f"Rotations need at least 4 modes; there are {len(spectrum.eigenvalues)}."
        )
    n_constant = spectrum.n_zero_modes
    if n_constant != 1:
        raise InvalidParameterError(
            f"Rotations need one constant mode, that of a connected shape; there are {n_constant}. "
            "Use each component for itself."
        )
    size = 8.0 * n * count * columns.shape[1]
    require_memory(
        "Nulls",
        f"{count} nulls of {columns.shape[1]} maps",
        {"values": size, "work": size},
        "Draw fewer at a time: the generator goes on where it was.",
    )

    coefficients = project(columns, spectrum)[: degrees**2]
    drawn = np.empty((degrees**2, count, columns.shape[1]))
    drawn[0] = coefficients[0]
    for degree in range(1, degrees):
        group = slice(degree**2, (degree + 1) ** 2)
        roots = np.sqrt(spectrum.eigenvalues[group])[:, None]
        rotated = _rotate(roots * coefficients[group], count, rng)
        drawn[group] = rotated / roots[:, :, None]
    modes = spectrum.eigenvectors[:, : degrees**2]
    nulls = (modes @ drawn.reshape(degrees**2, -1)).reshape(n, count, -1)

    if residual != "none":
        rest = columns - modes @ coefficients
        for index in range(count):
            nulls[:, index] += rest if residual == "add" else rng.permutation(rest, axis=0)
    if resample == "exact":
        # Each null takes the values of the map, the smallest where the null is smallest.
        ascending = np.sort(columns, axis=0)
        for index in range(count):
            null = nulls[:, index]
            np.put_along_axis(null, np.argsort(null, axis=0), ascending, axis=0)
    elif resample == "affine":
        mean, square = _moments(columns, spectrum)
        for index in range(count):
            null = nulls[:, index]
            own_mean, own_square = _moments(null, spectrum)
            null[:] = mean + (null - own_mean) * np.sqrt(square / own_square)
    np.ldexp(nulls, exponents, out=nulls)
    return nulls if maps.ndim == 2 else nulls[:, :, 0]


def _rotate(
    vectors: Float[np.ndarray, "d q"], count: int, rng: np.random.Generator
) -> Float[np.ndarray, "d nulls q"]:
    """Return random rotations of q vectors in R^d, d at least 3."""
    frame, triangle = np.linalg.qr(vectors)  # d ≥ r columns
    size, rank = frame.shape
    gauss = rng.standard_normal((count, size, rank))
    if rank == 1:
        drawn = gauss / np.linalg.norm(gauss, axis=1, keepdims=True)
    else:
        # Uniform by the invariance of the normal distribution, once the signs of R are fixed
        # (Mezzadri 2007).
        drawn, upper = np.linalg.qr(gauss)
        drawn *= np.copysign(1.0, np.diagonal(upper, axis1=1, axis2=2))[:, None, :]
    if rank == size:
        # Q = drawn · frameᵀ is a rotation, not a reflection, for frames of one orientation.
        drawn[:, :, -1] *= (np.linalg.det(drawn) * np.linalg.det(frame))[:, None]
    return np.asarray((drawn @ triangle).transpose(1, 0, 2))


def _moments(
    maps: Float[np.ndarray, "n q"], spectrum: Spectrum
) -> tuple[Float[np.ndarray, " q"], Float[np.ndarray, " q"]]:
    """Return the means of maps and the integrals of their squared deviations."""
    areas = spectrum.mass.sum(axis=1)
    mean = areas @ maps / areas.sum()
    deviations = maps - mean
    return mean, np.sum(deviations * (spectrum.mass @ deviations), axis=0)
