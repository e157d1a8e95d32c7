"""
A shape from few modes
======================

Coordinates are functions on the surface. Kept to the lowest eigenfunctions, the shape appears from its
coarse form to its details, as a sound from its low tones.
"""

import numpy as np

import eigenshape as es

horse = es.make_creature("quadruped", n_vertices=2500)
spectrum = es.solve_spectrum(es.cotangent_laplacian(horse), 300)
coefficients = es.spectral.project(horse.vertices, spectrum)

poses = {}
for n_modes in (10, 40, 300):
    points = es.spectral.reconstruct(coefficients[:n_modes], spectrum)
    error = np.sqrt(np.mean(np.sum((points - horse.vertices) ** 2, axis=1)))
    poses[f"{n_modes} modes, error {error:.3f}"] = es.TriangleMesh(points, horse.faces)

# %%
# Few modes already stand as a horse; what is sharp, as ears and hooves, comes last.

es.plot.figure_poses(poses)
