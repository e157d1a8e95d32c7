"""EVD: the eigenvalues of geodesic affinities (Jain and Zhang 2007)."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import whole_number
from eigenshape._threads import one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.geodesic import farthest_points
from eigenshape.geometry.requirements import require_describable
from eigenshape.retrieval.baselines.shape_dna import N_VALUES, require_same_length

# Few, as in the paper; 50 to 200 found no more on the tuning half of experiments/ch5_retrieval.
N_SAMPLES = 20


@one_blas_thread()
def affinity_eigenvalues(
    mesh: MeshLike, *, n_values: SupportsIndex | None = None, n_samples: SupportsIndex | None = None
) -> Float[np.ndarray, " k"]:
    """Describe a shape by the largest eigenvalues of the affinities between its points.

    A_ij = exp(-d_ij² / 2σ²), with d the geodesic distances between farthest points and σ the
    longest of them (Jain and Zhang 2007). The eigenvalues are divided by the number of points, so
    that all sum to 1, and neither the resolution nor the size of the shape matters. A few are
    negative, since the kernel is not positive definite for geodesic distances; they count as 0.
    Points of different components have no affinity.

    With few points the smallest of the eigenvalues depend on which points were taken. That costs no
    hits in retrieval, but take 100 if two meshes of one shape must agree closely.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices.
    n_values : int, optional
        1 to n_samples; by default 20, or n_samples if that is less.
    n_samples : int, optional
        1 to n; by default 20, or n if that is less.

    Returns
    -------
    (n_values,) float
        Descending, at least 0.

    Raises
    ------
    InvalidParameterError
        If a number is out of its range.
    InvalidShapeError
        If a vertex has no face, a face occurs twice, or the mesh is a soup (faces lie edge on edge
        without sharing vertices).

    See Also
    --------
    affinity_distance

    References
    ----------
    V. Jain, H. Zhang: A spectral approach to shape-based retrieval of articulated 3D models.
    Computer-Aided Design 39, 2007.

    Examples
    --------
    >>> import eigenshape as es
    >>> values = es.retrieval.baselines.affinity_eigenvalues(es.icosphere(2), n_values=4)
    >>> values.shape, bool(values[0] > 0.5)
    ((4,), True)
    """
    mesh = as_mesh(mesh)
    most = mesh.n_vertices
    samples = (
        min(N_SAMPLES, most) if n_samples is None else whole_number(n_samples, "n_samples", 1, most)
    )
    count = (
        min(N_VALUES, samples)
        if n_values is None
        else whole_number(n_values, "n_values", 1, samples)
    )
    require_describable(mesh)
    points, rows, _ = farthest_points(mesh, samples)
    # Waves from the two ends of a pair may differ a little: take the shorter distance.
    distances = np.minimum(rows[:, points], rows[:, points].T)
    longest = distances[np.isfinite(distances)].max(initial=0.0)
    # The affinity of infinitely far points is 0, and that of a single point is 1.
    affinity = np.exp(-((distances / (longest or 1.0)) ** 2) / 2)
    values = np.linalg.eigvalsh(affinity)[::-1][:count] / samples
    return np.maximum(values, 0.0)


def affinity_distance(first: Float[np.ndarray, " k"], second: Float[np.ndarray, " j"]) -> float:
    """Return the distance of two descriptors of `affinity_eigenvalues`.

    ½ Σ (√λ_i - √μ_i)² / (√λ_i + √μ_i) (Jain and Zhang 2007).

    Parameters
    ----------
    first, second : (k,) float

    Returns
    -------
    float

    Raises
    ------
    InvalidParameterError
        If one has more numbers than the other.

    See Also
    --------
    affinity_eigenvalues

    Examples
    --------
    >>> import eigenshape as es
    >>> values = es.retrieval.baselines.affinity_eigenvalues(es.icosphere(2))
    >>> es.retrieval.baselines.affinity_distance(values, values)
    0.0
    """
    require_same_length(first, second)
    one, two = np.sqrt(first), np.sqrt(second)
    return float(((one - two) ** 2 / np.maximum(one + two, np.finfo(np.float64).tiny)).sum() / 2)
