"""
The smoothest vector field
==========================

The connection Laplacian acts on vectors along the surface. Its lowest eigenvector is the field that
turns least; on a shape like a sphere it must vanish somewhere.
"""

import numpy as np

import eigenshape as es

fish = es.make_creature("fish", n_vertices=2000)
laplacian = es.operators.connection_laplacian(fish)
lowest = es.solve_spectrum(laplacian, 2).eigenvectors[:, 0].reshape(-1, 2)

# %%
# Two numbers for each vertex are coordinates in its tangent frame; three are a vector in space.

frames = es.operators.tangent_frames(fish)
vectors = np.einsum("nk,nkd->nd", lowest, frames)
strength = np.linalg.norm(vectors, axis=1)

# %%
# Arrows at vertices that are evenly spread.

chosen = es.geometry.farthest_points(fish, 250)[0]
camera = es.plot.aim_camera(fish, view="left", up="y")
figure = es.figure_field(fish, strength / strength.max(), "length of the vectors", camera=camera)
drawing = es.plot.draw(fish, camera)
chosen = chosen[drawing.visible[chosen]]
x, y = drawing.places[chosen].T
u, v, _ = camera.rotation @ (vectors[chosen] / strength[chosen, None]).T
figure.axes[0].quiver(x, y, u, v, angles="xy", color="white", scale=32, width=0.004)
figure
