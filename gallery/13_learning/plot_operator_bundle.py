"""
What a network on surfaces takes
================================

DiffusionNet and its relatives learn with mass, eigenpairs and gradients. One call computes them, with
certified eigenpairs; `es.spectral.export_bundle` hands them to torch.
"""

import numpy as np

import eigenshape as es

horse = es.make_creature("quadruped", n_vertices=1500)
bundle = es.spectral.operator_bundle(horse, k=64)
frames, mass, L, evals, evecs, grad_x, grad_y = es.spectral.export_bundle(bundle, "scipy")
print("eigenvectors", evecs.shape, "gradients", grad_x.shape)

# %%
# One learned step of diffusion: each feature spreads for a time of its own.

feature = np.zeros(horse.n_vertices)
feature[horse.vertices[:, 1].argmax()] = 1.0
coefficients = evecs.T @ (mass * feature)
fields = {}
for time in (0.001, 0.01, 0.1):
    spread = evecs @ (np.exp(-time * evals) * coefficients)
    fields[f"time {time:g}"] = (horse, spread / spread.max())
es.plot.figure_fields(fields, "feature / largest", color_map="magma", limits=(0, 1))

# %%
# Its gradient, in the tangent plane of each vertex.

x, y = grad_x @ spread, grad_y @ spread
es.figure_field(horse, np.hypot(x, y), "length of the gradient", color_map="viridis")
