"""
A solid sounds unlike its skin
==============================

Tetrahedra fill a shape, and heat takes short cuts through the inside. The same call gives the modes of
a solid, and `es.geometry.boundary_surface` its skin.
"""

import numpy as np

import eigenshape as es

solid = es.shapes.box(16, 8, 3, sides=(2.0, 1.0, 0.3))
skin = es.geometry.boundary_surface(solid)
inside = es.solve_spectrum(es.build_laplacian(solid), 8)
outside = es.solve_spectrum(es.build_laplacian(skin), 8)
print("solid", inside.eigenvalues.round(2))
print("skin ", outside.eigenvalues.round(2))

# %%
# The eigenvalues of a solid box are known exactly.

print("exact", es.shapes.box_eigenvalues(8, (2.0, 1.0, 0.3), "neumann").round(2))

# %%
# On the skin of the solid its modes can be drawn beside those of the skin alone. The solid has the two
# faces of the board in step; on the skin one mode has its sign changed from front to back.

points = [np.flatnonzero((solid.points == vertex).all(axis=1))[0] for vertex in skin.vertices]
fields = {f"solid {i}": (skin, inside.eigenvectors[points, i]) for i in (1, 2, 3, 4)}
fields |= {f"skin {i}": (skin, outside.eigenvectors[:, i]) for i in (1, 2, 3, 4)}
fields = {
    f"{name}": (mesh, values / np.abs(values).max()) for name, (mesh, values) in fields.items()
}
es.plot.figure_fields(fields, "eigenfunction", color_map="RdBu_r", view=[0.5, -0.6, 0.8], up="y")
