"""Figures of eigenvalues."""

from collections.abc import Mapping

import numpy as np
from matplotlib.ticker import MaxNLocator

from certeig.kit.arguments import require_type
from certeig.kit.arrays import positive_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape.plot.figure import Figure, open_frame
from eigenshape.plot.render import palette
from eigenshape.spectral.bounds.brackets import Brackets
from eigenshape.spectral.comparison.eigenvalues import (
    KnownEigenvalues,
    SpectrumComparison,
    known_eigenvalues,
)
from eigenshape.spectral.spectrum import Spectrum

# Relative differences that span more powers of ten than this are drawn on a logarithmic axis.
DECADES = 1.5
# Smaller relative differences are rounding errors, and are left out of a logarithmic axis.
FAINT = 1e-12


def figure_spectrum(
    spectrum: Spectrum, *, area: float | None = None, brackets: Brackets | None = None
) -> Figure:
    """Plot eigenvalues by their number, with the range in which none is missing.

    Parameters
    ----------
    spectrum : Spectrum
    area : float, optional
        Area of the surface, in length². If given, Weyl's law λ_i ≈ 4π i / area is drawn too.
    brackets : Brackets, optional
        Of the same shape. If given, the interval that holds each eigenvalue of the shape itself is
        drawn too.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If the area is not positive and finite.

    See Also
    --------
    figure_spectra : Plot several spectra.
    figure_eigenfunctions : Draw eigenfunctions on the shape.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), k=9)
    >>> figure = es.plot.figure_spectrum(spectrum)
    >>> figure.axes[0].get_ylabel()
    'eigenvalue λ, 1/length²'
    """
    require_type(spectrum, Spectrum, "spectrum")
    require_type(brackets, Brackets | None, "brackets")
    figure = Figure(7.5, 4.6)
    axes = figure.subplots()
    proof = spectrum.certificate
    number = proof.first + np.arange(len(spectrum.eigenvalues))
    if brackets is not None:
        lower, upper = brackets.lower[number], brackets.upper[number]
        label = "bracket of the shape's eigenvalue"
        axes.vlines(number, lower, upper, color="#f2b36b", lw=3, label=label)
    label = "eigenvalues of the operator"
    axes.plot(number, spectrum.eigenvalues, ".", color="#1f77b4", markersize=5, label=label)
    if area is not None:
        weyl, label = 4 * np.pi * number / positive_number(area, "area"), "Weyl's law, 4π i / area"
        axes.plot(number, weyl, "-", color="#999999", lw=1, label=label)
    ends = [end for end in (proof.floor, proof.shift) if np.isfinite(end)]
    if proof.complete and ends:
        label = "none is missing below" if len(ends) == 1 else "none is missing between"
        axes.hlines(ends, number[0], number[-1], color="#2ca02c", lw=1, ls="--", label=label)
    axes.set_xlabel("number i")
    axes.set_ylabel("eigenvalue λ, 1/length²")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(frameon=False, loc="lower right")
    open_frame(axes)
    return figure


Row = tuple[str, KnownEigenvalues]  # with its title


