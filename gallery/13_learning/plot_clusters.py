"""
Clusters of points in scikit-learn
==================================

The same spectra for tables of data: `es.spectral.SpectralClusterer` and `SpectralEmbedder` are
estimators of scikit-learn, with certified eigenvectors and no random starts.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

rng = np.random.default_rng(0)
angles = rng.uniform(0, 2 * np.pi, 500)
radii = np.repeat([0.4, 1.0], 250)
points = np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])
points += 0.05 * rng.standard_normal(points.shape)

labels = es.spectral.SpectralClusterer(n_clusters=2).fit_predict(points)
plane = es.spectral.SpectralEmbedder(n_components=2).fit_transform(points)

# %%
# Two rings, which no straight line parts.

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
left.scatter(*points.T, c=labels, cmap="coolwarm", s=12)
left.set_aspect("equal")
left.set_title("clusters")
right.scatter(*plane.T, c=labels, cmap="coolwarm", s=12)
right.set_xticks([])
right.set_yticks([])
right.set_title("in the plane of two eigenvectors")
