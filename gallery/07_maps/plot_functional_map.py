"""
A map of functions
==================

A functional map is a small matrix: how the eigenfunctions of one shape are made of those of another. A
few pairs of points determine it, and refinement makes it precise.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

first, second = (es.make_creature("hand", pose, n_vertices=1500) for pose in (0, 2))
spectra = [es.solve_spectrum(es.cotangent_laplacian(hand), 80) for hand in (first, second)]

chosen = es.geometry.farthest_points(first, 6)[0]  # five fingertips and the wrist
rough = es.functional_map(*spectra, np.column_stack([chosen, chosen]), n_modes=20)
fine = es.spectral.refine_map(rough, 80)

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
left.imshow(rough.matrix, cmap="RdBu_r", vmin=-1, vmax=1)
left.set_title("from six pairs of points")
image = right.imshow(fine.matrix, cmap="RdBu_r", vmin=-1, vmax=1)
right.set_title("refined")
figure.colorbar(image, ax=[left, right])

# %%
# As a map of points: colors of the first hand on the second.

points = es.spectral.point_map(fine)
error = np.linalg.norm(first.vertices[points] - first.vertices, axis=1)
print(f"median error {np.median(error):.4f}, length of the hand {np.ptp(first.vertices[:, 1]):.2f}")
stripes = np.sin(12 * first.vertices[:, 1]) + 0.5 * np.sin(25 * first.vertices[:, 0])
es.plot.figure_fields(
    {"first": (first, stripes), "second, by the map": (second, stripes[points])},
    "a function of the first hand",
    view="front",
    up="y",
    color_map="turbo",
)
# sphinx_gallery_thumbnail_number = 2