def figure_spectra(
    spectra: SpectrumComparison | Mapping[str, Spectrum | ArrayLike],
    *,
    titles: tuple[str, str] = ("one", "two"),
    brackets: Mapping[str, Brackets] | None = None,
    unit: str = "1/length²",
) -> Figure:
    """Plot several spectra by number, and their relative differences from the first one.

    Bars show the bounds of each eigenvalue, by residuals or brackets. Most are too short to be
    seen.

    Parameters
    ----------
    spectra : SpectrumComparison, or {title: Spectrum or (k,) float}
        Two or more, each from the lowest eigenvalue on. Numbers without a Spectrum have no bars.
    titles : (str, str)
        Titles of the two spectra of a SpectrumComparison.
    brackets : {title: Brackets}, optional
        Bounds of the spectra with these titles, instead of residuals.
    unit : str
        Unit of the eigenvalues.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If there are fewer than two spectra, one does not begin with the lowest eigenvalue, or the
        title of brackets is not the title of a spectrum.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> coarse = es.solve_spectrum(es.cotangent_laplacian(mesh), k=9)
    >>> exact = [0, 2, 2, 2, 6, 6, 6, 6, 6]
    >>> figure = es.plot.figure_spectra({"unit sphere": exact, "162 vertices": coarse})
    >>> len(figure.axes)
    2
    """
    require_type(spectra, SpectrumComparison | Mapping, "spectra")
    require_type(brackets, Mapping | None, "brackets")
    rows = _rows(spectra, titles, brackets or {})
    if len(rows) < 2:
        raise InvalidParameterError(f"spectra must hold two or more spectra; it holds {len(rows)}.")
    figure = Figure(7.5, 6.4)
    _draw_rows(figure.subplots(2, 1, sharex=True, height_ratios=(3, 2)), rows, unit)
    return figure


def draw_comparison(
    panels: np.ndarray, compared: SpectrumComparison, titles: tuple[str, str]
) -> None:
    """Draw a comparison into two panels, one above the other, as `figure_spectra` does."""
    _draw_rows(panels, _rows(compared, titles, {}), "1/length²")


def _draw_rows(panels: np.ndarray, rows: list[Row], unit: str) -> None:
    """Draw eigenvalues by number, and below them relative differences from the first row."""
    above, below = panels
    colors = palette(np.arange(len(rows)))
    for (title, known), color in zip(rows, colors, strict=True):
        number = np.arange(len(known.values))
        if len(known.intervals):
            width, label = (3, f"{title}: bracket") if known.bracketed else (1, "_")
            bars = above.vlines(number, *known.intervals.T, color=color, lw=width, label=label)
            bars.set_alpha(0.35)
        above.plot(number, known.values, ".-", color=color, markersize=3.5, lw=0.8, label=title)
    above.set_ylabel(f"eigenvalue λ, {unit}")
    above.legend(frameon=False, loc="upper left", fontsize=9)

    first_title, first = rows[0]
    changes = []
    for _, other in rows[1:]:
        change = first.change_to(other)
        changes.append(np.where(np.isfinite(change), change, np.nan))
    # On a logarithmic axis where they span decades
    seen = np.concatenate([change[change > FAINT] for change in changes])
    logarithmic = seen.size and np.ptp(np.log10(seen)) > DECADES
    for change, color in zip(changes, colors[1:], strict=True):
        drawn = np.where(change > FAINT, change, np.nan) if logarithmic else change
        below.plot(np.arange(len(drawn)), drawn, ".-", color=color, markersize=3.5, lw=0.8)
    if logarithmic:
        below.set_yscale("log")
    else:
        below.set_ylim(bottom=0)
    below.set_ylabel(f"relative difference\nfrom {first_title}")
    below.set_xlabel("number i")
    for axes in (above, below):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        open_frame(axes)


def _rows(
    spectra: SpectrumComparison | Mapping[str, Spectrum | ArrayLike],
    titles: tuple[str, str],
    brackets: Mapping[str, Brackets],
) -> list[Row]:
    if isinstance(spectra, SpectrumComparison):
        parts = (spectra.one, spectra.intervals_one), (spectra.two, spectra.intervals_two)
        return [
            (title, KnownEigenvalues(values, intervals[:, 0] <= 0, intervals, spectra.bracketed))
            for title, (values, intervals) in zip(titles, parts, strict=True)
        ]
    unknown = [title for title in brackets if title not in spectra]
    if unknown:
        raise InvalidParameterError(
            f"The titles of brackets must be titles of spectra, {list(spectra)}; one is {unknown[0]!r}."
        )
    return [
        (title, known_eigenvalues(spectrum, title, brackets.get(title)))
        for title, spectrum in spectra.items()
    ]
