"""Heat and wave kernels of a spectrum with gradients, also where eigenvalues form groups."""

from typing import Any

import torch
from torch import Tensor

from certeig.kit.arguments import require_type
from certeig.kit.arrays import finite_values, positive_values, whole_numbers
from eigenshape.spectral.spectrum import NULL
from eigenshape.torch.operators import to_numpy
from eigenshape.torch.spectrum import TensorSpectrum


def _constants(values: Any, check: Any, name: str, spectrum: TensorSpectrum) -> Tensor:
    """Return numbers that were checked, as constants beside a spectrum."""
    numbers = check(to_numpy(values) if isinstance(values, Tensor) else values, name)
    return torch.as_tensor(numbers, device=spectrum.eigenvalues.device)


def _off_diagonals(spectrum: TensorSpectrum) -> tuple[Tensor, Tensor]:
    """Return the pairs i < j inside of groups."""
    pairs = [torch.combinations(torch.arange(group.start, group.stop)) for group in spectrum.groups]
    rows, columns = torch.cat(pairs).T.to(spectrum.levels.device)
    return rows, columns


def _diagonal(spectrum: TensorSpectrum, weights: Tensor, slopes: Tensor) -> Tensor:
    """Return the diagonal of Φ f(Λ) Φᵀ for some functions f, (n, q).

    `weights` are f(λ), (k, q), and `slopes` are f'(λ). Inside of a group Λ is not diagonal for long:
    its other entries are 0 and their derivatives are not, and f(Λ)_ij = f'(λ) Λ_ij to first order
    (Daleckii and Krein 1965).
    """
    vectors = spectrum.eigenvectors
    rows, columns = _off_diagonals(spectrum)
    found = vectors**2 @ weights
    if len(rows):
        slope = (slopes[rows] + slopes[columns]) / 2
        entries = slope * spectrum.levels[rows, columns][:, None]
        found = found + 2 * (vectors[:, rows] * vectors[:, columns]) @ entries
    return found


def heat_kernel_signature(spectrum: TensorSpectrum, times: Any) -> Tensor:
    """Compute the heat kernel signature h(x, t) = Σ exp(-tλ_i) φ_i(x)², with gradients.

    Parameters
    ----------
    spectrum : TensorSpectrum
    times : (q,) float
        In length². `es.spectral.default_times` suggests some. Constants of the gradient.

    Returns
    -------
    (n, q) tensor
        In 1/length², the values of `es.heat_kernel_signature`.

    Raises
    ------
    InvalidParameterError
        If a time is not positive. By a backward pass, if k cuts a group.

    Examples
    --------
    >>> import eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(2)
    >>> heat = et.heat_kernel_signature(et.solve_spectrum(ball.vertices, ball.faces, 9), [1.0])
    >>> heat.shape
    torch.Size([162, 1])
    """
    require_type(spectrum, TensorSpectrum, "spectrum")
    moments = _constants(times, positive_values, "times", spectrum)
    levels = spectrum.levels.diagonal()
    weights = torch.exp(-levels[:, None] * moments)
    return _diagonal(spectrum, weights, -moments * weights)


def heat_kernel(spectrum: TensorSpectrum, time: float, sources: Any) -> Tensor:
    """Compute the heat at all points after a time, from a unit of heat at each source, with gradients.

    Parameters
    ----------
    spectrum : TensorSpectrum
    time : float
        In length².
    sources : (s,) int
        Points.

    Returns
    -------
    (s, n) tensor
        Σ exp(-tλ_i) φ_i(source) φ_i(x), in 1/length².

    Raises
    ------
    InvalidParameterError
        If the time is not positive or a source is not a point. By a backward pass, if k cuts a
        group.

    Examples
    --------
    >>> import eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(2)
    >>> spectrum = et.solve_spectrum(ball.vertices, ball.faces, 9)
    >>> heat = et.heat_kernel(spectrum, 1.0, [0])
    >>> round((heat @ spectrum.mass).item(), 9)
    1.0
    """
    require_type(spectrum, TensorSpectrum, "spectrum")
    moment = _constants(time, positive_values, "time", spectrum)[0]
    points = whole_numbers(sources, "A source", 0, len(spectrum.eigenvectors) - 1)
    weights = torch.exp(-spectrum.levels.diagonal() * moment)
    rows, columns = _off_diagonals(spectrum)
    matrix = torch.diag(weights)
    entries = -moment * (weights[rows] + weights[columns]) / 2 * spectrum.levels[rows, columns]
    matrix = matrix.index_put((rows, columns), entries).index_put((columns, rows), entries)
    return spectrum.eigenvectors[points] @ matrix @ spectrum.eigenvectors.T


def wave_kernel_signature(spectrum: TensorSpectrum, energies: Any, sigma: float) -> Tensor:
    """Compute the wave kernel signature w_e(x), with gradients.

    w_e(x) = Σ g(e - log λ_i) φ_i(x)² / Σ g(e - log λ_i), g(d) = exp(-d² / 2σ²), over λ_i above 0.

    Parameters
    ----------
    spectrum : TensorSpectrum
    energies : (q,) float
        Logarithms of eigenvalues in 1/length². `es.spectral.default_energies` suggests some, and σ.
        Constants of the gradient.
    sigma : float
        Standard deviation of the bands, without unit.

    Returns
    -------
    (n, q) tensor
        In 1/length², the values of `es.wave_kernel_signature`.

    Raises
    ------
    InvalidParameterError
        If an energy is not finite or sigma not positive. By a backward pass, if k cuts a group.

    Examples
    --------
    >>> import eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(2)
    >>> spectrum = et.solve_spectrum(ball.vertices, ball.faces, 9)
    >>> et.wave_kernel_signature(spectrum, [0.7, 1.8], 0.3).shape
    torch.Size([162, 2])
    """
    require_type(spectrum, TensorSpectrum, "spectrum")
    steps = _constants(energies, finite_values, "energies", spectrum)
    width = positive_values(sigma, "sigma")[0]
    levels = spectrum.levels.diagonal()
    positive = levels > NULL * levels[-1]
    logs = torch.log(torch.where(positive, levels, 1.0))
    exponents = -((logs[:, None] - steps) ** 2) / (2 * width**2)
    # Relative to the largest, as far from all eigenvalues every exponential is 0.
    exponents = exponents.masked_fill(~positive[:, None], -torch.inf)
    bands = torch.exp(exponents - exponents.amax(dim=0).detach())
    slopes = (
        -(logs[:, None] - steps) / width**2 * bands / torch.where(positive, levels, 1.0)[:, None]
    )
    # The sum of a smooth function over a group needs no other entries of Λ.
    total = bands.sum(dim=0)
    return _diagonal(spectrum, bands / total, slopes / total)
