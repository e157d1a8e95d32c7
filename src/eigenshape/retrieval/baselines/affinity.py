"""EVD: a shape known by the eigenvalues of its geodesic affinities (Jain and Zhang 2007)."""

from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import whole_number
from eigenshape._threads import one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.geodesic import farthest_points
from eigenshape.geometry.requirements import require_describable
from eigenshape.retrieval.baselines.shape_dna import N_VALUES, require_one_length

N_SAMPLES = 20  # few, as in the paper; 50 to 200 find no more on the tuning half of experiments/ch5_retrieval


@one_blas_thread()
def affinity_eigenvalues(
    mesh: MeshLike, *, n_values: SupportsIndex | None = None, n_samples: SupportsIndex | None = None
) -> Float[np.ndarray, " k"]:
    """Describe a shape by the highest eigenvalues of the affinities between its points.

    A_ij = exp(-d_ij² / 2σ²) with d the geodesic distance and σ the longest one (Jain and Zhang 2007), between farthest
    points (their Nyström samples). The eigenvalues are those of the sampled matrix over the number of samples, so that
    they sum to 1, and neither the resolution nor the size of the shape counts. A few are negative, since the kernel is
    not definite for geodesic distances; they count as 0. Points with no way between them have no affinity.

    With few samples the lowest of the eigenvalues depend on which points were taken. That costs no hits, but where two
    meshes of one shape should agree closely, take 100.

    Parameters
    ----------
    mesh : MeshLike
    n_values : int, optional
        1 to n_samples; by default 20, or n_samples where that is less.
    n_samples : int, optional
        1 to n; by default 20, or n where that is less.

    Returns
    -------
    (k,) float
        Descending, at least 0.

    Raises
    ------
    InvalidParameterError
        If a number is out of its range.
    InvalidShapeError
        If a vertex has no face, a face is there twice, or the mesh is a soup, whose faces lie edge on edge without
        sharing vertices.

    References
    ----------
    V. Jain, H. Zhang: A spectral approach to shape-based retrieval of articulated 3D models. Computer-Aided Design 39,
    2007.
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
    between = np.minimum(
        rows[:, points], rows[:, points].T
    )  # the wave of one end may come a little later
    longest = between[np.isfinite(between)].max(initial=0.0)
    # Between infinitely far points the affinity is 0; of a single point it is 1.
    affinity = np.exp(-((between / (longest or 1.0)) ** 2) / 2)
    values = np.linalg.eigvalsh(affinity)[::-1][:count] / samples
    return np.maximum(values, 0.0)


def affinity_distance(first: Float[np.ndarray, " k"], second: Float[np.ndarray, " j"]) -> float:
    """Compare two descriptors of `affinity_eigenvalues`: ½ Σ (√λ_i - √μ_i)² / (√λ_i + √μ_i) (Jain and Zhang 2007).

    Raises
    ------
    InvalidParameterError
        If one has more numbers than the other.
    """
    require_one_length(first, second)
    one, two = np.sqrt(first), np.sqrt(second)
    return float(((one - two) ** 2 / np.maximum(one + two, np.finfo(np.float64).tiny)).sum() / 2)
