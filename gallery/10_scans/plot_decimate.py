"""
Fewer triangles, the same spectrum
==================================

A mesh with a tenth of its triangles has nearly the same low eigenvalues. How many it may lose depends
on how many eigenvalues are wanted.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

fine = es.make_creature("quadruped", n_vertices=6000)
reference = es.solve_spectrum(es.cotangent_laplacian(fine), 60).eigenvalues
poses = {f"{fine.n_faces:,} faces": fine}
figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
for ratio in (0.3, 0.1, 0.03):
    mesh = es.geometry.decimate(fine, ratio=ratio).mesh
    poses[f"{mesh.n_faces:,} faces"] = mesh
    eigenvalues = es.solve_spectrum(es.cotangent_laplacian(mesh), 60).eigenvalues
    axes.semilogy(np.abs(eigenvalues[1:] / reference[1:] - 1), label=f"{mesh.n_faces:,} faces")
axes.set(xlabel="number of the eigenvalue", ylabel="relative change")
axes.legend()

# %%
# The meshes themselves.

es.plot.figure_poses(poses)
# sphinx_gallery_thumbnail_number = 2
