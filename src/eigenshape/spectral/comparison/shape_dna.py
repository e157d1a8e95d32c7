"""ShapeDNA: the lowest eigenvalues of the Laplacian (Reuter, Wolter and Peinecke 2006)."""

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import whole_number
from eigenshape._typing import Integer
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.requirements import require_describable
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.spectral.solve import solve_spectrum

# Eigenvalues; 10 to 50 found no more on the tuning half of experiments/ch5_retrieval.
N_VALUES = 20


def shape_dna(mesh: MeshLike, n_values: Integer | None = None) -> Float[np.ndarray, " k"]:
    """Describe a shape by the lowest eigenvalues of its cotangent Laplacian, without the first.

    Entry i is A λ_i / i, with A the area, so that the size of the shape does not matter. Of the
    normalizations in the paper this one keeps the first eigenvalue as a number of its own; a
    division by it would spread its error over all others. The division by the rank i is the
    authors' later advice: by Weyl's law A λ_i / i tends to 4π, and without it the highest, least
    certain eigenvalues would dominate the Euclidean distance, by which shapes are compared.

    Here i counts from 1 at the first eigenvalue above 0. LaPy's `reweight_ev` counts from 1 at the
    first of its list, which `compute_shapedna` begins with the eigenvalue 0, so it divides this λ_i
    by i + 1. Its entries are i / (i + 1) of these: half of the first one.

    Parameters
    ----------
    mesh : MeshLike
        Closed or open, with n vertices and any number of components; a boundary is free.
    n_values : int, optional
        1 to n - 1; by default 20, or n - 1 if that is less.

    Returns
    -------
    (n_values,) float
        Without unit.

    Raises
    ------
    InvalidShapeError
        If a face has no area or occurs twice, a vertex has no face, or the mesh is a soup (faces
        lie edge on edge without sharing vertices).
    InvalidParameterError
        If `n_values` is out of range.

    See Also
    --------
    compare_spectra : All eigenvalues of two spectra, side by side.

    References
    ----------
    M. Reuter, F.-E. Wolter, N. Peinecke: Laplace-Beltrami spectra as "Shape-DNA" of surfaces and
    solids. Computer-Aided Design 38, 2006.

    Examples
    --------
    The unit sphere has area 4π and eigenvalues 2, 2, 2, 6, ...

    >>> import eigenshape as es
    >>> es.spectral.shape_dna(es.icosphere(4), n_values=3).round(0)
    array([25., 13.,  8.])
    """
    mesh = as_mesh(mesh)
    most = mesh.n_vertices - 1
    count = min(N_VALUES, most) if n_values is None else whole_number(n_values, "n_values", 1, most)
    require_describable(mesh)
    laplacian = cotangent_laplacian(mesh)
    values = solve_spectrum(laplacian, count + 1).eigenvalues[1:]
    return values * float(laplacian.mass.sum()) / np.arange(1, count + 1)
