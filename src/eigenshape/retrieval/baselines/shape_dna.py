"""ShapeDNA: a shape known by its lowest eigenvalues alone (Reuter, Wolter and Peinecke 2006)."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.requirements import require_describable
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.spectral.solve import solve_spectrum

N_VALUES = 20


def shape_dna(mesh: MeshLike, *, n_values: SupportsIndex | None = None) -> Float[np.ndarray, " k"]:
    """Describe a shape by the lowest eigenvalues of its cotangent Laplacian, the first left out.

    Entry i is A λ_i / i with A the area, so that size drops out. Of the normalisations in the paper this one keeps the
    first eigenvalue as a number of its own; dividing by it instead would let its error into all others. The division
    by the rank i is the later advice of the authors: by Weyl's law A λ_i / i tends to 4π, and without it the highest,
    least certain eigenvalues would rule the distance.

    Here i counts from 1 at the first eigenvalue above 0. LaPy's `reweight_ev` counts from 1 at the first of the list
    that it is given, which `compute_shapedna` begins with the eigenvalue 0: it divides this λ_i by i + 1. Its entries
    are i / (i + 1) of these, half for the first one.

    Parameters
    ----------
    mesh : MeshLike
        Closed or open, in any number of pieces; a boundary is free.
    n_values : int, optional
        1 to n - 1; by default 20, or n - 1 where that is less.

    Returns
    -------
    (k,) float
        Without unit.

    Raises
    ------
    InvalidShapeError
        If a face has no area or is there twice, a vertex has no face, or the mesh is a soup, whose faces lie edge on
        edge without sharing vertices.
    InvalidParameterError
        If `n_values` is out of range.

    References
    ----------
    M. Reuter, F.-E. Wolter, N. Peinecke: Laplace-Beltrami spectra as "Shape-DNA" of surfaces and solids.
    Computer-Aided Design 38, 2006.
    """
    mesh = as_mesh(mesh)
    most = mesh.n_vertices - 1
    count = min(N_VALUES, most) if n_values is None else whole_number(n_values, "n_values", 1, most)
    require_describable(mesh)
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
