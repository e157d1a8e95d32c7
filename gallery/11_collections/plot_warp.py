"""
Show a difference of landmarks on a surface
===========================================

Two mean shapes of a few landmarks are hard to see. A thin-plate spline bends a whole surface from the
one to the other.
"""

import numpy as np

import eigenshape as es

fish = es.make_creature("fish", n_vertices=2000)
landmarks = fish.vertices[es.geometry.farthest_points(fish, 12)[0]]
deeper = landmarks * [1.0, 1.4, 0.85]  # a deeper and shorter body

bent = es.morphometrics.warp_mesh(fish, landmarks, deeper)
es.plot.figure_poses({"mean of one group": fish, "of the other": bent}, view="left", up="y")

# %%
# As a function: how far the surface moves outward.

outward = np.sum((bent.vertices - fish.vertices) * es.geometry.vertex_normals(fish), axis=1)
limit = np.abs(outward).max()
es.figure_field(
    fish,
    outward,
    "outward, length",
    color_map="RdBu_r",
    limits=(-limit, limit),
    view="left",
    up="y",
)
