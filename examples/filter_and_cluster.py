"""What a spectrum is used for: a shape from few modes, smoothing, distances, clusters."""

import numpy as np

import eigenshape as es


def main() -> dict[str, float]:
    """Reconstruct and smooth an animal, measure how far its feet are apart, and cluster its points."""
    mesh = es.make_creature("quadruped", n_vertices=1500)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 100)

    coefficients = es.spectral.project(mesh.vertices, spectrum)
    rough = es.spectral.reconstruct(coefficients[:25], spectrum)
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    error = np.linalg.norm(rough - mesh.vertices, axis=1).mean() / diagonal

    # Heat that flows for a time t multiplies the mode of eigenvalue λ by exp(-tλ).
    t = 0.001 * es.geometry.surface_area(mesh)
    smooth = es.spectral.smooth_mesh(
        mesh, spectrum, lambda values: np.exp(-t * values), keep_volume=True
    )

    # The lowest vertex, and the point that is farthest from it along the surface.
    foot = int(mesh.vertices[:, 1].argmin())
    distances = es.spectral.spectral_distances(spectrum, [foot])[:, 0]
    labels = es.spectral.spectral_clusters(spectrum, 6)
    return {
        "mean error of 25 modes, shares of the diagonal": error,
        "volume kept": es.geometry.enclosed_volume(smooth) / es.geometry.enclosed_volume(mesh),
        "farthest from the foot, biharmonic": distances.max(),
        "points in the largest cluster": np.bincount(labels).max() / mesh.n_vertices,
    }


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name}: {value:.3f}")
