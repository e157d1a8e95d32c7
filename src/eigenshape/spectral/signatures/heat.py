"""Heat kernel signatures: how much heat remains at each point."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import positive_values, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape.spectral.diffusion.decay import decay_factors
from eigenshape.spectral.spectrum import Spectrum

# Relative difference between steps of log t up to which times count as a geometric sequence; the
# rounding of numpy.geomspace stays far below it.
EQUAL_STEPS = 1e-9
MOST_TIMES = 1_000_000  # a signature holds each for each point
N_TIMES = 100  # times by default, as in Sun, Ovsjanikov and Guibas 2009


def positive_eigenvalues(spectrum: Spectrum) -> Float[np.ndarray, " k"]:
    """Return the eigenvalues above 0; each component of the shape has one eigenvalue 0.

    Raise InvalidParameterError if no eigenvalue is above 0.
    """
    values = spectrum.eigenvalues
    positive = values[spectrum.n_zero_modes :]
    if not positive.size:
        raise InvalidParameterError(
            f"The spectrum must have an eigenvalue above 0; its {len(values)} are all 0, one for each "
            f"component of the shape. Increase k."
        )
    return positive


def default_times(spectrum: Spectrum, n_times: Integer = N_TIMES) -> Float[np.ndarray, " q"]:
    """Return diffusion times in geometric sequence that suit a spectrum.

    The times range from 4 ln 10 / λ_k to 4 ln 10 / λ_1, with λ_1 the first eigenvalue above 0 (Sun,
    Ovsjanikov, Guibas 2009, section 5): exp(-tλ_k) is 1e-4 at the first time, and exp(-tλ_1) is
    1e-4 at the last. They scale with the shape.

    Parameters
    ----------
    spectrum : Spectrum
    n_times : int
        At least 2.

    Returns
    -------
    (q,) float
        In length², ascending.

    Raises
    ------
    InvalidParameterError
        If `n_times` is not in 2..1,000,000, or no eigenvalue is above 0.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 9)
    >>> es.spectral.default_times(spectrum, 3).round().tolist()
    [2.0, 3.0, 5.0]
    """
    require_type(spectrum, Spectrum, "spectrum")
    values = positive_eigenvalues(spectrum)
    count = whole_number(n_times, "n_times", 2, MOST_TIMES, "each takes a number for each point")
    return 4 * np.log(10) / np.geomspace(values[-1], values[0], count)


@one_blas_thread()
def heat_kernel_signature(spectrum: Spectrum, times: ArrayLike) -> Float[np.ndarray, "n q"]:
    """Compute the heat kernel signature: the heat that remains at each point after each time.

    h_t(x, x) = Σ_i exp(-t λ_i) φ_i(x)²          (thesis eq. 5.1; Sun, Ovsjanikov, Guibas 2009)

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs. The pairs beyond k contribute at most exp(-t λ_k) / b_x at point x, with b_x
        the mass of the point.
    times : (q,) float
        Diffusion times, in length², all > 0.

    Returns
    -------
    (n, q) float
        Heat per unit mass, in 1/length^dim.

    Raises
    ------
    InvalidParameterError
        If a time is not positive and finite, or the spectrum does not begin with the lowest
        eigenvalue.

    See Also
    --------
    wave_kernel_signature : Signature of one frequency band at a time.
    es.spectral.heat_kernel : Heat between different points; this is the diagonal.
    merge_tree, segment : Segment a shape by its heat.

    Examples
    --------
    On a sphere all points are alike, and after a long time the heat is spread over the area 4π:

    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(3)), 50)
    >>> heat = es.heat_kernel_signature(spectrum, [0.1, 10.0])
    >>> heat.shape
    (642, 2)
    >>> (heat[:3, 1] * 12.566).round(2).tolist()
    [1.0, 1.0, 1.0]
    """
    decay = decay_factors(spectrum, times)
    return spectrum.eigenvectors**2 @ decay


@one_blas_thread()
def reflection_free_signature(
    neumann: Spectrum, dirichlet: Spectrum, times: ArrayLike
) -> Float[np.ndarray, "n q"]:
    """Compute the heat kernel signature of a surface without the effect of its boundary.

    The Neumann condition reflects heat at a boundary, and the Dirichlet condition absorbs it. Near
    a straight boundary the two kernels are that of the whole plane plus and minus the same mirror
    image (the method of images), so their mean contains no mirror image.

    Parameters
    ----------
    neumann, dirichlet : Spectrum
        Of one surface, from `solve_spectrum`, without and with its boundary fixed.
    times : (q,) float
        Diffusion times, in length², all > 0.

    Returns
    -------
    (n, q) float
        Heat per unit mass, in 1/length^dim.

    Raises
    ------
    InvalidParameterError
        If a time is not positive and finite, or the spectra have different numbers of points.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(20, 20)
    >>> laplacian, boundary = es.cotangent_laplacian(mesh), es.geometry.boundary_vertices(mesh)
    >>> free = es.solve_spectrum(laplacian, 60)
    >>> fixed = es.solve_spectrum(laplacian, 60, fixed=boundary)
    >>> es.spectral.reflection_free_signature(free, fixed, [0.02]).shape
    (441, 1)
    """
    require_type(neumann, Spectrum, "neumann")
    require_type(dirichlet, Spectrum, "dirichlet")
    sizes = len(neumann.eigenvectors), len(dirichlet.eigenvectors)
    if sizes[0] != sizes[1]:
        raise InvalidParameterError(
            f"Both spectra must be of the same surface; they have {sizes[0]} and {sizes[1]} points."
        )
    return (heat_kernel_signature(neumann, times) + heat_kernel_signature(dirichlet, times)) / 2


@one_blas_thread()
def scale_invariant_signature(
    spectrum: Spectrum, times: ArrayLike | None = None, *, n_frequencies: Integer = 6
) -> Float[np.ndarray, "n frequencies"]:
    """Compute a heat kernel signature that does not depend on the size of the shape.

    |F[d/dτ log h(x, α^τ)](ω)|             (Bronstein and Kokkinos 2010; thesis reference 36)

    On a surface β times as large h'(x, t) = h(x, t/β²) / β². In log h the factor is a constant,
    which the derivative removes. The change of time is a shift in τ, which the modulus of the
    Fourier transform F removes, up to effects at the first and last time.

    Parameters
    ----------
    spectrum : Spectrum
    times : (q,) float, optional
        In geometric sequence, in length². The default is `default_times(spectrum)`, with which the
        invariance is exact. Fixed times make parts comparable with whole shapes.
    n_frequencies : int
        Number of lowest frequencies ω = 0, 1, ... to return, at most q/2. The first one is the
        total decrease of log h.

    Returns
    -------
    (n, frequencies) float
        Without unit.

    Raises
    ------
    InvalidParameterError
        If the times are not a geometric sequence of at least 3 positive numbers, or `n_frequencies`
        is more than q/2.

    Examples
    --------
    >>> import eigenshape as es
    >>> from numpy import allclose
    >>> small = es.shapes.torus(24, 12)
    >>> large = es.TriangleMesh(7 * small.vertices, small.faces)
    >>> one, two = (
    ...     es.spectral.scale_invariant_signature(es.solve_spectrum(es.cotangent_laplacian(m), 30))
    ...     for m in (small, large)
    ... )
    >>> allclose(one, two)
    True
    """
    require_type(spectrum, Spectrum, "spectrum")
    moments = default_times(spectrum) if times is None else positive_values(times, "times")
    steps = np.diff(np.log(moments))
    if len(moments) < 3 or np.ptp(steps) > EQUAL_STEPS * np.abs(steps).max():
        raise InvalidParameterError(
            f"times must be a geometric sequence of at least 3; there are {len(moments)}, with ratios of neighbors "
            f"from {np.exp(steps.min(initial=0.0)):.6g} to {np.exp(steps.max(initial=0.0)):.6g}. Use numpy.geomspace."
        )
    kept = whole_number(n_frequencies, "n_frequencies", 1, len(moments) // 2)
    falls = np.diff(np.log(heat_kernel_signature(spectrum, moments)), axis=1)
    return np.abs(np.fft.rfft(falls, axis=1))[:, :kept]
