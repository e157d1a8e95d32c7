"""
Chapter 4: when topology changes
================================

Two shapes that touch share little heat at first. The spectrum of the pair changes continuously from that
of two shapes to that of one, as the bridge grows.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es


def dumbbell(neck):
    """Make a surface of revolution: two balls with a neck of a given radius between them."""
    z, angle = np.meshgrid(np.linspace(-1, 1, 81), np.linspace(0, 2 * np.pi, 33)[:-1])
    radius = 0.5 * np.sqrt(np.maximum(1 - ((np.abs(z) - 0.5) / 0.5) ** 2, 0))
    radius = np.maximum(radius, np.where(np.abs(z) < 0.5, neck, 0.02))
    points = np.stack([radius * np.cos(angle), z, radius * np.sin(angle)], axis=2)
    i, j = np.meshgrid(np.arange(32), np.arange(80), indexing="ij")
    a, b = i * 81 + j, (i + 1) % 32 * 81 + j
    squares = np.stack([a, b, b + 1, a + 1], axis=2).reshape(-1, 4)
    faces = np.vstack([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]])
    return es.repair((points.reshape(-1, 3), faces), ["fill_holes", "orient"]).mesh


necks = [0.02, 0.06, 0.12, 0.2, 0.3, 0.4]
shapes = {f"neck {neck:g}": dumbbell(neck) for neck in necks}
rows = [es.solve_spectrum(es.cotangent_laplacian(mesh), 8).eigenvalues for mesh in shapes.values()]
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
axes.plot(necks, rows, "o-")
axes.set(xlabel="radius of the neck, length", ylabel="eigenvalue, 1/length²")

# %%
# The second eigenvalue goes to 0 with the neck, if slowly: there are two shapes then.

es.plot.figure_poses({name: shapes[name] for name in ("neck 0.02", "neck 0.12", "neck 0.4")})
# sphinx_gallery_thumbnail_number = 2
