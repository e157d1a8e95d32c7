"""A spectrum and the proof that nothing is missing from it."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float


@dataclass(frozen=True)
class Certificate:
    """Why exactly these eigenvalues lie below a value.

    Sylvester's law of inertia: the factor of W - σB has as many negative pivots as there are eigenvalues
    below σ. With as many B-orthonormal eigenvectors found, whose residual intervals all end below σ, none is
    missing and none is extra.

    Attributes
    ----------
    shift : float
        σ, in 1/length², inside `gap`; infinite where all n eigenvalues were computed.
    count : int
        Eigenvalues below σ by inertia.
    n_found : int
        Eigenpairs computed below σ; equal to `count`, or the spectrum is refused.
    gap : (float, float)
        Upper end of the last error interval below σ, and the lower end of what is known to lie above it.
    orthonormality : float
        Largest entry of |ΦᵀBΦ - I|.
    max_residual : float
        Largest of `Spectrum.residuals`, relative to the largest eigenvalue found.
    n_split : int
        Eigenvalues found below σ beyond the k that were asked for: where it is not 0, the k-th eigenvalue has
        neighbours inside its own cluster that the caller did not ask for.
    """

    shift: float
    count: int
    n_found: int
    gap: tuple[float, float]
    orthonormality: float
    max_residual: float
    n_split: int


@dataclass(frozen=True, eq=False)
class Spectrum:
    """The k lowest eigenpairs of a Laplacian, with their proof.

    Attributes
    ----------
    eigenvalues : (k,) float
        λ in ascending order, in 1/length².
    eigenvectors : (n, k) float
        Φ with ΦᵀBΦ = I; signs are fixed by a convention, so the same input gives the same columns.
    mass : (n, n) sparse
        B of the operator.
    residuals : (k,) float
        |λ - true eigenvalue| is at most this, in 1/length²: the norm of W φ - λ B φ in B⁻¹.
    certificate : Certificate
    """

    eigenvalues: Float[np.ndarray, " k"]
    eigenvectors: Float[np.ndarray, "n k"]
    mass: sp.csr_array
    residuals: Float[np.ndarray, " k"]
    certificate: Certificate
