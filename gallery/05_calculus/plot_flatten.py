"""
Flatten a surface
=================

A conformal map to the plane keeps angles: a checkerboard of the plane has squares on the surface, of
different sizes.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

sheet = es.shapes.grid(90, 90, width=2.0, height=2.0)
x, y = sheet.vertices[:, :2].T - 1
bumps = 0.9 * np.exp(-1.5 * (x * x + y * y)) + 0.25 * np.exp(-12 * ((x - 0.4) ** 2 + y * y))
dome = es.TriangleMesh(np.column_stack([x, bumps, -y]), sheet.faces)

plane = es.calculus.flatten_conformally(dome)
cells = np.floor(plane / np.ptp(plane) * 10).astype(int)
board = (cells.sum(axis=1) % 2).astype(float)
es.figure_field(dome, board, "checkerboard of the plane", color_map="cividis", view=[0.3, 0.9, 0.8])

# %%
# In the plane, colored by how much each triangle was enlarged. Angles change by about a percent.

distortion = es.calculus.angle_distortion(dome, plane)
print(
    f"ratio of the two stretches: {distortion.mean():.4f} on average, {distortion.max():.3f} at most"
)
flat = es.TriangleMesh(np.column_stack([plane, np.zeros(len(plane))]), dome.faces)
enlarged = es.geometry.face_areas(flat) / es.geometry.face_areas(dome)
figure, axes = plt.subplots(figsize=(6, 5), layout="constrained")
colors = axes.tripcolor(*plane.T, dome.faces, np.log2(enlarged), cmap="viridis")
axes.set_aspect("equal")
axes.set_axis_off()
figure.colorbar(colors, label="log2 (area in the plane / on the surface)")
