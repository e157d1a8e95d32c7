"""
The sounds of a drum
====================

A boundary can be free, or fixed as the skin of a drum. Fixed vertices are named when the spectrum is
computed.
"""

import numpy as np

import eigenshape as es

disc = es.shapes.disc(24)
rim = es.geometry.boundary_vertices(disc)
laplacian = es.cotangent_laplacian(disc)
free = es.solve_spectrum(laplacian, 12)
fixed = es.solve_spectrum(laplacian, 12, fixed=rim)

# %%
# The exact values are squared zeros of Bessel functions and of their derivatives.

print("free ", free.eigenvalues[:6].round(2), "exact", es.shapes.disc_eigenvalues(6).round(2))
exact = es.shapes.disc_eigenvalues(6, "dirichlet")
print("fixed", fixed.eigenvalues[:6].round(2), "exact", exact.round(2))

# %%
# Lift each vertex by the eigenfunction, and the skin of the drum can be seen in motion.

fields = {}
for index in (0, 1, 3, 5):
    height = fixed.eigenvectors[:, index] / np.abs(fixed.eigenvectors[:, index]).max()
    skin = es.TriangleMesh(disc.vertices + 0.35 * height[:, None] * [0, 0, 1], disc.faces)
    fields[f"λ = {fixed.eigenvalues[index]:.2f}"] = (skin, height)
es.plot.figure_fields(fields, "height", color_map="RdBu_r", view=[0.2, -1, 0.9], up="z")
