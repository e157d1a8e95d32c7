"""Conversion between the eigenvalues of a kernel's pencil and the eigenvalues of Δ that they approximate.

On flat space an operator with a Gaussian kernel is (1 - e^{-tΔ})/t: its eigenvalue is μ = (1 -
e^{-tλ})/t, and λ = -log(1 - tμ)/t. Near 1/t all λ are close together and cannot be distinguished.
"""

import warnings
from dataclasses import replace

import numpy as np
from jaxtyping import Float

import certeig
from certeig.kit.errors import InvalidParameterError
from eigenshape.operators.laplacian import GaussianKernel
from eigenshape.spectral.certificate import Certificate

Values = Float[np.ndarray, " k"]

# t μ at t λ = 2.9, beyond which corrected eigenvalues cannot be distinguished: on a surface that is
# the k-th eigenvalue of n = 5 k t/e² points.
LAST_CORRECTED = 0.945
# t μ from which eigenvalues of the literal form do not depend on λ: n = 21 k t/e².
ESSENTIAL = 0.5
# t μ at t λ = 0.2, where the bias is ten per cent: n = 72 k t/e².
BIASED = 0.181


def to_pencil(kernel: GaussianKernel | None, values: Values) -> Values:
    """Return the eigenvalues μ of the pencil for reported ones."""
    return (
        -np.expm1(-kernel.t * values) / kernel.t
        if kernel is not None and kernel.corrected
        else values
    )


def require_readable(kernel: GaussianKernel | None, values: Values, *, stacklevel: int = 3) -> None:
    """Raise an error for corrected eigenvalues of 1/t or more, and warn of inaccurate ones.

    Raises an InvalidParameterError with the first eigenvalue that has no counterpart of Δ.
    """
    if kernel is None:
        return
    top = 1 / kernel.t / kernel.volume
    shares = values / top
    beyond = np.flatnonzero(shares >= 1 - 1e-9)
    if kernel.corrected and beyond.size:
        raise InvalidParameterError(
            f"An eigenvalue to be corrected must lie below 1/t; eigenvalue {beyond[0]} of the pencil is "
            f"{values[beyond[0]]:.6g} and 1/t is {1 / kernel.t:.6g}. Request k ≤ {beyond[0]}, or choose a smaller t."
        )
    limit = LAST_CORRECTED if kernel.corrected else ESSENTIAL
    late = int(np.count_nonzero(shares <= limit))
    if late < len(values):
        advice = (
            "k eigenvalues of a surface need n > 5 k t/e² points"
            if kernel.corrected
            else f"k eigenvalues of a surface need n > 21 k t/e² points, and 72 k t/e² for errors below 10 %, as the "
            f"first {np.count_nonzero(shares <= BIASED)} have; or pass correct='log'"
        )
        limit_name = "1/t" if kernel.volume == 1 else "1/(t × volume)"
        warnings.warn(
            f"Eigenvalues from number {late} on are too close to {limit_name} = "
            f"{top:.4g} to represent those of the "
            f"shape: {advice}. Choose a smaller t, or more points.",
            stacklevel=stacklevel,
        )


def from_pencil(kernel: GaussianKernel | None, values: Values) -> Values:
    """Convert eigenvalues μ of the pencil to reported ones: λ if the kernel is corrected, otherwise μ."""
    return (
        -np.log1p(-kernel.t * values) / kernel.t
        if kernel is not None and kernel.corrected
        else values
    )


def user_residuals(
    kernel: GaussianKernel | None,
    values: Values,
    residuals: Values,
) -> Values:
    """Return the error intervals of reported eigenvalues from those of the pencil's."""
    if kernel is None or not kernel.corrected:
        return residuals
    with np.errstate(divide="ignore", invalid="ignore"):
        above = from_pencil(kernel, np.minimum(values + residuals, 1 / kernel.t))
    return above - from_pencil(kernel, values)


def user_certificate(
    kernel: GaussianKernel | None, certificate: certeig.Certificate, last: float
) -> Certificate:
    """Return a certificate whose shift, gap and resolution are in the values that are reported.

    `last` is the largest eigenvalue of the pencil that was found. A shift at 1/t or beyond is moved
    down in its gap, where it counts the same eigenvalues.
    """
    certificate = Certificate(**vars(certificate))
    if kernel is None or not kernel.corrected:
        return certificate
    (low, high), shift, top = certificate.gap, certificate.shift, 1 / kernel.t
    resolution = certificate.resolution / (1 - kernel.t * last)
    if np.isfinite(shift):
        shift = shift if shift < top else (max(low, last) + top) / 2
        high = min(high, (shift + top) / 2)
    floor, low, shift, high = (
        float(from_pencil(kernel, np.array([end]))[0]) if np.isfinite(end) else end
        for end in (certificate.floor, low, shift, high)
    )
    return replace(certificate, floor=floor, shift=shift, gap=(low, high), resolution=resolution)
