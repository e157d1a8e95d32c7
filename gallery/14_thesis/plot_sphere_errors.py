"""
Chapter 3: which operator converges?
====================================

The mesh Laplacian of Belkin, Sun and Wang converges for all meshes of a surface; weights of edges do
not. On a sphere with uneven triangles the difference shows in the first eigenvalues.
"""

import numpy as np

import eigenshape as es

K = 25
exact = es.shapes.sphere_eigenvalues(K)
sphere = es.shapes.uneven_sphere(1500)
spectra = {
    "exact": exact,
    "cotangent": es.solve_spectrum(es.cotangent_laplacian(sphere), K),
    "mesh Laplacian": es.solve_spectrum(es.mesh_laplacian(sphere), K),
    "mesh Laplacian, corrected": es.solve_spectrum(
        es.mesh_laplacian(sphere, correct="log", form="random-walk"), K
    ),
}
es.plot.figure_spectra(spectra)

# %%
# The sphere: its triangles are four times as long on one side.

size = np.sqrt(es.geometry.dual_volumes(sphere))
es.figure_field(sphere, size, "root of the area of a vertex, length")
