"""
A spectrum of points without triangles
======================================

A point cloud has an operator, too: `es.robust_laplacian` glues triangles around each point, and the
kernel of Belkin, Sun and Wang weighs all points nearby. Both give the eigenvalues of the surface.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

mesh = es.make_creature("fish", n_vertices=1500)
cloud = es.PointCloud(mesh.vertices, dim=2)
spectra = {
    "triangles": es.solve_spectrum(es.cotangent_laplacian(mesh), 20),
    "points, robust": es.solve_spectrum(es.robust_laplacian(cloud), 20),
    "points, kernel": es.solve_spectrum(es.point_cloud_laplacian(cloud), 20),
}
es.plot.figure_spectra(spectra)

# %%
# The second eigenfunction, drawn at the points alone.

camera = es.plot.aim_camera(mesh)
right, down = (cloud.points @ camera.rotation.T)[:, :2].T
nearest_last = np.argsort(cloud.points @ camera.rotation[2])

figure, axes = plt.subplots(figsize=(6, 4.5), layout="constrained")
values = spectra["points, robust"].eigenvectors[:, 2]
dots = axes.scatter(
    right[nearest_last], -down[nearest_last], c=values[nearest_last], s=9, cmap="RdBu_r"
)
axes.set_aspect("equal")
axes.set_axis_off()
figure.colorbar(dots, label="eigenfunction of the points")
# sphinx_gallery_thumbnail_number = 2
