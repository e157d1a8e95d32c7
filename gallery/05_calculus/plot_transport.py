"""
Carry a vector along the surface
================================

What becomes of a direction on the way to all other points? The vector heat method transports it along
shortest paths, and the logarithmic map unrolls the surface around a point.
"""

import numpy as np

import eigenshape as es

ball = es.icosphere(4)
transport = es.calculus.prepare_vector_heat(ball)
source = int(ball.vertices[:, 2].argmax())
field = es.calculus.transport_vectors(transport, [source], [[1.0, 0.0]])
vectors = np.einsum("nk,nkd->nd", field, es.operators.tangent_frames(ball))

# %%
# The field turns around the point that is farthest from the source, on the other side.

camera = es.plot.aim_camera(ball, view=[0.3, 0.4, 1.0])
distances = es.calculus.heat_distances(es.calculus.prepare_heat_geodesics(ball), [source])[0]
figure = es.figure_field(ball, distances, "distance from the source", camera=camera)
drawing = es.plot.draw(ball, camera)
chosen = es.geometry.farthest_points(ball, 300)[0]
chosen = chosen[drawing.visible[chosen]]
u, v, _ = camera.rotation @ vectors[chosen].T
figure.axes[0].quiver(
    *drawing.places[chosen].T, u, v, angles="xy", color="white", scale=18, width=0.005
)
figure

# %%
# Polar coordinates around the source: angles as colors.

unrolled = es.calculus.logarithmic_map(transport, source)
angle = np.degrees(np.arctan2(unrolled[:, 1], unrolled[:, 0]))
es.figure_field(ball, angle, "direction from the source, degrees", camera=camera, color_map="hsv")
