"""
Bend a neck
===========

A region, a motion, and the rest follows: `es.deform` turns the head, bends the neck smoothly and keeps
all details.
"""

import numpy as np

import eigenshape as es

giraffe = es.make_creature("giraffe", n_vertices=2000)
low, high = giraffe.vertices[:, 1].min(), giraffe.vertices[:, 1].max()
neck = es.deformation.BoxRegion([-np.inf, low + 0.62 * (high - low), -np.inf], [np.inf] * 3)
rim = es.deformation.region_boundary(giraffe, es.deformation.region_mask(giraffe, neck))
pivot = giraffe.vertices[rim].mean(axis=0)

# %%
# A rig is computed once for each shape; every motion after it is quick.

rig = es.rig_shape(giraffe)
poses = {"as made": giraffe}
for degrees in (40, 80):
    turn = es.Rotation(pivot, axis=[1, 0, 0], angle=np.deg2rad(degrees))
    poses[f"{degrees} degrees"] = es.deform(rig, neck, turn)

# %%
# Colors show how much of the motion each vertex follows.

moved = np.linalg.norm(poses["80 degrees"].vertices - giraffe.vertices, axis=1)
es.plot.figure_poses(poses, moved / moved.max())

# %%
# The giraffe after a turn of 60 degrees, from all sides.
#
# .. turning:: giraffe
