"""
The parts of a flow
===================

Every vector field is a gradient, a field that only turns, and a field that runs around handles. On a
torus there are two fields of the third kind.
"""

import numpy as np

import eigenshape as es

torus = es.shapes.torus(48, 24)
harmonic = es.calculus.harmonic_fields(torus)
print(harmonic.shape[0], "harmonic fields; Betti numbers", es.geometry.betti_numbers(torus))

# %%
# A field around the axis, with a whirl and a source added.

center = torus.vertices[torus.faces].mean(axis=1)
normals = es.geometry.face_normals(torus)
x, y, z = center.T
around = np.column_stack([-y, x, 0 * z]) / (x**2 + y**2)[:, None]
whirl = np.cross(normals, es.calculus.gradient(torus, np.exp(-5 * (torus.vertices[:, 0] - 1) ** 2)))
source = es.calculus.gradient(torus, np.exp(-5 * (torus.vertices[:, 1] - 1) ** 2))
vectors = around + 0.6 * whirl + 0.6 * source
vectors -= np.sum(vectors * normals, axis=1)[:, None] * normals  # along the faces
parts = es.calculus.decompose_field(torus, vectors)

# %%
# How strong each part is, from face to vertex.

fields = {}
for name in ("exact", "coexact", "harmonic"):
    strength = np.linalg.norm(getattr(parts, name), axis=1)
    fields[name] = (torus, es.calculus.average_onto_points(torus, strength))
es.plot.figure_fields(
    fields, "length of the vectors", view=[0.4, -0.6, 1], up="z", color_map="magma"
)
