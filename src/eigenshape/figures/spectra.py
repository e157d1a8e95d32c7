"""Figures of eigenvalues."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from eigenshape.spectral.brackets import Brackets
from eigenshape.spectral.spectrum import Spectrum


def figure_spectrum(spectrum: Spectrum, *, area: float | None = None, brackets: Brackets | None = None) -> Figure:
    """Plot eigenvalues by their number, with the lines between which none is missing.

    Parameters
    ----------
    spectrum : Spectrum
    area : float, optional
        Of a surface: draws Weyl's law λ_i ≈ 4π i / area beside them.
    brackets : Brackets, optional
        Of the same shape: draws the interval in which each eigenvalue of the shape itself lies.
    """
    figure = Figure(figsize=(7.5, 4.6), layout="constrained")
    axes = figure.subplots()
    proof = spectrum.certificate
    number = proof.first + np.arange(len(spectrum.eigenvalues))
    if brackets is not None:
        lower, upper = brackets.lower[number], brackets.upper[number]
        axes.vlines(number, lower, upper, color="#f2b36b", lw=3, label="bracket of the shape's eigenvalue")
    axes.plot(number, spectrum.eigenvalues, ".", color="#1f77b4", markersize=5, label="eigenvalues of the operator")
    if area is not None:
        axes.plot(number, 4 * np.pi * number / area, "-", color="#999999", lw=1, label="Weyl's law, 4π i / area")
    ends = [end for end in (proof.floor, proof.shift) if np.isfinite(end)]
    if proof.complete and ends:
        label = "none is missing below" if len(ends) == 1 else "none is missing between"
        axes.hlines(ends, number[0], number[-1], color="#2ca02c", lw=1, ls="--", label=label)
    axes.set_xlabel("number i")
    axes.set_ylabel("eigenvalue λ, 1/length²")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(frameon=False, loc="lower right")
    axes.spines[["top", "right"]].set_visible(False)
    return figure
