"""Figures of eigenvalues."""

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator


def figure_spectrum(
    eigenvalues: Float[np.ndarray, " k"], *, area: float | None = None, shift: float | None = None
) -> Figure:
    """Plot eigenvalues by their number.

    Parameters
    ----------
    eigenvalues : (k,) float
        In 1/length².
    area : float, optional
        Of a surface: draws Weyl's law λ_i ≈ 4π i / area beside them.
    shift : float, optional
        Value below which the spectrum is proved complete.
    """
    figure = Figure(figsize=(7.5, 4.6), layout="constrained")
    axes = figure.subplots()
    number = np.arange(len(eigenvalues))
    axes.plot(number, eigenvalues, ".", color="#1f77b4", markersize=5, label="eigenvalues")
    if area is not None:
        axes.plot(number, 4 * np.pi * number / area, "-", color="#999999", lw=1, label="Weyl's law, 4π i / area")
    if shift is not None and np.isfinite(shift):
        axes.axhline(shift, color="#2ca02c", lw=1, ls="--", label="none is missing below")
    axes.set_xlabel("number i")
    axes.set_ylabel("eigenvalue λ, 1/length²")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return figure
