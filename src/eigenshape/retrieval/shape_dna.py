"""ShapeDNA: a shape known by its lowest eigenvalues alone (Reuter, Wolter and Peinecke 2006)."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.spectral.solver import solve_spectrum

N_VALUES = 20


def shape_dna(mesh: TriangleMesh, *, n_values: SupportsIndex = N_VALUES) -> Float[np.ndarray, " k"]:
    """Describe a shape by the lowest eigenvalues of its cotangent Laplacian, the first left out.

    Entry i is A λ_i / i with A the area, so that size drops out. Of the normalisations in the paper this one keeps the
    first eigenvalue as a number of its own; dividing by it instead would let its error into all others. The division
    by the rank i is the later advice of the authors: by Weyl's law A λ_i / i tends to 4π, and without it the highest,
    least certain eigenvalues would rule the distance.

    Parameters
    ----------
    mesh : TriangleMesh
        Closed or open, in any number of pieces; a boundary is free.
    n_values : int
        1 to n - 1.

    Returns
    -------
    (k,) float
        Without unit.

    Raises
    ------
    InvalidShapeError
        If a face has no area or a vertex no face.
    InvalidParameterError
        If `n_values` is out of range.

    References
    ----------
    M. Reuter, F.-E. Wolter, N. Peinecke: Laplace-Beltrami spectra as "Shape-DNA" of surfaces and solids.
    Computer-Aided Design 38, 2006.
    """
    count = whole_number(n_values, "n_values", 1, mesh.n_vertices - 1)
    laplacian = cotangent_laplacian(mesh)
    values = solve_spectrum(laplacian, count + 1).eigenvalues[1:]
    return values * float(laplacian.mass.sum()) / np.arange(1, count + 1)


def shape_dna_distance(first: Float[np.ndarray, " k"], second: Float[np.ndarray, " j"]) -> float:
    """Return the Euclidean distance of two descriptors of `shape_dna`.

    Raises
    ------
    InvalidParameterError
        If one has more numbers than the other.
    """
    require_one_length(first, second)
    return float(np.linalg.norm(first - second))


def require_one_length(first: Float[np.ndarray, " k"], second: Float[np.ndarray, " j"]) -> None:
    """Refuse two lists of eigenvalues of which one is longer."""
    if len(first) != len(second):
        raise InvalidParameterError(
            f"Only equal numbers of eigenvalues compare; the first shape has {len(first)}, the second {len(second)}."
        )
