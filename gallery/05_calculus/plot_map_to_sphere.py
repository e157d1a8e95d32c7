"""
Map a fish to a sphere
======================

Any surface without handles can be mapped to the sphere so that angles are kept. Functions on both are
then comparable, as in brain mapping.
"""

import numpy as np

import eigenshape as es

fish = es.make_creature("fish", n_vertices=2500)
points = es.calculus.map_to_sphere(fish)
ball = es.TriangleMesh(points, fish.faces)
print(
    "angles are distorted by a factor of",
    es.calculus.angle_distortion(fish, points).mean().round(3),
)

# %%
# A function of the sphere, on both shapes. What is small on the sphere is a limb of the fish.

latitude = np.arcsin(np.clip(points[:, 1], -1, 1))
stripes = np.sin(10 * latitude) + latitude
es.plot.figure_fields(
    {"fish": (fish, stripes), "sphere": (ball, stripes)},
    "a function of the latitude",
    color_map="turbo",
    view="left",
    up="y",
)
