"""
Bend a shape as another was bent
================================

Two poses of one animal and a map to another: the second animal is bent in the same way. The map may be
rough, since turns are carried over in few modes.
"""

import numpy as np

import eigenshape as es

rest, walking = (es.make_creature("quadruped", pose, n_vertices=1200) for pose in (0, 5))
giraffe = es.make_creature("giraffe", n_vertices=1200)
size = (es.geometry.surface_area(rest) / es.geometry.surface_area(giraffe)) ** 0.5
match = es.match_shapes(giraffe, rest, scale=size)
bent = es.deformation.transfer_deformation(rest, walking, giraffe, match)

# %%
# Above what was given, below what was bent.

es.plot.figure_poses(
    {"horse, rest": rest, "horse, walking": walking, "giraffe": giraffe, "bent": bent}
)

# %%
# Bones keep their lengths; the joints are where edges change.

change = np.linalg.norm(bent.vertices - giraffe.vertices, axis=1)
es.figure_field(bent, change, "how far each vertex went, length", color_map="magma")
