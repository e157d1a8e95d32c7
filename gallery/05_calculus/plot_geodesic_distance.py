"""
How far is it along the surface?
================================

Distances from one vertex to all others, in bands, with a shortest path. Heat of a short time points the
way, so that many sources cost little once two factors are there.
"""

import numpy as np

import eigenshape as es

giraffe = es.make_creature("giraffe", n_vertices=3000)
top = int(giraffe.vertices[:, 1].argmax())
solver = es.calculus.prepare_heat_geodesics(giraffe)
distances = es.calculus.heat_distances(solver, [top])[0]
far = int(distances.argmax())
path = es.calculus.geodesic_path(giraffe, top, far)
waves = es.geometry.geodesic_distances(giraffe, [top])[0]
print(f"by heat {distances[far]:.3f}, by waves {waves[far]:.3f}, along the path {path.length:.3f}")

# %%
# The points of the path are drawn as points of the mesh that no face uses.

bands = np.floor(20 * distances / distances[far])
framed = es.TriangleMesh(np.vstack([giraffe.vertices, path.points]), giraffe.faces)
camera = es.plot.aim_camera(giraffe)
values = np.append(bands, np.zeros(len(path.points)))
figure = es.figure_field(framed, values, "distance, twentieths", camera=camera, color_map="turbo")
drawing = es.plot.draw(framed, camera)
places = drawing.places[giraffe.n_vertices :].copy()
places[~drawing.visible[giraffe.n_vertices :]] = np.nan
figure.axes[0].plot(*places.T, color="white", lw=2.5)
figure
