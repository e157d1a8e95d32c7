"""
Bounds for the eigenvalues of the shape itself
==============================================

A computed eigenvalue is that of a matrix. `es.bracket_eigenvalues` gives two numbers between which
the eigenvalue of the surface lies, with all errors of discretization and rounding.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

mesh = es.make_creature("chair", n_vertices=1000)
figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
for n_splits, color in ((0, "tab:orange"), (1, "tab:blue")):
    found = es.bracket_eigenvalues(mesh, 16)
    middles = (found.lower + found.upper) / 2
    axes.errorbar(
        np.arange(16) + 0.15 * n_splits,
        middles,
        yerr=[middles - found.lower, found.upper - middles],
        fmt="none",
        ecolor=color,
        capsize=4,
        label=f"{mesh.n_vertices:,} vertices",
    )
    mesh = es.geometry.subdivide(mesh)
axes.set(xlabel="number of the eigenvalue", ylabel="eigenvalue, 1/length²")
axes.legend()

# %%
# Four triangles for each leave the shape as it is, and the brackets become a quarter as wide.

print(found.explain())
