"""
Repair a mesh
=============

Nothing is repaired in silence: what an operator cannot take is refused with its place, and with the
names of the repairs that help.
"""

import numpy as np

import eigenshape as es

whole = es.make_creature("quadruped", n_vertices=2000)
keep = np.linalg.norm(whole.vertices[whole.faces].mean(axis=1) - [0.1, 0.1, 0.2], axis=1) > 0.12
corners = whole.vertices[whole.faces[keep]].reshape(-1, 3)
soup = es.TriangleMesh(corners, np.arange(len(corners)).reshape(-1, 3))
print(es.suggest_repairs(soup))

# %%
# Each triangle came with corners of its own, as in STL files: no two were neighbors. The suggested
# repairs join them, and close what is open.

repaired = es.repair(soup, es.suggest_repairs(soup))
print("\n".join(repaired.report))

# %%
# The hole is closed. The new triangles come last.

mesh = repaired.mesh
labels = (np.arange(mesh.n_faces) >= keep.sum()).astype(int)
es.figure_segments(mesh, labels, view="left")
