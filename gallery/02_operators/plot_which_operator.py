"""
How exact is an operator?
=========================

The eigenvalues of the sphere are known: 0, 2, 2, 2, 6, ... Finite elements of higher order need
fewer vertices for the same error.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

K = 16
exact = es.shapes.sphere_eigenvalues(K)
operators = {
    "cotangent (linear elements)": es.cotangent_laplacian,
    "quadratic elements": lambda mesh: es.operators.fem_laplacian(mesh, 2),
    "cubic elements": lambda mesh: es.operators.fem_laplacian(mesh, 3),
    "kernel of Gaussians": lambda mesh: es.mesh_laplacian(mesh, correct="log", form="random-walk"),
}

# %%
# The triangles are flat, and the sphere is round. That error is the same for all, so cubic elements
# are no better here than quadratic ones.

figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
for name, build in operators.items():
    counts, errors = [], []
    for n_points in (300, 600, 1200):
        laplacian = build(es.shapes.fibonacci_sphere(n_points))
        eigenvalues = es.solve_spectrum(laplacian, K).eigenvalues
        counts.append(n_points)
        errors.append(np.max(np.abs(eigenvalues[1:] / exact[1:] - 1)))
    axes.loglog(counts, errors, "o-", label=name)
axes.set(xlabel="vertices", ylabel=f"largest relative error of {K - 1} eigenvalues")
axes.grid(alpha=0.3, which="both")
axes.legend()
