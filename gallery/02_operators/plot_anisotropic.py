"""
Heat that prefers a direction
=============================

With one tensor for each triangle, heat flows faster in one direction than in another, as it does in
wood or in muscle.
"""

import numpy as np

import eigenshape as es

torus = es.shapes.torus(96, 48)
start = np.zeros(torus.n_vertices)
start[(torus.vertices @ [0.2, -0.6, 1.0]).argmax()] = 1.0
time = 0.004 * es.geometry.surface_area(torus)

# %%
# Unit vectors around the axis of the torus, at the middle of each face; along them heat flows fifty
# times as fast as across, or the other way round.

x, y, _ = torus.vertices[torus.faces].mean(axis=1).T
around = np.column_stack([-y, x, np.zeros(len(x))]) / np.hypot(x, y)[:, None]
along = np.einsum("si,sj->sij", around, around)
tensors = {
    "everywhere alike": np.broadcast_to(np.eye(3), along.shape),
    "around": along + (np.eye(3) - along) / 50,
    "across": along / 50 + (np.eye(3) - along),
}
fields = {}
for name, tensor in tensors.items():
    laplacian = es.operators.anisotropic_laplacian(torus, tensor)
    heat = es.spectral.apply_heat(laplacian, start, time)
    fields[name] = (torus, np.log10(np.maximum(heat / heat.max(), 1e-3)))
label = "heat over its largest value, log10"
es.plot.figure_fields(fields, label, color_map="inferno", view=[0.2, -0.6, 1.0], up="z")
