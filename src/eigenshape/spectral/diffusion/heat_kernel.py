"""The heat kernel and the heat trace of a spectrum (thesis 2.3)."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, freeze, record, whole_numbers
from certeig.kit.memory import require_memory
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape.spectral.diffusion.decay import decay_factors
from eigenshape.spectral.spectrum import Spectrum


@one_blas_thread()
def heat_kernel(
    spectrum: Spectrum, x: ArrayLike, y: ArrayLike | None, t: ArrayLike
) -> Float[np.ndarray, "..."]:
    """Compute entries of the heat kernel: how much of the heat put at y is at x after a time.

    h_t(x, y) = Σ_i exp(-t λ_i) φ_i(x) φ_i(y)                    (thesis 2.3; McKean, Singer 1967)

    is the density of the heat operator: (H_t f)(x) = ∫ h_t(x, y) f(y) dy, on a mesh h_t B f. It is
    symmetric. `heat_kernel_signature` is its diagonal, h_t(x, x).

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs. The pairs beyond k contribute at most exp(-t λ_k) / √(b_x b_y), with b_x the
        mass of point x.
    x : int or (a,) int
        Points.
    y : int, (b,) int or None
        Points; None for all of them.
    t : float or (q,) float
        Diffusion times, in length², > 0.

    Returns
    -------
    (a, b, q) float, without the axes of single numbers
        Heat per unit mass, in 1/length^dim.

    Raises
    ------
    InvalidParameterError
        If a point is out of range, a time is not positive and finite, the spectrum does not begin
        with the lowest eigenvalue, or the result would take more than half of the memory.

    See Also
    --------
    apply_heat : The heat operator on functions.

    Examples
    --------
    Heat from point 0 of a sphere, at all points; most of it is still at point 0:

    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(3)), 50)
    >>> heat = es.spectral.heat_kernel(spectrum, 0, None, 0.2)
    >>> heat.shape, int(heat.argmax())
    ((642,), 0)
    >>> round(float(spectrum.mass.diagonal() @ heat), 6)  # the total heat
    1.0
    """
    decay = decay_factors(spectrum, t, "t")
    n = len(spectrum.eigenvectors)
    rows = _points(x, "x", n)
    columns = np.arange(n) if y is None else _points(y, "y", n)
    size = len(rows) * len(columns) * decay.shape[1]
    require_memory(
        "A heat kernel",
        f"{size:.3g} entries",
        {"entries": 8.0 * size},
        "Ask for fewer points, or use apply_heat.",
        share=0.5,
    )
    kernel = np.empty((len(rows), len(columns), decay.shape[1]))
    left, right = spectrum.eigenvectors[rows], spectrum.eigenvectors[columns].T
    for place, factors in enumerate(decay.T):
        kernel[:, :, place] = (left * factors) @ right
    single = np.ndim(x) == 0, y is not None and np.ndim(y) == 0, np.ndim(t) == 0
    return np.squeeze(kernel, axis=tuple(axis for axis in range(3) if single[axis]))


def _points(value: ArrayLike, name: str, n: int) -> Int[np.ndarray, " a"]:
    return whole_numbers(value, f"a point of {name}", 0, n - 1)


@record
class HeatTrace(ReadOnly):
    """The heat trace of an operator at some times, with a bound of what is missing.

    Attributes
    ----------
    times : (q,) float
        In length².
    values : (q,) float
        Σ_{i ≤ k} exp(-t λ_i), without unit.
    remainders : (q,) float
        The trace of the operator on all its n points is between `values` and values + remainders.

    See Also
    --------
    es.spectral.heat_trace : Compute the trace.
    es.spectral.recover_geometry : What the trace says about a surface.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 40)
    >>> trace = es.spectral.heat_trace(spectrum, [0.5, 2.0])
    >>> trace.values.shape, bool((trace.remainders < 1e-4).all())
    ((2,), True)
    """

    times: Float[np.ndarray, " q"]
    values: Float[np.ndarray, " q"]
    remainders: Float[np.ndarray, " q"]


def heat_trace(spectrum: Spectrum, times: ArrayLike) -> HeatTrace:
    """Compute the heat trace, the sum of exp(-t λ) over all eigenvalues, and bound what is missing.

    Z(t) = Σ_i exp(-t λ_i) = ∫ h_t(x, x) dx              (McKean, Singer 1967)

    Only the k lowest eigenvalues are known. The n - k others are at least λ_k, so they add at most
    (n - k) exp(-t λ_k), if the spectrum is certified. That bound is for the operator of n points.
    The surface has infinitely many eigenvalues; by Weyl's law those beyond λ_k add about
    k exp(-t λ_k) / (t λ_k), far less. Eigenvalues of a mesh are not those of the smooth surface
    either: an error of δ in λ changes its term by t δ exp(-t λ).

    Parameters
    ----------
    spectrum : Spectrum
        The k lowest eigenpairs of an operator on n points.
    times : (q,) float
        Diffusion times, in length², all > 0.

    Returns
    -------
    HeatTrace

    Raises
    ------
    InvalidParameterError
        If a time is not positive and finite, or the spectrum does not begin with the lowest
        eigenvalue.

    Examples
    --------
    On the unit sphere Z(1) = Σ (2l + 1) e^{-l(l+1)} = 1.418443:

    >>> import eigenshape as es
    >>> laplacian = es.cotangent_laplacian(es.icosphere(3), "averaged")
    >>> trace = es.spectral.heat_trace(es.solve_spectrum(laplacian, 49), [1.0])
    >>> trace.values.round(2).tolist()
    [1.42]
    >>> bool(trace.remainders[0] < 1e-12)
    True
    """
    decay = decay_factors(spectrum, times)
    n, k = spectrum.eigenvectors.shape
    moments = np.atleast_1d(np.asarray(times, dtype=np.float64))
    return HeatTrace(freeze(moments), freeze(decay.sum(axis=0)), freeze((n - k) * decay[-1]))
