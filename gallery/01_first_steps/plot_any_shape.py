"""
Meshes, solids, curves and points
=================================

`es.build_laplacian` takes the usual operator for each kind of shape, and everything after it is the
same. Here are the lowest eigenvalues of a sphere as triangles and as points, of a solid ball, and of
a circle.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

sphere = es.shapes.fibonacci_sphere(1000)
shapes = {
    "sphere, triangles": sphere,
    "sphere, points": es.PointCloud(sphere.vertices, dim=2),
    "solid ball, tetrahedra": es.shapes.ball(8),
    "circle, segments": es.shapes.circle(100),
}
spectra = {name: es.solve_spectrum(es.build_laplacian(shape), 16) for name, shape in shapes.items()}
for name, spectrum in spectra.items():
    print(f"{name:24}", np.round(spectrum.eigenvalues[:9], 2))

# %%
# Eigenvalues of a sphere come in steps of 1, 3, 5, 7 equal ones, those of a circle in pairs.

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for name, spectrum in spectra.items():
    axes.plot(spectrum.eigenvalues, "o-", markersize=4, label=name)
axes.set(xlabel="number of the eigenvalue", ylabel="eigenvalue, 1/length²", ylim=(0, 40))
axes.legend()
