"""EVD: the eigenvalues of geodesic affinities (Jain and Zhang 2007), which the thesis compares with.

V. Jain, H. Zhang: A spectral approach to shape-based retrieval of articulated 3D models. Computer-Aided Design 39,
2007.
"""

import numpy as np

import eigenshape as es

N_VALUES = 20
# Few, as in the paper; 50 to 200 found no more on the tuning half.
N_SAMPLES = 20


def affinity_eigenvalues(
    mesh: es.TriangleMesh, n_values: int = N_VALUES, n_samples: int = N_SAMPLES
) -> np.ndarray:
    """Describe a shape by the largest eigenvalues of the affinities between its points, descending.

    A_ij = exp(-d_ij² / 2σ²), with d the geodesic distances between farthest points and σ the longest of them. The
    eigenvalues are divided by the number of points, so that all sum to 1, and neither the resolution nor the size of
    the shape matters. A few are negative, since the kernel is not positive definite for geodesic distances; they count
    as 0. Points of different components have no affinity.

    With few points the smallest of the eigenvalues depend on which points were taken. That costs no hits in retrieval,
    but take 100 if two meshes of one shape must agree closely.
    """
    samples = min(n_samples, mesh.n_vertices)
    points, rows, _ = es.geometry.farthest_points(mesh, samples)
    # Waves from the two ends of a pair may differ a little: take the shorter distance.
    distances = np.minimum(rows[:, points], rows[:, points].T)
    longest = distances[np.isfinite(distances)].max(initial=0.0)
    # The affinity of infinitely far points is 0, and that of a single point is 1.
    affinity = np.exp(-((distances / (longest or 1.0)) ** 2) / 2)
    values = np.linalg.eigvalsh(affinity)[::-1][:n_values] / samples
    return np.maximum(values, 0.0)


def affinity_distance(first: np.ndarray, second: np.ndarray) -> float:
    """Return ½ Σ (√λ_i - √μ_i)² / (√λ_i + √μ_i), the distance of two descriptors."""
    one, two = np.sqrt(first), np.sqrt(second)
    return float(((one - two) ** 2 / np.maximum(one + two, np.finfo(np.float64).tiny)).sum() / 2)
